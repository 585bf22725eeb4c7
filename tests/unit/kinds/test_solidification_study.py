"""Studies of solidification: what is refused, what a run leaves, what the report shows."""

from __future__ import annotations

import base64
import io
import math
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import meshio
import numpy as np
import pandas as pd
import pytest
import yaml
from matplotlib.figure import Figure
from PIL import Image

from sandmould import ROOT
from sandmould.analysis.casting_plots import (
    draw_freezing,
    draw_modulus,
    draw_niyama,
    draw_temperature,
)
from sandmould.analysis.freezing import freezing
from sandmould.bad_input import BadInputError
from sandmould.casting.arpm import computation
from sandmould.execution.simulate import export_run, measure_run, render_run, simulate
from sandmould.report.cast_fields import cast_fields, distance_from
from sandmould.report.kinds.solidification import _longer
from sandmould.report.page import write_report
from sandmould.runs import checkpoint_file
from sandmould.runs.checkpoint_file import CheckpointFile
from sandmould.runs.formatting import number
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.scenario.casting.shapes import Rectangle
from sandmould.scenario.casting.solidification import Solidification
from sandmould.study.collect import collect
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from sandmould.study.plan.plan_files import plan_table, read_run, write_study
from sandmould.study.plan.price import Prices
from sandmould.study.plan.stand_ins import stand_in_line, stand_ins
from sandmould.wording.answer import AnswerWords
from tests.planned import write_plan
from tests.unit.geometry.test_mesh_union import box, file_of

SMALL: dict[str, Any] = {
    "box": {"low_m": [0.0, 0.0], "high_m": [0.08, 0.08]},
    "shapes": [{"kind": "rectangle", "low_m": [0.03, 0.02], "high_m": [0.05, 0.06]}],
    "probes": [{"name": "middle", "at_m": [0.04, 0.04]}],
    "element_m": 0.005,
    "until_s": 400.0,
}


def opened(folder: Path, top: dict[str, Any] | None = None, /, **scenario: Any) -> Path:
    """Write a study of a bar of steel in sand."""
    study = {"kind": "solidification", "material": "hirata_2019", "scenario": SMALL | scenario,
             "objective": {"measure": "solidification_time_s", "better": "neither"}}  # fmt: skip
    path = folder / "trial.yaml"
    path.write_text(yaml.safe_dump(study | (top or {})))
    return path


BAR = SMALL["shapes"][0]


