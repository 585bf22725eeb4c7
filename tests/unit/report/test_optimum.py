"""The report of a study with rounds: optimum with interval, how flat it is, what rounds cost."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sandmould.drawing.chart import Chart
from sandmould.kinds.sand.kind import SandStudy
from sandmould.report.answer import optimum_choice, optimum_headline
from sandmould.report.optimum import optimum_pages, with_surface
from sandmould.report.page import write_report
from sandmould.scenario.drive import BoxDrive
from sandmould.statistics.answer import Asked
from sandmould.statistics.decision import Evidence, decide
from sandmould.study.collect import collect, gather, read_study
from sandmould.study.rounds.decide import next_round
from sandmould.study.rounds.round_log import RoundLog, basis_of, write_rounds
from sandmould.wording.next_steps import optimum_steps
from tests.unit.report_study import KEY, write_study

BEST_HZ = 48.0
SWEPT = (20.0, 30.0, 40.0, 50.0, 65.0, 80.0, 100.0)


def write_refined(folder: Path, best_hz: float = BEST_HZ, width_hz: float = 40.0) -> Path:
    planted = {f: max(0.6 - 0.3 * float(np.log(f / best_hz)) ** 2, 0.05) for f in SWEPT}
    write_study(folder, planted, failed=())
    swept = ", ".join(f"{f:g}" for f in SWEPT)
    (folder / "study.yaml").write_text(
        "title: Which frequency fills the tube best?\n"
        f"sweep: {{keys: {{{KEY}: [{swept}]}}}}\nreplicates: 3\n"
        f"refine: {{rounds: 2, runs: 5, interval: {{{KEY}: {width_hz:g}}}}}\n"
        "equivalence: {margins: {tube_fill_fraction: 0.02}}\n"
    )
    return folder


@pytest.mark.slow
def test_the_report_begins_with_the_optimum(tmp_path: Path) -> None:
    folder = write_refined(tmp_path / "refined")
    study = read_study(folder)
    log = RoundLog(basis_of(study), ended="All 2 rounds are done.")
    write_rounds(log, folder)
    collect(folder)
    write_report(folder, folder / "report.html")
    text = (folder / "report.html").read_text(encoding="utf-8")
    first, detail = text.index('class="verdict resolved"'), text.index('id="details"')
    answer = re.sub(r"<[^>]+>", "", text[first:detail]).replace("\xa0", " ")
    assert re.search(r"4\d(\.\d)? Hz \(95 %: [\d.]+ to [\d.]+ Hz\) fills the tube best", answer)
    said = re.sub(r"<[^>]+>", "", text[detail : detail + 900]).replace("\xa0", " ")
    assert re.search(
        r"The fill of the tube is highest at frequency 4\d(\.\d)? Hz \(95 % inter", said
    )
    # 0.3 ln(f/48)^2 = 0.02 at a ratio of 1.29: from 37 to 62 Hz
    low, high = map(float, re.search(r"From (\S+) to (\S+) Hz the mean is", said).groups())  # type: ignore[union-attr]
    assert low == pytest.approx(37.0, abs=3.0)
    assert high == pytest.approx(62.0, abs=4.0)
    assert re.search(
        r"A frequency 10 Hz too low costs 0\.0[12]\d* and 10 Hz too high costs 0\.0", said
    )
    assert "All 2 rounds are done." in said
    assert "The curve is the Gaussian process" in text


def test_the_chart_shows_the_interval_and_what_others_found(tmp_path: Path) -> None:
    folder = write_refined(tmp_path / "refined")
    with (folder / "study.yaml").open("a") as file:
        file.write("objective: {reported_best: [{value: 65.0, by: someone}]}\n")
    study = read_study(folder)
    pages = optimum_pages(folder, study, gather(folder).summary)
    assert pages is not None
    assert pages.optimum is not None
    chart = with_surface(Chart("frequency", "fill", "Fill."), pages.optimum, study)
    assert chart.band == pages.optimum.interval(KEY)
    fitted, low, high, reported = chart.lines
    assert (low.xy[:, 1] < fitted.xy[:, 1]).all()
    assert (reported.label, reported.title) == ("65 Hz", "best by someone")
    # upright, over all that is fitted
    assert reported.xy[:, 0].tolist() == [65.0, 65.0]
    assert sorted(reported.xy[:, 1]) == pytest.approx(
        [min(low.xy[:, 1].min(), high.xy[:, 1].min()), max(low.xy[:, 1].max(), high.xy[:, 1].max())]
    )


def test_an_interval_at_the_end_of_the_sweep_is_not_resolved(tmp_path: Path) -> None:
    folder = write_refined(tmp_path / "edge", best_hz=130.0)
    study, found = read_study(folder), gather(folder)
    pages = optimum_pages(folder, study, found.summary)
    assert pages is not None
    assert not pages.sound
    assert pages.optimum is not None
    assert pages.optimum.at_end(KEY) == "highest"
    assert pages.sentences[-1].startswith("No round added any runs to the 21 of the sweep")
    assert "Rounds go on" in pages.sentences[-1]
    answer = decide(Asked("tube_fill_fraction", "larger", (KEY,)), Evidence(found.summary))
    said, is_sound = optimum_headline(pages, None, answer, found.summary, has_speed=False)
    assert said.startswith("The best is near 1")
    assert "beyond the highest" in said
    assert not is_sound
    of_bed = 1.25 * found.summary["tube_fill_fraction"]
    known = found.summary.assign(tube_fill_of_bed_fraction=of_bed)
    said, _ = optimum_headline(pages, None, answer, known, has_speed=False)
    share = f"{125 * pages.optimum.value[0]:.0f} %"
    assert said.endswith(f"There the tube holds about {share} of what fits: it is not full.")
    narrow = study.refine.model_copy(update={"interval": {KEY: 0.1}})
    (step,) = optimum_steps(study.model_copy(update={"refine": narrow}), pages.optimum, None)
    assert "a frequency above" in step.text


def test_an_interval_over_most_of_the_sweep_names_no_best(tmp_path: Path) -> None:
    folder = write_refined(tmp_path / "vague")
    optimum = optimum_pages(folder, read_study(folder), gather(folder).summary)
    assert optimum is not None
    assert optimum.optimum is not None
    assert not optimum.optimum.is_vague
    everywhere = np.linspace(2, len(optimum.optimum.points) - 3, 2000).astype(int)
    assert replace(optimum.optimum, picks=everywhere).is_vague


def test_the_drive_at_the_optimum_is_told_in_mm_and_g(tmp_path: Path) -> None:
    folder = write_refined(tmp_path / "driven")
    summary = gather(folder).summary
    # a tenth of a millimetre at every speed, as a table with an unbalance moves
    drives = [BoxDrive(f, 1e-4).columns() for f in summary[KEY]]
    for name in drives[0]:
        summary[name] = [drive[name] for drive in drives]
    pages = optimum_pages(folder, read_study(folder), summary)
    assert pages is not None
    assert pages.optimum is not None
    answer = decide(Asked("tube_fill_fraction", "larger", (KEY,)), Evidence(summary))
    shared = summary.assign(tube_fill_of_bed_fraction=0.5)
    shown = optimum_choice(pages, shared, answer.verdict, False)
    figures = {it.label: it.value for it in shown}
    assert figures["amplitude (half of peak to peak)"] == "0.100 mm"
    share = 100 * 0.5 * pages.optimum.value[0] / float(summary["tube_fill_fraction"].mean())
    assert figures["of what fits in, about"] == f"{share:.0f} %"
    said, _ = optimum_headline(pages, None, answer, summary, has_speed=False)
    assert " (±0.1 mm, " in said


def test_wider_than_asked_is_not_sound_and_the_cost_is_told(tmp_path: Path) -> None:
    folder = write_refined(tmp_path / "wide", width_hz=0.1)
    study, found = read_study(folder), gather(folder)
    log = next_round(RoundLog(basis_of(study)), study, found.summary, [KEY])
    write_rounds(replace(log, ended=""), folder)
    pages = optimum_pages(folder, study, found.summary)
    assert pages is not None
    assert not pages.sound
    assert pages.sentences[-1].startswith("1 round added 5 runs to the 21 of the sweep")
    (step,) = optimum_steps(study, pages.optimum, None)
    assert step.line == "refine: {rounds: 4}"


def test_settings_above_a_thousand_are_told_in_words(tmp_path: Path) -> None:
    folder = write_refined(tmp_path / "stiff")
    key = "contact.grain_grain.normal_stiffness_n_m"
    found = gather(folder).summary.rename(columns={KEY: key})
    found[key] *= 1000.0
    tree = read_study(folder).model_dump(mode="json")
    tree["sweep"]["keys"] = {key: [1000.0 * f for f in SWEPT]}
    tree["refine"]["interval"] = {}
    pages = optimum_pages(folder, SandStudy.model_validate(tree), found)
    assert pages is not None
    assert "normal stiffness 4" in pages.sentences[0]


def test_a_study_without_rounds_has_no_such_answer(tmp_path: Path) -> None:
    folder = write_study(tmp_path / "plain")
    assert optimum_pages(folder, read_study(folder), gather(folder).summary) is None
