"""The report's page: whole, offline, honest in its first sentence, with whatever runs there are."""

from __future__ import annotations

import re
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from sandmould.drawing import figures
from sandmould.drawing.figure_files import page_environment
from sandmould.engines.snapshot import Snapshot
from sandmould.report.method import provenance_rows
from sandmould.report.page import LIMIT_BYTES, write_report
from sandmould.report.sand import _layer_conclusion
from sandmould.report.tables import Column, Table
from sandmould.study.collect import collect
from tests.snapshots import damage
from tests.unit.report_study import (
    ENGINES,
    FAILED,
    PLANTED,
    scenario,
    write_cross_check,
    write_study,
    write_twins,
)

_VOID = {"meta", "link", "img", "input", "line", "circle", "path", "br"}


class Page(HTMLParser):
    """Tags with their attributes, and the text of chosen classes."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, Any]]] = []
        self.open: list[str] = []
        self.words: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in _VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        if tag not in _VOID:
            assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] not in ("script", "style"):
            self.words.append(data)

    def of(self, tag: str) -> list[dict[str, Any]]:
        return [attrs for name, attrs in self.tags if name == tag]

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.words).split())


def report(folder: Path) -> str:
    out = folder / "report.html"
    collect(folder)
    write_report(folder, out)
    assert out.stat().st_size < LIMIT_BYTES
    assert not list(folder.glob("*.partial"))
    return out.read_text(encoding="utf-8")


def first_sentence(text: str) -> str:
    found = re.search(r'<p class="first">(.*?)</p>', text, re.S)
    assert found is not None
    return found.group(1)


@pytest.fixture(scope="module", autouse=True)
def small_pictures() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figures, "_PANEL_PX", 60)
        yield


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_study(tmp_path_factory.mktemp("results") / "tube")


@pytest.fixture(scope="module")
def text(study: Path) -> str:
    return report(study)


def test_opens_offline_and_is_whole(text: str, study: Path) -> None:
    page = Page(text)
    assert page.open == []
    for tag, attrs in page.tags:
        for name in ("src", "href", "srcset", "data", "action", "poster"):
            value = str(attrs.get(name, ""))
            assert not re.match(r"(\w+:)?//", value), (tag, value[:80])
    assert not re.search(r"@import|url\(|fetch\(|XMLHttpRequest|importScripts", text)
    links = [a["href"] for a in page.of("a") if not a["href"].startswith("#")]
    assert len(links) >= 9 + 3
    assert all((study / link).exists() for link in links)


def test_every_picture_is_told(text: str) -> None:
    page = Page(text)
    assert all(len(img["alt"]) > 20 for img in page.of("img"))
    assert all(len(svg["aria-label"]) > 40 for svg in page.of("svg") if "chart" in svg["class"])
    figures = len(page.of("figure"))
    assert figures == len(page.of("figcaption")) >= 8
    assert re.findall(r"<b>Figure (\d+)\.</b>", text) == [str(n + 1) for n in range(figures)]


def test_the_first_screen_shows_the_sand_of_the_best_setting(text: str) -> None:
    found = re.search(r'<figure class="paper look">.*?</figure>', text, re.S)
    assert found is not None
    assert text.index("</figure>") < text.index('id="details"')
    assert 'src="data:image/png;base64,' in found.group()
    assert "50 Hz: the sand coloured by layer of fill, " in found.group()


def test_the_table_of_runs_folds_in_a_frame_that_scrolls(text: str) -> None:
    start = text.index('<details id="runs-table">')
    folded = text[start : text.index("</details>", start)]
    assert "<summary>Table of 9 runs</summary>" in folded
    assert '<div class="scroll" tabindex="0" role="region" aria-label="Runs">' in folded
    assert folded.count("<tr") == 10


def test_a_table_without_rows_vanishes() -> None:
    charts = page_environment().get_template("charts.html").module
    empty = Table((Column("hot spot"),), (), ())
    assert str(charts.table(empty, True, "Hot spots")).strip() == ""  # type: ignore[attr-defined]


def test_what_differs_from_run_to_run_is_no_origin_of_all() -> None:
    rows = provenance_rows([{"command": f"run {n}", "versions": {"numpy": "2"}} for n in (1, 2)])
    assert [(row.about, row.text) for row in rows] == [("versions: numpy", "2")]


def test_headings_link_to_sections(text: str) -> None:
    page = Page(text)
    targets = {a["href"][1:] for a in page.of("a") if a["href"].startswith("#")}
    ids = [attrs["id"] for _, attrs in page.tags if "id" in attrs]
    assert targets <= set(ids)
    assert len(ids) == len(set(ids))


def test_first_sentence_recommends_what_is_resolved(text: str) -> None:
    assert first_sentence(text).startswith("50 Hz (±0.149 mm, 1.5 g) fills the tube best, to a f")
    assert "The fill of the tube is highest with 50 Hz" in Page(text).text


def test_failed_run_is_marked_with_its_sentence(text: str) -> None:
    row = next(r for r in re.findall(r"<tr.*?</tr>", text, re.S) if f">{FAILED}<" in r)
    assert row.startswith('<tr class="marked">')
    assert "Grains left the box or passed through a wall." in row
    assert "3 grains passed through the floor" in row
    assert "Of 9 runs, 1 did not finish" in Page(text).text
    assert "8 of 9" in Page(text).text


def test_method_is_told(text: str) -> None:
    words = Page(text).text
    for said in (
        "lammps 22 Jul 2025, 1 rank",
        "never allowed to pull",
        "non-viscous, each component of force by itself",
        "acceleration held constant while the frequency changes",
        "6.10 µs, 0.500 of the critical one",
        "same seed at every setting",
        "snakemake --configfile config/studies/tube_demo.yaml",
        "whether the best setting belongs to the sand",
        "not 1",
    ):
        assert said.lower() in words.lower(), said


@pytest.mark.slow
def test_same_study_gives_the_same_page(text: str, study: Path, tmp_path: Path) -> None:
    write_report(study, study / "again.html")
    assert (study / "again.html").read_text(encoding="utf-8") == text
    # links lead from the page's own folder
    write_report(study, tmp_path / "elsewhere.html")
    page = Page((tmp_path / "elsewhere.html").read_text(encoding="utf-8"))
    links = [a["href"] for a in page.of("a") if not a["href"].startswith("#")]
    assert all((tmp_path / link).exists() for link in links)


def test_tie_says_at_once_that_nothing_is_told_apart(tmp_path: Path) -> None:
    text = report(write_study(tmp_path / "tie", dict.fromkeys(PLANTED, 0.4), spread=0.05))
    assert "do not tell" in first_sentence(text)
    assert "Hz fills the tube best" not in text


def test_single_replicates(tmp_path: Path) -> None:
    text = report(write_study(tmp_path / "once", replicates=1, failed=()))
    assert first_sentence(text).startswith("By one run each")


def test_all_failed_still_shows_the_sand(tmp_path: Path) -> None:
    every = [f"f{f:g}_r{r}" for f in PLANTED for r in (1, 2, 3)]
    text = report(write_study(tmp_path / "failed", failed=every))
    assert first_sentence(text).startswith("No run finished")
    assert "</code>, which got farthest: none finished." in text
    assert 'id="film-canvas"' in text
    assert text.count('<tr class="marked">') == 9


def test_a_run_alone_is_neither_best_nor_worst(tmp_path: Path) -> None:
    text = report(write_study(tmp_path / "alone", {50.0: 0.55}, replicates=1, failed=()))
    assert "</code>, the only one with a fill of the tube that can be used." in text


def test_finished_runs_without_the_measure_are_counted_as_finished(tmp_path: Path) -> None:
    study = write_study(tmp_path / "typo")
    with (study / "study.yaml").open("a") as file:
        file.write("objective: {measure: pipe_fill_fraction}\n")
    text = report(study)
    assert first_sentence(text).startswith("None of the 9 runs gives a fill of the pipe that count")
    assert "</code>, which got farthest: none gives a value that can be used." in text
    assert "none finished" not in text


def test_nothing_but_a_plan(tmp_path: Path) -> None:
    study = write_study(tmp_path / "plan")
    for file in [*study.glob("runs/*/*.[jt]s*"), *study.glob("runs/*/snapshots.npz")]:
        file.unlink()
    text = report(study)
    assert "no outcome written" in text
    assert 'id="film-canvas"' not in text
    assert Page(text).open == []


def test_broken_files_are_survived(tmp_path: Path) -> None:
    study = write_study(tmp_path / "broken")
    damage(study / "runs" / "f50_r2", 5)
    (study / "runs" / "f25_r1" / "scenario.yaml").write_text("scenario: [")
    (study / "runs" / "f25_r2" / "products.json").write_text("{")
    (study / "runs" / "f25_r3" / "measures.tsv").write_text("time_s\n1\n")
    text = report(study)
    assert "measures.tsv cannot be read" in text


def test_missing_study_file_is_told(tmp_path: Path) -> None:
    study = write_study(tmp_path / "lost", failed=())
    (study / "study.yaml").unlink()
    assert "study.yaml is missing: title and objective are the defaults." in report(study)


def test_without_a_tube_its_parts_vanish(tmp_path: Path) -> None:
    study = write_study(tmp_path / "bare", tube=False)
    (study / "study.yaml").write_text("title: Packing\nobjective: {measure: solid_fraction}\n")
    text = report(study)
    assert "fill of the tube" not in text
    assert "the sand in the tube comes from" not in text
    assert "solid fraction" in Page(text).text


def test_spheres(tmp_path: Path) -> None:
    text = report(write_study(tmp_path / "spheres", dimension=3, grains=600))
    assert 'id="film-cut"' in text
    assert "0.6 in 3D" in text


def test_words_of_others_are_escaped(tmp_path: Path) -> None:
    study = write_study(tmp_path / "sly", failed=())
    (study / "study.yaml").write_text("title: <script>alert(1)</script> & co\n")
    outcome = study / "runs" / "f25_r1" / "outcome.json"
    outcome.write_text(outcome.read_text().replace('"detail": ""', '"detail": "<img src=x>"'))
    text = report(study)
    assert "<script>alert" not in text
    assert "<img src=x>" not in text


def test_settings_in_words_and_of_several_keys(tmp_path: Path) -> None:
    study = write_study(tmp_path / "words")
    runs = pd.read_csv(study / "runs.tsv", sep="\t")
    runs.insert(2, "vibration.0.hold", ["acceleration", "velocity", "velocity"] * 3)
    runs.to_csv(study / "runs.tsv", sep="\t", index=False)
    text = report(study)
    assert "frequency 50 Hz, hold velocity" in text
    assert Page(text).open == []


def test_many_drawn_settings(tmp_path: Path) -> None:
    planted = {20.0 + n: 0.3 + 0.005 * n for n in range(40)}
    study = write_study(tmp_path / "drawn", planted, replicates=1, failed=(), grains=60, count=5)
    runs = pd.read_csv(study / "runs.tsv", sep="\t")
    runs.insert(2, "contact.grain_grain.friction", [0.3 + 0.01 * n for n in range(40)])
    runs.to_csv(study / "runs.tsv", sep="\t", index=False)
    text = report(study)
    assert "against friction" in text
    assert first_sentence(text).startswith("By one run each")


def test_study_of_twins_begins_with_whether_they_agree(tmp_path: Path) -> None:
    fill = {**dict.fromkeys(ENGINES, 0.5), "reference": 0.6}
    text = report(write_twins(tmp_path / "twins", fill, dict.fromkeys(ENGINES, 0.78)))
    assert first_sentence(text).startswith("Settings differ by more than the margin in fill")
    page = Page(text)
    for said in (
        "Do the settings agree?",
        "liggghts − reference",
        "±0.005",
        "6 pairs",
        "Speed of the engines in these runs",
        "21 M",
        "4 of 6 comparisons agree",
    ):
        assert said in page.text, said
    # no setting is to be recommended, nor is an optimum under suspicion
    for absent in ("compared with the best", "fills the tube", "best setting belongs"):
        assert absent not in page.text, absent
    bands = [attrs for tag, attrs in page.tags if tag == "rect"]
    assert len(bands) == 2 * 2
    assert all(float(band["width"]) > 10 for band in bands)


def test_twins_that_agree_say_so(tmp_path: Path) -> None:
    same = dict.fromkeys(ENGINES, 0.5)
    text = report(write_twins(tmp_path / "twins", same, dict.fromkeys(ENGINES, 0.78)))
    assert first_sentence(text).startswith("All 6 comparisons agree within the margins")
    assert '<div class="verdict resolved">' in text


def test_cross_check_stands_beside_a_verdict_that_it_does_not_touch(tmp_path: Path) -> None:
    folder = write_cross_check(tmp_path / "demo")
    text = report(folder)
    # the other engine's runs at 50 Hz are 0.3 higher
    assert first_sentence(text).startswith("50 Hz (±0.149 mm, 1.5 g) fills the tube best")
    assert "The fill of the tube is highest with 50 Hz (±0.149 mm, 1.5 g), 0.5" in text
    page = Page(text)
    assert "The verdict above uses the sweep's own engine alone" in page.text
    assert "reference − lammps, 50 Hz" in page.text
    assert text.count("engine_lammps_f50_r1") >= 1
    checked = next(s for s in page.of("svg") if "fill of the tube by setting" in s["aria-label"])
    assert "50 Hz: 0.550, 3 runs" in checked["aria-label"]


def test_study_that_compares_nothing_has_no_such_section(text: str) -> None:
    assert "Do the settings agree?" not in text
    assert 'href="#agreement"' not in text


def test_the_layers_in_the_tube_are_told_from_the_largest_share_on() -> None:
    of_layer = {1: 1, 2: 1, 3: 2, 4: 5, 5: 1}
    layer = np.repeat(list(of_layer), list(of_layer.values()))
    n = len(layer)
    in_tube = np.stack([0.075 + 0.004 * np.arange(n), np.full(n, 0.035)], axis=1)
    last = Snapshot(
        time_s=2.0, vibration_time_s=1.0, stage="vibrate_1", id=np.arange(1, n + 1), layer=layer,
        position_m=in_tube, velocity_m_s=np.zeros((n, 2)), spin_rad_s=np.zeros((n, 3)),
        radius_m=np.full(n, 1e-3),
    )  # fmt: skip
    told = _layer_conclusion([last], scenario(50.0))
    assert "comes from layer 4 (50 %), layer 3 (20 %), layer 5 (10 %) and 2 others." in told