@pytest.mark.parametrize(
    ("scenario", "told"),
    [
        ({"shapes": [BAR | {"high_m": [0.05, 0.09]}]}, r"shapes.0 = .* a rectangle inside the box"),
        (
            {"shapes": [{"kind": "rectangle", "low_m": [0, 0], "high_m": [0.08, 0.08]}]},
            "there must be a mould",
        ),
        (
            {"shapes": [BAR | {"high_m": [0.02, 0.06]}]},
            "a high_m with as many coordinates as low_m",
        ),
        (
            {"shapes": [BAR | {"low_m": [0.0, 0.02], "high_m": [0.08, 0.06]}], "element_m": 0.003},
            r"shapes = .* multiple of cell_m = 0.003",
        ),
        (
            {"casting": {"solid_fraction": [[1713, 0.5], [1740, 0.7], [1773, 0.0]]}},
            "a solid_fraction of fractions from at most 1 at the solidus that fall",
        ),
        (
            {"casting": {"solid_fraction": "scheil"}},
            "a partition, and a pure_melts_at_k above liquidus_k",
        ),
        (
            {"heat_transfer_w_m2_k": [[300, 500], [1800, -5]]},
            "_k = .* pairs with second numbers greater than 0",
        ),
        ({"mould": {"conductivity_w_m_k": []}}, "conductivity_w_m_k = .* two or more pairs"),
        (
            {"mould": {"conductivity_w_m_k": [[900, 0.5], [300, 0.4]]}},
            "two or more pairs whose first numbers rise",
        ),
        (
            {"exchange": "difference", "heat_transfer_w_m2_k": [[300, 500], [1800, 900]]},
            "exchange = 'difference' .* faces, where a conductivity or heat transfer has a curve",
        ),
        (
            {"air": {"sides": ["low_z"], "temperature_k": 293, "heat_transfer_w_m2_k": 10}},
            r"air.sides = \['low_z'\] .* sides along x and y",
        ),
        ({"casting": {"solidus_k": "1440 C"}}, r"write \{value: 1440, unit: degC, source: ..."),
        (
            {"probes": [{"name": "far", "at_m": [0.1, 0.0]}]},
            r"scenario.probes.0.at_m = \[0.1, 0.0\] .* a point in the box",
        ),
        ({"risers": [1]}, r"risers.0 = 1 .* at most 0, a shape"),
        ({"risers": [0]}, r"risers = \[0\] .* that leave some of the casting for them to feed"),
        ({"read_at_solid_fraction": 1.0}, "read_at_solid_fraction = 1.0 .* less than 1"),
        ({"probes": [*SMALL["probes"]] * 2}, "scenario.probes.1.name = 'middle' .* each name once"),
        ({"initial_k": {"casting": 1500.0}}, r"initial_k.casting = 1500.0 .* cast steel, 1713 K"),
        ({"mould": {"density_kg_m3": -1.0}}, r"scenario.mould.density_kg_m3 = -1.0"),
        ({"casting": {"solidus_k": 1900.0}}, "a solidus_k that is not above its liquidus_k"),
        ({"exchange": "difference", "layers": [2]}, r"layers = \[2\] .* empty with exchange"),
        (
            {
                "exchange": "corrected",
                "heat_transfer_w_m2_k": None,
                "layers": [2],
                "kernel_size": 1.5,
            },
            "kernel_size = 1.5 .* at least 2 where sizes double",
        ),
        *(
            ({"exchange": form}, rf"exchange = '{form}' cannot be used: valid is faces or differ")
            for form in ("printed", "corrected", "symmetric")
        ),
        (
            {"shapes": [{"kind": "polygon", "vertices_m": [[0, 0], [1, 1], [0, 1], [1, 0]]}]},
            "edges that neither cross nor touch",
        ),
    ],
)
def test_what_cannot_solidify_is_told_in_one_sentence(
    tmp_path: Path, scenario: dict[str, Any], told: str
) -> None:
    with pytest.raises(BadInputError, match=told) as refused:
        expand(open_study(opened(tmp_path, **scenario)))
    assert len(refused.value.problems) == 1


@pytest.mark.parametrize(
    ("top", "told"),
    [
        ({"replicates": 2}, "replicates = 2 .* nothing in a run is drawn by lot"),
        ({"certificate": {"controls": ["hold"]}}, "valid is absent: only studies of sand"),
        ({"material": "rojek_2004"}, "a material of kind solidification: .*, hirata_2019"),
        (
            {"sweep": {"keys": {"element_m": [0.01, 0.005]}}, "reference": {"element_m": 0.002}},
            "reference = .* a point of the sweep, such as {'element_m': 0.01}",
        ),
    ],
)
def test_what_a_study_cannot_ask_is_told(tmp_path: Path, top: dict[str, Any], told: str) -> None:
    with pytest.raises(BadInputError, match=told):
        open_study(opened(tmp_path, top))


