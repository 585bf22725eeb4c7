"""What a run that bends a pattern in 3D leaves: measures, files, picture of its cut, film."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest

from sandmould.casting.arpm.scene import solids_of
from sandmould.drawing.sphere_film import sphere_frames
from sandmould.drawing.sphere_scene import sphere_scene
from sandmould.engines.snapshot import Snapshot
from sandmould.geometry.mesh import TriangleMesh
from sandmould.kinds.sand.bending import BentPattern
from sandmould.kinds.sand.bent_files import write_bent
from sandmould.pattern_fe.coupling.foam_body import FoamBody
from sandmould.pattern_fe.coupling.interface import with_surface
from sandmould.pattern_fe.scene import pattern_of
from sandmould.report.bending_figures import _lines_m, draw_outlines
from sandmould.scenario.scenario import Scenario
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from tests.patterns import _one_thread  # noqa: F401
from tests.snapshots import write_snapshots

LOAD_N = -0.05


def bar_run(folder: Path) -> tuple[Scenario, Snapshot]:
    """A bar that hangs from the left wall, bent by a load on its free end, in one snapshot."""
    told = {
        "shape": {"kind": "bar", "width_m": 0.06, "height_m": 0.01},
        "position_m": [0.0, 0.01, 0.03],
        "depth_m": 0.02,
        "element_m": 0.02,
        "supports": {"clamped": ["left"]},
    }
    box = {"width_m": 0.1, "depth_m": 0.05, "height_m": 0.08}
    scenario = with_surface(Scenario(dimension=3, box=box, pattern=told))  # type: ignore[arg-type]
    body = FoamBody(pattern_of(scenario))
    end = body.vertices_m[:, 0] > 0.06 - 1e-9
    load = np.zeros_like(body.vertices_m)
    load[end, 2] = LOAD_N / end.sum()
    one, none = np.array([1]), np.zeros((1, 3))
    place_m = np.array([[0.05, 0.02, 0.044]])
    snapshot = Snapshot(
        0.1, np.nan, "settle_1", one, one, place_m, none, none, np.array([0.002]),
        pattern_m=body.vertices_m + body.solve(load).displacement_m, pattern_load_n=load,
    )  # fmt: skip
    write_snapshots(folder, [snapshot])
    return scenario, snapshot


def test_a_bar_in_space_is_measured_and_written(tmp_path: Path) -> None:
    scenario, snapshot = bar_run(tmp_path)
    row = BentPattern(scenario).row(snapshot)
    # Euler and Bernoulli, a little more by shear and less by the held end's corners
    beam_m = -LOAD_N * 0.06**3 / (3 * 6.4e6 * 0.02 * 0.01**3 / 12)
    assert row["pattern_tip_deflection_m"] == pytest.approx(beam_m, rel=0.1)
    assert row["pattern_tip_answered_m"] == pytest.approx(row["pattern_tip_deflection_m"])
    assert row["pattern_distance_largest_m"] == pytest.approx(beam_m, rel=0.1)
    assert "pattern_predicted_limit" not in row
    out = tmp_path / "exports"
    write_bent(scenario, tmp_path, out)
    solid, surface = (meshio.read(out / f"pattern_final.{kind}") for kind in ("stl", "vtu"))
    assert solid.points.min(axis=0) == pytest.approx(snapshot.pattern_m.min(axis=0), abs=1e-7)
    np.testing.assert_allclose(surface.points, snapshot.pattern_m)


def test_the_bent_bar_is_the_casting_of_a_study(tmp_path: Path) -> None:
    scenario, snapshot = bar_run(tmp_path)
    write_bent(scenario, tmp_path, tmp_path / "exports")
    study = tmp_path / "freezes.yaml"
    study.write_text(
        "kind: solidification\nbased_on: bracket_freezes\nscenario:\n"
        "  shapes: [{kind: mesh, name: bar, file: exports/pattern_final.stl}]\n"
        "  box: {low_m: [-0.02, 0, 0], high_m: [0.08, 0.04, 0.06]}\n"
        "  probes: [{name: middle, at_m: [0.03, 0.02, 0.035]}]\n",
        encoding="utf-8",
    )
    (cast,) = solids_of(expand(open_study(study))[0].scenario)
    assert snapshot.pattern_m is not None
    bent = TriangleMesh("bent", snapshot.pattern_m, scenario.scene.meshes[0].triangles)
    # seven digits of an STL file
    assert cast.measure == pytest.approx(bent.measure, rel=1e-6)
    assert bent.measure != pytest.approx(scenario.scene.meshes[0].measure, rel=1e-6)


def test_its_cut_is_drawn_and_the_film_shows_it_bent(tmp_path: Path) -> None:
    scenario, snapshot = bar_run(tmp_path)
    (solid,) = scenario.scene.meshes
    (line_m,) = _lines_m(solid, snapshot.pattern_m)
    # through its middle, as deep in the end as the whole bar has sunk there
    assert line_m.min(axis=0) == pytest.approx(snapshot.pattern_m.min(axis=0)[[0, 2]], abs=2e-5)
    assert np.ptp(line_m[:, 0]) == pytest.approx(0.06, rel=1e-2)
    picture, said = draw_outlines(tmp_path, scenario)
    assert picture.startswith("data:image/png")
    assert said.endswith("at the end")
    frames = sphere_frames([snapshot], scenario, "bar", "best", (0.0, 1.0))
    film, n = frames.whole, len(snapshot.id)
    assert (film.grains, film.vertices) == (n, len(snapshot.pattern_m))
    bent_m = np.array(film.origin_m) + film.quantum_m * frames.place[:, 0, n:].T
    assert np.abs(bent_m - snapshot.pattern_m).max() <= 0.5 * film.quantum_m * (1 + 1e-9)
    (drawn,) = sphere_scene(scenario, 0.05)["solids"]
    assert drawn["bends"]
    assert drawn["vertices"] == film.vertices
