"""One run by the reference engine from its folder: products, loads, kill and resume."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from sandmould.engines.program import build_program
from sandmould.engines.reference.session import ReferenceSession
from sandmould.engines.session import RefusedError, StepMover
from sandmould.engines.snapshot import stored_snapshots
from sandmould.execution.simulate import RESTARTABLE_EXIT
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.runs.run_tables import read_costs
from sandmould.scenario.scenario import Scenario
from tests.scenes import tube_scene
from tests.snapshots import write_snapshots
from tests.workflow.runs import (
    SOON,
    computed,
    drive,
    kill_after_a_checkpoint,
    last_snapshot,
    run_folder,
    simulate,
)

TWO_LAYERS = {
    "fill": {"layers": [{"count": 60, "repeat": 2}]},
    "engine": {"name": "reference"},
    "rest": SOON,
}
SPHERES = {
    "dimension": 3,
    "box": {"depth_m": 0.03},
    "time_step": {"fraction": 0.5},
    "fill": {"layers": [{"count": 120}]},
    "rest": {"rms_speed_m_s": 0.3},
}


def scene(**changes: Any) -> Scenario:
    return tube_scene(**(TWO_LAYERS | changes))


@pytest.fixture(scope="module")
def straight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Compute the small scene without a stop."""
    return computed(scene(), tmp_path_factory.mktemp("straight"))


def test_run_leaves_all_its_products_and_no_work(straight: Path) -> None:
    names = {p.name for p in straight.iterdir()}
    assert {"outcome.json", "products.json", "series.tsv", "loads.tsv",
            "snapshots.npz", "deck.in", "layers"} <= names  # fmt: skip
    assert "work" not in names
    assert RunOutcome.read(straight / "outcome.json").outcome is Outcome.FINISHED
    assert read_costs([straight]).rows.engine[0] == "reference"
    loads = pd.read_csv(straight / "loads.tsv", sep="\t")
    assert {"floor", "left", "right", "tube_lower", "tube_upper"} == set(loads.surface)


def test_failed_run_asked_for_again_begins_anew(tmp_path: Path) -> None:
    guarded = scene(
        guard={"largest_overlap_fraction": 0.002},
        record={"series_every_s": 0.005, "checkpoint_every_s": 0.005},
    )
    ended = []
    for _ in range(2):
        outcome = drive(guarded, tmp_path)
        ended.append((outcome, (tmp_path / "series.tsv").read_text(encoding="utf-8")))
        assert list(tmp_path.glob("last_work/checkpoint_*/mark.json"))
        for product in ("outcome.json", "series.tsv"):  # what Snakemake removes first
            (tmp_path / product).unlink()
    assert ended[0][0].outcome is Outcome.OVERLAP_TOO_LARGE
    assert ended[0] == ended[1]