@pytest.mark.slow
def test_a_study_is_computed_collected_and_reported(tmp_path: Path) -> None:
    points = [{"exchange": e, "element_m": s} for e, s in (("faces", 0.01), ("difference", 0.005))]
    study = open_study(
        opened(tmp_path, {"sweep": {"design": "list", "points": points}, "reference": points[1]})
    )
    runs, folder = expand(study), tmp_path / "results"
    assert "element-steps" in plan_table(runs, Prices(), 1)
    write_plan(runs, folder)
    write_study(study.study, folder)
    for run in runs:
        of_run = folder / "runs" / run.run
        back = read_run(of_run / "scenario.yaml")
        assert isinstance(back.scenario, Solidification)
        assert back == run
        render_run(of_run)
        deck = (of_run / "deck.in").read_text()
        assert "casting.solidus_k = 1713.0" in deck
        assert "# stand-in: 1440 degrees C, carbon steel" in deck
        assert simulate(of_run) == 0
        measure_run(of_run)
        export_run(of_run)
        assert (of_run / "final.png").stat().st_size > 5000
        degc = pd.read_csv(of_run / "cooling_curves.csv")["middle_degc"]
        series = pd.read_csv(of_run / "series.tsv", sep="\t")
        np.testing.assert_allclose(degc, series["middle_k"] - 273.15, atol=0.01)
    collect(folder)
    summary = pd.read_csv(folder / "summary.tsv", sep="\t")
    assert summary["elements"].tolist() == [64, 256]
    assert (summary["element_steps"] > 0).all()
    # faces keep the heat to round-off
    assert (summary["enthalpy_drift_fraction"].abs() < 1e-10).all()
    coarse, fine = summary["solidification_time_s"]
    # Elements of half the bar's width against a quarter of it: the same metal and mould, so nearly
    # the same time; a wrong resistance or latent heat changes it by a factor.
    assert coarse == pytest.approx(fine, rel=0.3)
    # the bar freezes from its sides, so last in its middle
    assert summary["last_point_x_m"].tolist() == pytest.approx([0.04] * 2, abs=0.006)
    assert summary["last_point_y_m"].tolist() == pytest.approx([0.04] * 2, abs=0.011)
    curves = pd.read_csv(folder / "curves.tsv", sep="\t")
    assert curves["solidified_fraction"].max() == 1.0
    write_report(folder, folder / "report.html")
    page = (folder / "report.html").read_text()
    assert (
        '<p class="first">The cheapest setting within 5' in page
        or "No setting comes within" in page
    )
    assert "All settings against element 5 mm, exchange difference" in page
    assert re.search("Last, with element [^:]+: the casting is solid after", page)
    assert "no shape is named as a riser, so nothing feeds that place" in page
    assert "Temperature at the probes of run" in page
    assert "Cooling curves" in page
    assert "Placeholder values" in page
    assert "casting solidus" in page
    names = {path.name for path in (folder / "figures").iterdir()}
    assert {"fields.png", "error_cost.svg", "curves.svg"} <= names
    assert Image.open(folder / "figures" / "fields.png").width > 200


def one_run(folder: Path, **scenario: Any) -> Path:
    """Plan and compute a study of one run; its folder."""
    (run,) = expand(open_study(opened(folder, **scenario)))
    write_plan([run], folder / "results")
    of_run = folder / "results" / "runs" / run.run
    render_run(of_run)
    assert simulate(of_run) == 0
    return of_run


def measured(folder: Path, **scenario: Any) -> Path:
    """Compute and measure a study of one run; its folder."""
    of_run = one_run(folder, **scenario)
    measure_run(of_run)
    return of_run


def test_a_short_riser_leaves_a_plate_without_feed(tmp_path: Path) -> None:
    def shape(*corners: float) -> dict[str, Any]:
        return {"kind": "rectangle", "low_m": [*corners[:2]], "high_m": [*corners[2:]]}

    plate, neck = shape(0.01, 0.02, 0.03, 0.05), shape(0.03, 0.03, 0.04, 0.035)
    riser = shape(0.04, 0.02, 0.05, 0.05)
    folder = measured(tmp_path, shapes=[plate, neck, riser], risers=[2], element_m=0.0025,
                      record_s=1.0)  # fmt: skip
    fields = np.load(folder / "fields.npz")
    assert fields["volume_m3"][fields["riser"]].sum() == pytest.approx(300e-6)
    last = pd.read_csv(folder / "measures.tsv", sep="\t").iloc[-1]
    # of 600 mm2 of plate and 50 of neck nearly all, when the neck closes
    assert 0.5 < last["cut_off_fraction"] < 1.0
    assert 0.0 < last["low_niyama_fraction"] < 0.5
    # a plate 20 mm thick and 30 mm high in sand is no thicker than one of 20 mm without end
    assert 0.004 < np.nanmax(fields["modulus_m"]) < 0.0102
    assert "cut_off_fraction" in (folder / "measures.tsv").read_text()
    own = fields["melts"] & ~fields["riser"]
    found = cast_fields(folder, read_run(folder / "scenario.yaml").scenario)
    text, (next_step,) = found[2][0], found[5]
    where = found[2][1].partition(" of liquid (")[2].partition(")")[0]
    assert next_step.text == (
        f"Let a riser reach the liquid that is cut off at {where}, make the riser there larger, or "
        "let a chill freeze it early."
    )
    first, risers = (np.nanmax(fields["frozen_s"][part]) for part in (own, fields["riser"]))
    assert text.startswith(f"Last: the part is solid after {number(first)} s, last at x = ")
    ending = f"; the riser is after {number(risers)} s." if risers > first else (
        "; that is later than the riser.")  # fmt: skip
    assert text.endswith(ending)


