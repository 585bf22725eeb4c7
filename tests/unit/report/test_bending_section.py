"""The report of runs that bend a pattern: band, verdicts, files, what the paper states."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from sandmould.definition.run import Run
from sandmould.drawing import figures
from sandmould.kinds.sand.bent_files import write_bent
from sandmould.kinds.sand.measure import write_measures
from sandmould.pattern_fe.coupling.convergence_log import CONVERGENCE_LOG
from sandmould.pattern_fe.coupling.foam_body import FoamBody
from sandmould.pattern_fe.coupling.interface import with_surface
from sandmould.pattern_fe.scene import pattern_of
from sandmould.report.bending import (
    TIP,
    _foam_sentences,
    _tip_sentences,
    bending_pages,
    deflection_chart,
    paper_sentences,
)
from sandmould.report.page import write_report
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.scenario.fill import Fill, Layer
from sandmould.scenario.pattern import Bar
from sandmould.scenario.scenario import Scenario
from sandmould.statistics.verdict import Verdict, compare_settings
from sandmould.study.collect import Collected, collect, gather
from sandmould.study.plan.plan_files import read_run
from tests.bent_run import SCENE, write_bent_run
from tests.planned import write_plan
from tests.unit.report.test_page import Page

SHARES = {"one": 0.8, "two": 1.0, "three": 1.2}


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three replicates that bend by a different share; vibration gives half of it back."""
    folder = tmp_path_factory.mktemp("results") / "bent"
    scenario = with_surface(Scenario.model_validate(SCENE))
    runs = [Run("bent", name, {}, i, scenario, {}) for i, name in enumerate(SHARES, 1)]
    write_plan(runs, folder)
    told = f"title: How far does it bend?\nobjective: {{measure: {TIP}, better: neither}}\n"
    (folder / "study.yaml").write_text(told)
    body = FoamBody(pattern_of(scenario))
    for name, share in SHARES.items():
        run = folder / "runs" / name
        write_bent_run(run, body, share)
        RunOutcome(Outcome.FINISHED, "", 0.06, 0.06).write(run / "outcome.json")
        write_measures(read_run(run / "scenario.yaml").scenario, run, run / "measures.tsv")
        write_bent(read_run(run / "scenario.yaml").scenario, run, run / "exports")
    return folder


@pytest.fixture(scope="module")
def text(study: Path) -> str:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figures, "_PANEL_PX", 60)
        collect(study)
        write_report(study, study / "report.html")
    return (study / "report.html").read_text()


def gathered(study: Path) -> tuple[Collected, Verdict]:
    collected = gather(study)
    return collected, compare_settings(collected.summary, (), TIP, "neither")


def test_the_band_lies_between_the_least_and_the_greatest_run(study: Path) -> None:
    chart = deflection_chart(*gathered(study))
    assert chart is not None
    (area,) = chart.areas
    np.testing.assert_allclose(area.x, [-0.02, 0.0, 0.0, 0.02], atol=1e-12)
    (mean,) = (line for line in chart.lines if line.style == "mean")
    tip_mm = mean.xy[1, 1]
    assert area.low == pytest.approx(0.8 * tip_mm * np.array([0.0, 1.0, 1.0, 0.5]))
    assert area.high == pytest.approx(1.2 * tip_mm * np.array([0.0, 1.0, 1.0, 0.5]))
    assert chart.y_title == "deflection of the tip, mm"


def test_the_page_tells_what_became_of_the_pattern(study: Path, text: str) -> None:
    page = Page(text)
    assert page.open == []
    assert "The loop holds in all 3 runs." in page.text
    assert "of vibration straightened it a little: " in page.text
    assert "(mean of 3 fillings, 95 % interval): the tip comes back" in page.text
    assert "with factor 1" in page.text
    names = {path.name for path in (study / "figures").iterdir()}
    assert {"pattern.png", "distances.png", "deflection.svg"} <= names
    assert "coloured by its distance from the drawing" in page.text
    assert "springs back to its drawing" in page.text
    assert "The force of its supports is 0 N along x, 0.200 N along y." in page.text
    assert "Its masses are scaled" not in page.text
    links = {a["href"] for a in page.of("a") if "pattern_final" in a["href"]}
    assert links == {f"runs/{n}/exports/pattern_final.{s}" for n in SHARES for s in ("vtu", "stl")}
    assert all((study / link).is_file() for link in links)


