"""The report of a certificate: its verdict, its table, and the bed's own spectrum."""

from __future__ import annotations

import html
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sandmould.definition.certificate import spanned_hz
from sandmould.definition.run import Run
from sandmould.report.answer import optimum_choice, optimum_headline
from sandmould.report.optimum import optimum_pages
from sandmould.report.page import write_report
from sandmould.report.robustness import robustness_pages
from sandmould.statistics.answer import Answer, Asked
from sandmould.statistics.config import SandWaveSpeed
from sandmould.statistics.decision import Evidence, decide
from sandmould.study.collect import Collected, collect, gather, read_study
from sandmould.study.robustness.controls import SHAKE_G, SHAKEN_HZ, cases
from sandmould.study.rounds.round_log import RoundLog, basis_of, write_rounds
from sandmould.wording.next_steps import optimum_steps
from tests.planned import write_plan
from tests.unit.report_study import KEY, scenario, write_run

CERTIFIED_HZ = (35.5, 50.0, 70.5)
SPANNED_HZ = spanned_hz(CERTIFIED_HZ)
ASKED = ("hold", "springs", "bed_depth", "time_step", "engine", "spectrum")
OWN_HZ, DAMPING = 110.0, 0.15
WEIGHT_N = 3.0


def hill(frequency_hz: float, best_hz: float) -> float:
    return 0.6 - 0.15 * float(np.log(frequency_hz / best_hz)) ** 2


def write_certified(folder: Path, moved: dict[str, float]) -> Path:
    """Write a study and its controls, of which some move the optimum to another frequency."""
    (folder).mkdir(parents=True)
    (folder / "study.yaml").write_text(
        "title: Is it the sand's?\nscenario: {engine: {name: reference}}\n"
        f"sweep: {{keys: {{{KEY}: {list(SPANNED_HZ.values())}}}}}\nreplicates: 3\n"
        f"certificate: {{controls: [{', '.join(ASKED)}]}}\n"
        "equivalence: {margins: {tube_fill_fraction: 0.03}}\n"
    )
    study = read_study(folder)
    runs = []
    for case in (None, *cases(study.certificate, scenario(50.0), CERTIFIED_HZ[1])):
        for f in [SPANNED_HZ[step] for step in (case.steps if case else SPANNED_HZ)]:
            for replicate in (1, 2, 3):
                at = scenario(f).model_copy(update={"seed": 1000 + replicate})
                part = "sweep" if case is None else case.part
                at = at if case is None else case.change(at)
                name = re.sub(r"[^a-z0-9]+", "_", f"{part}_f{f:g}_r{replicate}")
                runs.append(Run(folder.name, name, {KEY: f}, replicate, at, {}, part))
    write_plan(runs, folder)
    noise = np.random.default_rng(4)
    for run in runs:
        best_hz = moved.get(run.part.removeprefix("control: "), 50.0)
        value = hill(run.parameters[KEY], best_hz) + float(noise.normal(0.0, 0.004))
        write_run(folder / "runs" / run.run, run, value, False, 60, 8)
        if "spectrum" in run.part:
            shaken_loads(run).to_csv(folder / "runs" / run.run / "loads.tsv", sep="\t", index=False)
    write_rounds(RoundLog(basis_of(study), (), "The sweep is done.", CERTIFIED_HZ), folder)
    return folder


def shaken_loads(run: Run) -> pd.DataFrame:
    """Loads of a mass on a spring: at rest its weight, then what each frequency adds."""
    window_s = run.scenario.record.series_every_s
    time_s, rows = 0.0, []
    for _ in range(40):
        time_s += window_s
        rows.append((time_s, "settle_1", "floor", 0.0, -WEIGHT_N))
    for place, stage in enumerate(run.scenario.vibration, start=1):
        r = stage.frequency_hz / OWN_HZ
        gain = np.hypot(1, 2 * DAMPING * r) / np.hypot(1 - r * r, 2 * DAMPING * r)
        begun = time_s
        while time_s - begun < stage.whole_duration_s:
            time_s += window_s
            phase = stage.angular_frequency_rad_s * (time_s - 0.5 * window_s)
            rows.append((time_s, f"vibrate_{place}", "floor", 0.0,
                         -WEIGHT_N * (1 + SHAKE_G * gain * np.sin(phase))))  # fmt: skip
    columns = ["time_s", "stage", "surface", "force_x_n", "force_y_n"]
    return pd.DataFrame(rows, columns=columns).assign(vibration_time_s=-1.0)


@pytest.mark.slow
def test_an_artefact_is_the_first_sentence_of_the_report(tmp_path: Path) -> None:
    moved = {"hold velocity": 75.0, "hold displacement": 110.0}
    folder = write_certified(tmp_path / "held", moved)
    collect(folder)
    write_report(folder, folder / "report.html")
    text = (folder / "report.html").read_text(encoding="utf-8")
    said = re.sub(r"<[^>]+>", "", text[text.index('class="verdict') :][:1500]).replace("\xa0", " ")
    said = html.unescape(said[said.index(">") + 1 :].strip())
    assert said.startswith("The optimum at 50 Hz comes from what is held constant: it moves")
    said = html.unescape(text[text.index('id="details"') :])
    assert 'class="verdict unresolved"' in text
    assert "Does the optimum belong to the sand?" in text
    # The controls were run, so the report no longer says that they were not.
    assert "have not been run" not in text