def test_both_halves_are_told_and_a_riser_that_is_too_low(tmp_path: Path) -> None:
    def shape(*corners: float) -> dict[str, Any]:
        return {"kind": "rectangle", "low_m": [*corners[:2]], "high_m": [*corners[2:]]}

    left, right = shape(0.01, 0.02, 0.025, 0.06), shape(0.055, 0.02, 0.07, 0.06)
    bar, riser = shape(0.025, 0.0375, 0.055, 0.0425), shape(0.035, 0.0325, 0.045, 0.0475)
    for shapes, is_low in (([left, right, bar, riser], True), ([bar, left, riser], False)):
        if not is_low:
            shapes[1] = shape(0.01, 0.02, 0.025, 0.0475)
        folder = measured(tmp_path, shapes=shapes, risers=[shapes.index(riser)], record_s=1.0,
                          element_m=0.0025)  # fmt: skip
        found = cast_fields(folder, read_run(folder / "scenario.yaml").scenario)
        told = " ".join(found.said)
        steps = " ".join(it.text for it in found.riser)
        assert ("So is 1 place of the same size." in told) == is_low
        assert ("so too the other place of that size" in steps) == is_low
        above = "Height: the part reaches 12.5 mm higher than its riser, if y points up."
        assert (above in told) == is_low
        assert ("at least 12.5 mm higher, or turn" in steps) == is_low
        heads = [column.title for column in found.tables[1].columns]
        assert heads[-1] == "path to the nearest riser, mm"


def test_what_a_riser_shares_with_the_part_is_riser(tmp_path: Path) -> None:
    plate = {"kind": "rectangle", "low_m": [0.01, 0.02], "high_m": [0.07, 0.03]}
    boss = {"kind": "rectangle", "low_m": [0.03, 0.03], "high_m": [0.05, 0.045]}
    riser = boss | {"high_m": [0.05, 0.05]}
    found = []
    for shapes in ([plate, boss, riser], [riser, plate, boss], [plate, riser]):
        risers = [shapes.index(riser)]
        folder = measured(tmp_path, shapes=shapes, risers=risers, element_m=0.0025, record_s=1.0)
        found.append(np.load(folder / "fields.npz"))
        last = pd.read_csv(folder / "measures.tsv", sep="\t").iloc[-1]
        # the boss freezes last of all, and lies in the riser
        assert 0.03 < last["last_point_y_m"] < 0.045
        own = found[-1]["melts"] & ~found[-1]["riser"]
        part_s = found[-1]["frozen_s"][own].max()
        assert last["part_solidification_time_s"] == pytest.approx(part_s)
        assert part_s < last["solidification_time_s"]
        assert found[-1]["volume_m3"][own].sum() == pytest.approx(600e-6)
        said = cast_fields(folder, read_run(folder / "scenario.yaml").scenario)[2]
        assert "; the riser is after" in said[0]
        assert said[1].startswith("Feeding: the riser feeds all of the casting")
    for name in found[0].files:
        np.testing.assert_array_equal(found[0][name], found[1][name])
        np.testing.assert_array_equal(found[0][name], found[2][name])


def test_pictures_outline_risers_and_have_all_colours(tmp_path: Path) -> None:
    riser = BAR | {"low_m": [0.03, 0.05], "high_m": [0.05, 0.07]}
    folder = one_run(tmp_path, shapes=[BAR, riser], risers=[1])
    picture = cast_fields(folder, read_run(folder / "scenario.yaml").scenario)[0].partition(",")[2]
    with Image.open(io.BytesIO(base64.b64decode(picture))) as image:
        assert len(image.convert("RGB").getcolors(1 << 20) or ()) > 512
    fields = dict(np.load(folder / "fields.npz"))
    frozen = freezing(*(fields[name][fields["melts"]] for name in ("position_m", "frozen_s")), 0.02)
    bodies = [[Rectangle.model_validate(shape).solid] for shape in (BAR, riser)]
    for draw in (draw_freezing, draw_temperature, draw_modulus, draw_niyama):
        axes = Figure().subplots()
        draw(fields, frozen, axes, [distance_from(body) for body in bodies])
        dashes = [lines.get_linestyle()[0][1] for lines in axes.collections]
        assert [pattern is None for pattern in dashes] == [True, False]


