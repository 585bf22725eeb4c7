"""Studies of solidification: what is refused, what a run leaves, what the report shows."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

from analysis.freezing import freezing
from sandmould.engines.outcome import Outcome, RunOutcome
from sandmould.scenario.bad_input import BadInputError
from sandmould.scenario.solidification import Solidification
from sandmould.study.collect import collect
from sandmould.study.expand import expand
from sandmould.study.opening import open_study
from sandmould.study.plan import plan_table, read_run, write_plan, write_study
from sandmould.study.report.page import write_report
from sandmould.study.simulate import measure_run, render_run, simulate

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
        ({"shapes": [BAR, BAR]}, r"scenario.shapes = .* overlaps material 1 at"),
        ({"shapes": [BAR | {"high_m": [0.05, 0.09]}]}, r"shapes.0 = .* a rectangle inside the box"),
        (
            {"shapes": [{"kind": "rectangle", "low_m": [0, 0], "high_m": [0.08, 0.08]}]},
            "there must be a mould",
        ),
        ({"shapes": [BAR | {"high_m": [0.02, 0.06]}]}, "a high_m that is right of and above"),
        ({"element_m": 0.003}, r"shapes = .* multiple of cell_m = 0.003"),
        (
            {"probes": [{"name": "far", "at_m": [0.1, 0.0]}]},
            r"scenario.probes.0.at_m = \[0.1, 0.0\] .* a point in the box",
        ),
        ({"probes": [*SMALL["probes"]] * 2}, "scenario.probes.1.name = 'middle' .* each name once"),
        ({"initial_k": {"casting": 1500.0}}, r"initial_k.casting = 1500.0 .* cast steel, 1713 K"),
        ({"mould": {"density_kg_m3": -1.0}}, r"scenario.mould.density_kg_m3 = -1.0"),
        ({"casting": {"solidus_k": 1900.0}}, "a solidus_k that is not above its liquidus_k"),
        ({"exchange": "difference", "layers": [2]}, r"layers = \[2\] .* empty with exchange"),
        (
            {"exchange": "corrected", "layers": [2], "kernel_size": 1.5},
            "kernel_size = 1.5 .* at least 2 where sizes double",
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
        ({"certificate": {"controls": ["hold"]}}, "absent in a study of kind solidification"),
        ({"material": "rojek_2004"}, "sand = "),
        (
            {"sweep": {"keys": {"element_m": [0.01, 0.005]}}, "reference": {"element_m": 0.002}},
            "reference = .* a point of the sweep, such as {'element_m': 0.01}",
        ),
    ],
)
def test_what_a_study_cannot_ask_is_told(tmp_path: Path, top: dict[str, Any], told: str) -> None:
    with pytest.raises(BadInputError, match=told):
        open_study(opened(tmp_path, top))


def test_a_study_is_computed_collected_and_reported(tmp_path: Path) -> None:
    points = [{"exchange": e, "element_m": s} for e, s in (("faces", 0.01), ("difference", 0.005))]
    study = open_study(
        opened(tmp_path, {"sweep": {"design": "list", "points": points}, "reference": points[1]})
    )
    runs, folder = expand(study), tmp_path / "results"
    assert "element-steps" in plan_table(runs, {}, 1)
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
        assert (of_run / "final.png").stat().st_size > 5000
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
    assert "All settings against element 0.005 m, exchange difference" in page
    assert "The casting is solid after" in page
    assert "Cooling curves" in page


def one_run(folder: Path, **scenario: Any) -> Path:
    """Plan and compute a study of one run; its folder."""
    (run,) = expand(open_study(opened(folder, **scenario)))
    write_plan([run], folder / "results")
    of_run = folder / "results" / "runs" / run.run
    render_run(of_run)
    assert simulate(of_run) == 0
    return of_run


def test_too_long_a_step_is_an_outcome(tmp_path: Path) -> None:
    folder = one_run(tmp_path, stepping="explicit", step_share=3.0)
    outcome = RunOutcome.read(folder / "outcome.json")
    assert outcome.outcome is Outcome.UNSTABLE
    assert "the time step is too long" in outcome.detail
    measure_run(folder)  # what there is


def test_a_run_that_ends_liquid_says_so(tmp_path: Path) -> None:
    folder = one_run(tmp_path, until_s=10.0)
    outcome = RunOutcome.read(folder / "outcome.json")
    assert outcome.outcome is Outcome.FINISHED
    assert "still liquid at 10 s: raise until_s" in outcome.detail
    measure_run(folder)
    last = pd.read_csv(folder / "measures.tsv", sep="\t").iloc[-1]
    assert np.isnan(last["solidification_time_s"])


def test_sizes_that_break_the_rule_are_an_outcome(tmp_path: Path) -> None:
    folder = one_run(tmp_path, exchange="corrected", layers=[2, 1], element_m=0.00125)
    outcome = RunOutcome.read(folder / "outcome.json")
    assert outcome.outcome is Outcome.BAD_INPUT
    assert "the smaller must measure at least 1/c_k" in outcome.detail


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
