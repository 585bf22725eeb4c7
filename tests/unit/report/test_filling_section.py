"""What the report says of the filling of a cavity, against planted curves."""

from __future__ import annotations

import math
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from sandmould.kinds.sand.kind import SandStudy
from sandmould.report.filling import FillingPages, filling_pages
from sandmould.report.page import write_report
from sandmould.statistics.verdict import compare_settings
from sandmould.study.collect import collect, gather, read_study
from tests.unit.report_study import KEY, scenario, write_study

BEST_HZ = 40.0
HZ = (10.0, 20.0, BEST_HZ, 80.0, 160.0)


def planted(height: float) -> dict[float, float]:
    """Fill at the end: up as the frequency, down as its square root."""
    return {
        f: height * (f / BEST_HZ if f <= BEST_HZ else math.sqrt(BEST_HZ / f)) for f in HZ
    }  # fmt: skip


def pages(folder: Path, height: float, spread: float, **objective: object) -> FillingPages:
    """A study on disk with what its report says."""
    write_study(folder, planted(height), failed=(), spread=spread)
    tree = read_study(folder).model_dump(mode="json")
    tree["objective"] |= objective
    tree["sweep"]["keys"] = {KEY: list(HZ)}
    study = SandStudy.model_validate(tree)
    collected = gather(folder)
    verdict = compare_settings(collected.summary, collected.keys, "tube_fill_fraction")
    found = filling_pages(study, collected, verdict, scenario(BEST_HZ))
    assert found is not None
    return found


def test_limbs_are_found_again(tmp_path: Path) -> None:
    found = pages(tmp_path / "fast", 0.9, 1e-4)
    rise, fall = (float(x.replace("−", "-")) for x in re.findall(r"of (\S+) ±", found.limbs))
    assert rise == pytest.approx(1.0, abs=0.01)
    assert fall == pytest.approx(-0.5, abs=0.01)
    assert "fastest over the first 0.50 s at 40 Hz" in found.limbs


def test_the_chart_has_a_curve_a_time_and_what_others_found(tmp_path: Path) -> None:
    reported = [{"value": 65.0, "by": "someone"}]
    chart = pages(tmp_path / "chart", 0.5, 0.002, reported_best=reported).chart
    assert [line.label for line in chart.lines] == [
        "0 s",
        "0.25 s",
        "0.50 s",
        "1 s",
        "2 s",
        "65 Hz",
    ]
    assert chart.lines[-1].title == "best by someone"
    assert np.allclose(chart.lines[-1].xy[:, 0], 65.0)
    assert chart.lines[4].xy[:, 1].argmax() == 2


@pytest.mark.slow
def test_the_page_shows_it(tmp_path: Path) -> None:
    folder = write_study(tmp_path / "tube")
    collect(folder)
    write_report(folder, folder / "report.html")
    page = (folder / "report.html").read_text()
    assert "Filling over what is swept" in page
    assert "mm, 1.5 g)" in page


@pytest.mark.slow
def test_its_figures_are_files_too(tmp_path: Path) -> None:
    folder = write_study(tmp_path / "tube")
    collect(folder)
    write_report(folder, folder / "report.html")
    names = {path.name for path in (folder / "figures").iterdir()}
    assert {"objective.svg", "filling.svg", "curves.svg"} <= names
    drawing = ElementTree.parse(folder / "figures" / "filling.svg").getroot()
    titles = [element.text for element in drawing.iter("{http://www.w3.org/2000/svg}title")]
    assert "after 2 s of vibration" in titles
    assert 'href="figures"' in (folder / "report.html").read_text()


def test_other_measures_have_no_filling(tmp_path: Path) -> None:
    folder = write_study(tmp_path / "tube")
    collected = gather(folder)
    verdict = compare_settings(collected.summary, collected.keys, "solid_fraction")
    assert filling_pages(read_study(folder), collected, verdict, scenario(50.0)) is None