def test_a_place_that_freezes_with_the_last_is_counted(tmp_path: Path) -> None:
    bars = [BAR | {"low_m": [x, 0.03], "high_m": [x + 0.02, 0.05]} for x in (0.01, 0.05)]
    for shapes, beside in (
        (bars, " and, within 1 % of that time, at 1 other hot spot."),
        ([BAR], "."),
    ):
        folder = measured(tmp_path, shapes=shapes)
        found = cast_fields(folder, read_run(folder / "scenario.yaml").scenario)
        said, (riser,) = found.said, found.riser
        place = said[0].partition(", last at ")[2]
        assert place.endswith(f" mm{beside}")
        # nothing is named as a riser
        modulus_m = np.nanmax(np.load(folder / "fields.npz")["modulus_m"])
        at = place.removesuffix(beside)
        assert riser.text == (
            f"Name a riser (risers) that feeds {at}, where the casting freezes last. Its modulus "
            f"must be larger than that of the casting there, {number(1e3 * modulus_m)} mm, as a "
            f"rule by a fifth.{' The other hot spot needs one, too.' if len(shapes) > 1 else ''}"
        )


def test_a_number_without_a_section_is_named_among_placeholders() -> None:
    (run,) = expand(open_study(ROOT / "config" / "studies" / "riser.yaml"))
    found = stand_ins(run)
    assert found == ("initial_k.casting", "initial_k.mould", "heat_transfer_w_m2_k")
    words = AnswerWords(SimpleNamespace(stand_ins=found))
    assert words.stand_in_sections == "heat transfer and initial temperatures"
    assert "to be replaced by those of your own material: initial_k.casting, " in stand_in_line(run)


def test_a_run_that_ends_liquid_says_so(tmp_path: Path) -> None:
    folder = one_run(tmp_path, until_s=10.0)
    outcome = RunOutcome.read(folder / "outcome.json")
    assert outcome.outcome is Outcome.FINISHED
    assert "still liquid at 10 s: raise until_s" in outcome.detail
    measure_run(folder)
    last = pd.read_csv(folder / "measures.tsv", sep="\t").iloc[-1]
    assert np.isnan(last["solidification_time_s"])
    (step,) = _longer(pd.DataFrame({"detail": [outcome.detail, float("nan")]}))
    assert step.line == "scenario: {until_s: 20000}"
    assert _longer(pd.DataFrame({"detail": [""]})) == ()


def test_sizes_that_break_the_rule_are_told_before_anything_starts(tmp_path: Path) -> None:
    uneven: dict[str, Any] = {
        "exchange": "corrected",
        "heat_transfer_w_m2_k": None,
        "layers": [2, 1],
        "element_m": 0.00125,
    }
    told = r"layers = \[2, 1\] .* the smaller must measure at least 1/c_k"
    with pytest.raises(BadInputError, match=told):
        expand(open_study(opened(tmp_path, **uneven)))
    for changed in ({"layers": [4]}, {"exchange": "faces"}):
        assert expand(open_study(opened(tmp_path, **uneven | changed)))


def test_hot_spots_are_the_latest_within_reach() -> None:
    place = np.array([[0.0], [1.0], [2.0], [3.0], [4.0]])
    found = freezing(place, np.array([1.0, 5.0, 2.0, 3.0, 7.0]), 1.5)
    assert found.hot_spots_m.tolist() == [[4.0], [1.0]]
    assert found.hot_spot_s.tolist() == [7.0, 5.0]
    assert (found.solidification_time_s, found.last_point_m.tolist()) == (7.0, [4.0])
    # farther off the second is no longer the latest of its surroundings
    assert freezing(place, np.array([1.0, 5.0, 2.0, 3.0, 7.0]), 3.5).hot_spots_m.tolist() == [[4.0]]
    liquid = freezing(place, np.array([1.0, 5.0, np.nan, 3.0, 7.0]), 1.5)
    assert np.isnan(liquid.solidification_time_s)
    assert liquid.hot_spots_m[0].tolist() == [2.0]
    with pytest.raises(ValueError, match="reach_m = 0"):
        freezing(place, np.ones(5), 0.0)


@pytest.mark.parametrize("reach_m", [0.02, 0.1, 0.4])
def test_hot_spots_are_those_of_all_pairs(reach_m: float) -> None:
    random = np.random.default_rng(1)
    place_m, frozen_s = random.random((300, 3)), random.integers(0, 40, 300).astype(float)
    apart_m = np.linalg.norm(place_m[:, None] - place_m, axis=2)
    turn = np.argsort(np.argsort(-frozen_s, kind="stable"))
    first = np.where(apart_m <= reach_m, turn, 300).min(axis=1) == turn
    expected = place_m[first][np.argsort(turn[first])]
    np.testing.assert_array_equal(freezing(place_m, frozen_s, reach_m).hot_spots_m, expected)