def test_limits_of_foam_and_scaled_masses_are_told(study: Path) -> None:
    scenario = read_run(study / "runs" / "one" / "scenario.yaml").scenario
    assert scenario.pattern is not None
    limits = {"tolerance_m": 5e-4, "crush_strength_pa": 1e5}
    told = scenario.model_copy(update={"pattern": scenario.pattern.model_copy(update=limits)})
    collected, _ = gathered(study)
    rows = collected.curves.assign(
        pattern_outside_tolerance_fraction=0.25,
        pattern_crushed_fraction=0.03,
        pattern_frequency_fraction=0.4,
    )
    said = " ".join(_foam_sentences(rows, told))
    assert "25 % of it is beyond the tolerance of 0.500 mm." in said
    assert "3 % of the foam is above its crushing strength of 100 kPa" in said
    assert "it swings at 40 % of its own frequency" in said
    assert "bends it by up to 60 % less" in said
    even = rows.assign(pattern_distance_largest_m=0.01, pattern_compression_largest_pa=1e3)
    assert "during the run" not in " ".join(_foam_sentences(even, told))
    # more of each before the end, and the tip above its place
    more = even.assign(pattern_crushed_fraction=0.0, **{TIP: -0.001})
    more.loc[more.index[0], ["pattern_distance_largest_m", "pattern_crushed_fraction"]] = 0.02, 0.05
    said = " ".join(_foam_sentences(more, told))
    assert "mm from the drawing, during the run up to 20 mm." in said
    assert "crushing strength of 100 kPa, during the run up to 5 %." in said
    assert "springs back" not in said
    assert "bent the tip up by 1 mm" in " ".join(_tip_sentences(more, None, told))


def test_a_loop_that_does_not_hold_is_marked(study: Path) -> None:
    collected, verdict = gathered(study)
    log = study / "runs" / "one" / CONVERGENCE_LOG
    told = log.read_text()
    # All of the energy is from the loop itself: the sand's work is taken away.
    table = pd.read_csv(log, sep="\t").assign(work_j=-1.0)
    table.to_csv(log, sep="\t", index=False)
    scenario = read_run(study / "runs" / "one" / "scenario.yaml").scenario
    pages = bending_pages(study, "", scenario, collected, verdict, "one")
    log.write_text(told)
    assert "cycles in 1 of 3 runs" in pages["sentences"][0]
    assert pages["runs"].marked == (True, False, False)
    assert [chart.y_title for chart, _ in pages["convergence"]] == [
        "displacement, mm", "energy, J", "share of the residual"
    ]  # fmt: skip


def judged(study: Path, recovered_mm: list[float], **changes: Any) -> tuple[str, ...]:
    """What is said of the paper where vibration gave back some of the sinking at each filling."""
    collected, _ = gathered(study)
    summary = collected.summary.assign(pattern_tip_recovered_m=1e-3 * np.array(recovered_mm))
    for column, cells in changes.items():
        summary[column] = cells
    scenario = read_run(study / "runs" / "one" / "scenario.yaml").scenario
    return paper_sentences(scenario, replace(collected, summary=summary), "one")


def test_the_paper_is_judged_by_the_mean_over_fillings(study: Path) -> None:
    stated, back = judged(study, [0.9, 1.0, 1.1])
    assert stated.startswith("Rojek et al. (2004, section 4.3) state this of their L")
    assert "gave back 1.00 ± 0.25 mm" in back
    assert back.endswith("the tip comes back, as the paper states.")
    assert judged(study, [-0.9, -1.0, -1.1])[1].endswith("other than the paper states.")
    # One filling gave back 2 mm: it alone says nothing.
    assert judged(study, [2.0, -1.5, -0.4])[1].endswith("do not show whether the tip comes back.")


def test_a_filling_whose_loop_fails_does_not_judge_the_paper(study: Path) -> None:
    loops = ["holds", "lags", "diverged"]
    (_, few) = judged(study, [0.9, 5.0, 9.0], pattern_loop=loops)
    assert few == "Here one filling can be used: too few to judge that statement by."


@pytest.mark.parametrize(
    "other",
    [
        {"vibration": ()},
        {"fill": Fill(layers=(Layer(count=10),))},
        {"pattern": {"shape": {"kind": "bar", "width_m": 0.05, "height_m": 0.01}}},
    ],
    ids=["without vibration", "in one layer", "another pattern"],
)
def test_the_paper_is_not_named_under_another_scene(study: Path, other: dict[str, Any]) -> None:
    scenario = read_run(study / "runs" / "one" / "scenario.yaml").scenario
    if "pattern" in other:
        shape = Bar.model_validate(other["pattern"]["shape"])
        other = {"pattern": scenario.pattern.model_copy(update={"shape": shape})}
    changed = scenario.model_copy(update=other)
    assert paper_sentences(changed, gathered(study)[0], "one") == ()


def test_a_film_shows_the_pattern_bent(text: str) -> None:
    (scene,) = (t for t in text.splitlines() if 'id="film-scene"' in t)
    assert '"solids": []' in scene
    film = next(t for t in text.splitlines() if 'class="film"' in t)
    assert '"bent": [[' in film