def test_disk_that_takes_no_more_is_told_and_the_run_goes_on_with_room(
    straight: Path, tmp_path: Path
) -> None:
    folder = run_folder(scene(), tmp_path)
    largest = (straight / "snapshots.npz").stat().st_size
    assert simulate(folder, largest_file_bytes=largest // 2) == RESTARTABLE_EXIT
    outcome = RunOutcome.read(folder / "work" / "outcome.json")
    assert outcome.outcome is Outcome.DISK_REFUSED
    assert "File too large" in outcome.detail
    assert not (folder / "outcome.json").exists()
    assert simulate(folder) == 0
    np.testing.assert_array_equal(
        last_snapshot(folder).position_m, last_snapshot(straight).position_m
    )
    assert (folder / "series.tsv").read_text() == (straight / "series.tsv").read_text()


def test_killed_run_resumes_and_ends_as_if_never_stopped(tmp_path: Path) -> None:
    # Long enough that the kill comes in the middle.
    stage = {"acceleration_g": 1.5, "frequency_hz": 50.0, "duration_s": 1.0}
    shaken = scene(vibration=[stage])
    folders = []
    for name in ("straight", "killed"):
        (tmp_path / name).mkdir()
        folders.append(run_folder(shaken, tmp_path / name))
    straight, killed = folders
    assert simulate(straight) == 0
    kill_after_a_checkpoint(killed)
    assert simulate(killed) == 0
    one, two = last_snapshot(straight), last_snapshot(killed)
    for name in ("position_m", "velocity_m_s", "spin_rad_s"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
    for table in ("series.tsv", "loads.tsv"):
        assert (killed / table).read_text() == (straight / table).read_text()


def test_weight_of_a_bed_at_rest_is_the_load_on_floor_walls_and_tube(tmp_path: Path) -> None:
    fill = {"layers": [{"count": 120}], "settling": {"longest_s": 9.0}}
    still = scene(fill=fill, rest={"rms_speed_m_s": 1e-5}, vibration=[])
    assert drive(still, tmp_path).outcome is Outcome.FINISHED
    loads = pd.read_csv(tmp_path / "loads.tsv", sep="\t")
    last = loads[loads.time_s == loads.time_s.max()]
    snapshot = last_snapshot(tmp_path)
    mass = sum(still.sand.grain_mass_kg(2 * r, 2) for r in snapshot.radius_m)
    weight = mass * still.gravity_m_s2
    # The bed still moves by its rest rule, some 1e-5 m/s; 0.1 % of g over a window is 2e-4 m/s.
    assert last.force_y_n.sum() == pytest.approx(-weight, rel=1e-3)
    assert last.force_x_n.sum() == pytest.approx(0, abs=1e-3 * weight)


@pytest.mark.parametrize(
    "changes",
    [{}, {"frame": "laboratory"}, SPHERES],
    ids=["box", "laboratory", "3D with turned facets"],
)
@pytest.mark.parametrize("place", [-2, -1], ids=["vibrating", "stopping"])
def test_restored_session_goes_on_bit_for_bit(
    place: int, changes: dict[str, Any], tmp_path: Path
) -> None:
    program = build_program(scene(**changes))
    session = ReferenceSession(program)
    for stage in (program.stages[0], program.stages[place]):
        if stage.layer:
            session.insert_layer(1)
        session.start_stage(stage)
        while not (session.stage_over if stage.layer else session.can_checkpoint):
            session.advance()
    session.write_checkpoint(tmp_path)
    restored = ReferenceSession(program, tmp_path)
    for both in (session, restored):
        both.advance()
    one, two = session.snapshot(), restored.snapshot()
    for name in ("time_s", "vibration_time_s", "position_m", "velocity_m_s", "spin_rad_s"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
    assert session.surface_loads() is not None
    for name, force in (session.surface_loads() or {}).items():
        np.testing.assert_array_equal(force, (restored.surface_loads() or {})[name])


def test_a_block_pushed_into_the_bed_carries_a_load(tmp_path: Path) -> None:
    program = build_program(scene())
    session = ReferenceSession(program)
    session.insert_layer(1)
    session.start_stage(program.stages[0])
    while not session.stage_over:
        session.advance()
    before = session.snapshot().position_m[:, 1].mean()
    lower = session.solver.surfaces.vertices_of("tube_lower")
    vertices = session.solver.surfaces.arrays.vertices[lower].copy()
    session.start_stage(program.stages[0])
    session.move_surface("tube_lower", vertices - [0.0, 0.004], 0.02)
    session.advance(0.02)
    np.testing.assert_allclose(
        session.solver.surfaces.arrays.vertices[lower], vertices - [0.0, 0.004], atol=1e-12
    )
    assert session.snapshot().position_m[:, 1].mean() != before
    with pytest.raises(RefusedError, match="a surface made of facets"):
        session.move_surface("nothing", vertices, 0.02)
    with pytest.raises(RefusedError, match="a surface made of facets"):
        session.attach_mover("nothing", StepMover(0, 0, vertices, vertices))


@pytest.mark.parametrize("changes", [{}, SPHERES], ids=["2D", "3D"])
def test_orientations_are_recorded_where_asked(changes: dict[str, Any], tmp_path: Path) -> None:
    short = {"record": {"orientation": True, "series_every_s": 0.005}, "vibration": []}
    program = build_program(scene(**(changes | short)))
    session = ReferenceSession(program)
    session.insert_layer(1)
    session.start_stage(program.stages[0])
    for _ in range(20):
        session.advance()
    write_snapshots(tmp_path, [session.snapshot()])
    (stored,) = stored_snapshots(tmp_path)
    kept = stored.load()
    assert kept.orientation is not None
    d = program.scenario.dimension
    assert kept.orientation.shape == (len(kept.id), 1 if d == 2 else 9)
    if d == 2:
        assert np.ptp(kept.orientation) > 0.01
    else:
        turned = kept.orientation.reshape(-1, 3, 3)
        unit = np.broadcast_to(np.eye(3), turned.shape)
        np.testing.assert_allclose(turned @ turned.transpose(0, 2, 1), unit, atol=1e-9)
        assert np.abs(turned - unit).max() > 0.01