TETRAHEDRON = """\
solid corner
{}
endsolid corner
"""


def tetrahedron(path: Path, side: float) -> None:
    """Write a corner cut off a cube as an ASCII STL file."""
    corners = np.vstack([np.zeros(3), side * np.eye(3)])
    facets = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    text = "\n".join(
        "facet normal 0 0 0\nouter loop\n"
        + "\n".join("vertex {} {} {}".format(*corners[i]) for i in facet)
        + "\nendloop\nendfacet"
        for facet in facets
    )
    path.write_text(TETRAHEDRON.format(text))


def test_a_mesh_is_cast_in_3d_with_a_block_beside_it(tmp_path: Path) -> None:
    tetrahedron(tmp_path / "corner.stl", 40.0)
    mesh = {"kind": "mesh", "file": "corner.stl", "unit_m": 0.001, "position_m": [0.02] * 3}
    block = {"kind": "rectangle", "low_m": [0.01, 0.02, 0.02], "high_m": [0.02, 0.06, 0.06]}
    folder = measured(
        tmp_path,
        box={"low_m": [0.0] * 3, "high_m": [0.08] * 3},
        shapes=[block, mesh],
        probes=[{"name": "middle", "at_m": [0.03, 0.03, 0.03]}],
        until_s=2000.0,
    )
    table = pd.read_csv(folder / "measures.tsv", sep="\t")
    assert {"last_point_z_m", "middle_k"} <= set(table.columns)
    assert abs(table["enthalpy_drift_fraction"]).max() < 1e-12  # faces conserve to round-off
    with np.load(folder / "fields.npz") as fields:
        cast_m3 = float(fields["volume_m3"][fields["melts"]].sum())
    # the block is 16 cm3, exactly of cells; the corner 40^3/6 mm3, to what its sharp tips lose
    assert cast_m3 - 16e-6 == pytest.approx(0.04**3 / 6, rel=0.01)
    export_run(folder)
    vtk = meshio.read(folder / "fields.vtu")
    assert [block.type for block in vtk.cells] == ["hexahedron"]
    assert len(vtk.points) == 17**3
    assert (folder / "final.png").stat().st_size > 10_000


def test_a_flat_mesh_freezes_as_in_2d_in_a_box_that_ends_at_it(tmp_path: Path) -> None:
    # 0.05 m as the file has it is larger by a part in 1e8
    plate = box([0.03, 0.02, -0.05], [0.05, 0.06, 0.05])
    mesh = {"kind": "mesh", "file": file_of([plate], tmp_path).name, "unit_m": 1.0}
    room = {"low_m": [0.0, 0.0, -0.05], "high_m": [0.08, 0.08, 0.05]}
    runs = [
        measured(tmp_path, **changed)
        for changed in ({}, {"shapes": [mesh], "box": room, "probes": []})
    ]
    flat_s, plate_s = (
        pd.read_csv(run / "measures.tsv", sep="\t")["solidification_time_s"].iloc[-1]
        for run in runs
    )
    assert plate_s == pytest.approx(flat_s, rel=1e-6)


def test_touching_parts_are_one_casting(tmp_path: Path) -> None:
    low, high = (
        BAR | {"high_m": [0.05, 0.04]},
        BAR | {"low_m": [0.03, 0.04]},
    )
    found = []
    for place, shapes in enumerate(([BAR], [low, high])):
        folder = tmp_path / str(place)
        folder.mkdir()
        found.append((one_run(folder, shapes=shapes) / "series.tsv").read_bytes())
    assert found[0] == found[1]


def test_dark_pixels_are_cast(tmp_path: Path) -> None:
    rows = np.full((16, 16), 255, dtype=np.uint8)
    rows[4:12, 6:10] = 0  # from the top: the bar of SMALL, upright
    Image.fromarray(rows).save(tmp_path / "bar.png")
    picture = {"kind": "image", "file": "bar.png", "pixel_m": 0.005}
    runs = [one_run(tmp_path, shapes=[shape]) for shape in (picture, BAR)]
    drawn, stated = (pd.read_csv(run / "series.tsv", sep="\t") for run in runs)
    pd.testing.assert_frame_equal(drawn, stated)