def test_the_certificate_has_a_row_a_control_and_the_beds_spectrum(tmp_path: Path) -> None:
    folder = write_certified(tmp_path / "sound", {})
    collected = gather(folder)
    pages = robustness_pages(folder, read_study(folder), collected, scenario(50.0))
    assert pages is not None
    assert pages.assessment.cause == "rearrangement of grains"
    names = [row[0].text for row in pages.table.rows]
    assert names == [
        "the sweep itself", "displacement held", "velocity held", "bed depth x0.5",
        "bed depth x2", "time step x0.5", "engine reference",
    ]  # fmt: skip
    assert {row[-1].text for row in pages.table.rows[1:]} == {"stays"}
    assert pages.spring_table is not None
    curves = [(row[0].text, row[1].text) for row in pages.spring_table.rows]
    assert curves == [
        ("acceleration", "x0.25"), ("acceleration", "x1"), ("acceleration", "x4"),
        ("displacement", "x0.25"), ("displacement", "x4"),
        ("velocity", "x0.25"), ("velocity", "x4"),
    ]  # fmt: skip
    assert {row[-1].text for row in pages.spring_table.rows} == {"both"}
    assert pages.spectrum is not None
    assert len(pages.spectrum.lines) == 4
    frequency, gain = pages.spectrum.lines[-1].xy.T
    np.testing.assert_allclose(frequency, SHAKEN_HZ)
    assert gain[0] == pytest.approx(1.0, abs=0.05)
    own_hz = float(re.search(r"first resonance is at ([\d.]+) Hz", pages.column).group(1))  # type: ignore[union-attr]
    assert own_hz == pytest.approx(OWN_HZ, rel=0.1)
    assert pages.mode is not None
    assert pages.mode.measured_hz == pytest.approx(own_hz, rel=0.01)
    # The waves of the bed itself, 4 H f, and not those of a row of grains.
    assert pages.mode.wave_speed.speed_m_s == pytest.approx(4 * 0.0826 * own_hz, rel=0.02)
    assert pages.mode.beside(55.0) == (
        f"55 Hz is {55 / own_hz:.2f} times the bed's own first mode, measured by a small shake at "
        f"{own_hz:.0f} Hz."
    )


def test_without_a_source_of_the_wave_speed_no_frequency_is_named_first(tmp_path: Path) -> None:
    holds = ("acceleration", "velocity", "displacement")
    moved = {f"springs x0.25 {hold}": 25.0 for hold in holds}
    moved |= {f"springs x4 {hold}": 100.0 for hold in holds}
    folder = write_certified(tmp_path / "follows", moved)
    study, collected = read_study(folder), gather(folder)
    pages = robustness_pages(folder, study, collected, scenario(50.0))
    assert pages is not None
    assert pages.assessment.cause == "follows the springs"
    optimum = optimum_pages(folder, study, collected.of_sweep.summary, pages, pages.mode)
    assert optimum is not None
    assert not optimum.sound
    first, second, third, fourth, *_ = optimum.sentences
    assert first == pages.sentences[0]
    assert second.startswith("No frequency in Hz is recommended: the optimum follows the springs")
    assert "times the bed's own first mode, measured by a small shake" in fourth
    swept, answer = collected.of_sweep.summary, judged(collected)
    said, _ = optimum_headline(optimum, pages, answer, swept, has_speed=False)
    assert said.startswith("No frequency in Hz is named: the best one goes with the wave")
    assert optimum_choice(optimum, swept, answer.verdict, is_artefact=False) == ()
    (step,) = optimum_steps(study, optimum.optimum, pages.assessment)
    assert step.line.startswith("certificate: {sand_wave_speed: {")
    # The waves of the bed, some 36 m/s by its mode, are those of a sand with a source here.
    sand = SandWaveSpeed(low_m_s=30.0, high_m_s=40.0, by="Somebody 2020")
    asked = study.certificate.model_copy(update={"sand_wave_speed": sand})
    sourced = study.model_copy(update={"certificate": asked})
    advised = optimum_pages(folder, sourced, collected.of_sweep.summary, pages, pages.mode)
    assert advised is not None
    assert advised.sound
    assert advised.sentences[0] == third
    assert advised.sentences[2].startswith("Recommended with the acceleration held: ")
    assert "30 to 40 m/s (Somebody 2020)" in advised.sentences[2]
    said, is_sound = optimum_headline(advised, pages, answer, swept, has_speed=True)
    assert re.match(r"50\.?5? Hz \(95 %: [\d.]+ to [\d.]+ Hz\) fills the tube best", said)
    assert is_sound
    assert optimum_steps(sourced, advised.optimum, pages.assessment) == []
    # An optimum at the end of what was swept is no frequency to set.
    cut = optimum_pages(folder, sourced, swept[swept[KEY] <= 50.0], pages, pages.mode)
    assert cut is not None
    assert not cut.sound
    assert cut.sentences[1].startswith("No frequency in Hz is recommended: the interval of the op")


def judged(collected: Collected) -> Answer:
    return decide(
        Asked("tube_fill_fraction", "larger", (KEY,)), Evidence(collected.of_sweep.summary)
    )


def test_there_is_no_certificate_before_its_frequencies_are_chosen(tmp_path: Path) -> None:
    folder = write_certified(tmp_path / "early", {})
    study = read_study(folder)
    write_rounds(RoundLog(basis_of(study)), folder)
    assert robustness_pages(folder, study, gather(folder), scenario(50.0)) is None