@pytest.mark.parametrize("way", ["faces", "difference"])
def test_a_bar_that_is_turned_freezes_as_it_did_upright(tmp_path: Path, way: str) -> None:
    # 20 mm of aluminium in a die with 1000 W/m2/K: 21 % faster when the resistance acts on steps
    metals = {
        "casting": {"density_kg_m3": 2500.0, "heat_capacity_j_kg_k": 1000.0,
                    "conductivity_w_m_k": 120.0, "latent_heat_j_kg": 390e3, "solidus_k": 830.0,
                    "liquidus_k": 880.0},
        "mould": {"density_kg_m3": 7800.0, "heat_capacity_j_kg_k": 500.0,
                  "conductivity_w_m_k": 40.0},
        "initial_k": {"casting": 950.0, "mould": 500.0},
        "heat_transfer_w_m2_k": 1000.0,
    }  # fmt: skip
    ends_s = []
    d = math.sqrt(2)
    upright = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    turned = ((0, -d), (d, 0), (0, d), (-d, 0))
    for name, half in (("upright", upright), ("turned", turned)):
        folder = tmp_path / name
        folder.mkdir()
        corners = [[0.04 + 0.01 * x, 0.04 + 0.01 * y] for x, y in half]
        bar = {"kind": "polygon", "vertices_m": corners}
        run = measured(folder, **metals, shapes=[bar], exchange=way, element_m=0.00125)
        table = pd.read_csv(run / "measures.tsv", sep="\t")
        assert abs(table["enthalpy_drift_fraction"]).max() < 1e-12
        ends_s.append(table["solidification_time_s"].iloc[-1])
    # 0.4 % measured
    assert ends_s[1] == pytest.approx(ends_s[0], rel=0.01)


@pytest.mark.parametrize(
    ("shape", "told"),
    [
        ({"kind": "image", "file": "none.png", "pixel_m": 0.005}, "a readable file"),
        ({"kind": "image", "file": "trial.yaml", "pixel_m": 0.005}, "a picture, such as a PNG"),
        ({"kind": "image", "file": "white.png", "pixel_m": 0.005}, "with dark pixels for"),
        (
            {"kind": "mesh", "file": "corner.stl", "unit_m": 0.001},
            "a shape of 2D as the box is, or a box with three coordinates; where it ends at both",
        ),
    ],
)
def test_files_that_hold_no_casting_are_told(
    tmp_path: Path, shape: dict[str, Any], told: str
) -> None:
    tetrahedron(tmp_path / "corner.stl", 40.0)
    Image.fromarray(np.full((4, 4), 255, dtype=np.uint8)).save(tmp_path / "white.png")
    with pytest.raises(BadInputError, match=told) as refused:
        expand(open_study(opened(tmp_path, shapes=[shape])))
    assert len(refused.value.problems) == 1


def test_a_killed_run_goes_on_where_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    straight = (one_run(tmp_path, layers=[1]) / "series.tsv").read_bytes()
    monkeypatch.setattr(checkpoint_file, "INTERVAL_S", 0.0)
    (run,) = expand(open_study(opened(tmp_path, layers=[1])))
    kept_s: list[float] = []
    keep = CheckpointFile.write_when_due

    def killed(self: CheckpointFile, arrays: Callable[[], Mapping[str, Any]]) -> None:
        keep(self, arrays)
        kept_s.append(float(arrays()["time_s"]))
        if kept_s == [5.0, 10.0, 15.0]:
            raise KeyboardInterrupt

    monkeypatch.setattr(CheckpointFile, "write_when_due", killed)
    with pytest.raises(KeyboardInterrupt):
        computation.compute(run.scenario, tmp_path, run.run)
    computation.compute(run.scenario, tmp_path, run.run)
    assert kept_s[3] == 20.0
    assert (tmp_path / "work" / "series.tsv").read_bytes() == straight


def test_a_torn_checkpoint_begins_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (run,) = expand(open_study(opened(tmp_path, until_s=20.0)))
    (tmp_path / "work").mkdir()
    (tmp_path / "work" / computation.CHECKPOINT).write_bytes(b"PK\x03\x04 torn")
    computed = computation.compute(run.scenario, tmp_path, run.run)
    assert computed.outcome.outcome is Outcome.FINISHED
    assert computed.outcome.simulated_s == 20.0
    assert "the run begins again" in capsys.readouterr().err
