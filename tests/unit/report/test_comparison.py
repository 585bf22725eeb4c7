"""Finished studies side by side, by the command."""

from __future__ import annotations

import re
from pathlib import Path

import pandas as pd
import pytest
from scipy import stats
from typer.testing import CliRunner

from sandmould.cli.commands import app
from sandmould.report.comparison import read_comparison
from sandmould.study.collect import collect
from sandmould.study.plan.plan_files import VERDICT_FILE
from tests.finished_study import finished_study, study_text
from tests.unit.report_study import write_study

SWEEP = """\
based_on: plates
scenario: {until_s: 100, heat_transfer_w_m2_k: null, layers: [], %s}
sweep: {keys: {element_m: %s}}
reference: {value: {}, source: replaces that of plates}
"""
OBJECTIVE = "objective: {measure: solidified_fraction}\n"


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two sweeps of one key and one of two, computed once."""
    folder = tmp_path_factory.mktemp("compared")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        texts = {
            "faces": (SWEEP + OBJECTIVE) % ("exchange: faces", "[0.01, 0.02]"),
            "difference": (SWEEP + OBJECTIVE) % ("exchange: difference", "[0.01, 0.02, 0.04]"),
            "alone": (SWEEP.replace("sweep: {keys: {element_m: %s}}", "%s") + OBJECTIVE)
            % ("exchange: faces, element_m: 0.02", "sweep: {}"),
            "both": study_text(elements_m=(0.02, 0.01), exchanges=("faces",)) + OBJECTIVE,
        }
        for name, text in texts.items():
            path = folder / f"{name}.yaml"
            path.write_text(text)
            plan = finished_study(path)
            (folder / "results" / plan.study.name / VERDICT_FILE).write_text(f"{name} says so.\n")
    return folder


def compare(*arguments: str) -> tuple[int, str, str]:
    said = CliRunner().invoke(app, ["compare", *arguments])
    return said.exit_code, said.stdout, said.stderr


def test_studies_of_one_key_stand_over_it(finished: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(finished)
    status, out, err = compare("faces.yaml", "results/difference", "-o", "page.html")
    assert status == 0, err
    lines = out.splitlines()
    assert lines[2].split() == ["setting", "faces", "difference"]
    assert re.match("40 mm +– +0", lines[5])
    assert out.rstrip().endswith("page.html\npage.svg")
    assert "faces: faces says so." in lines
    # what a foundry compares beside the objective
    means = [line for line in lines if line.startswith("Mean ")]
    assert means[0] == "Mean solidified fraction ± 95 %"
    assert "Mean share of the part below Niyama's limit ± 95 %" in means
    page = Path("page.html").read_text()
    assert "scenario.exchange" in page
    assert "<h3>Share of the part below Niyama&#39;s limit</h3>" in page
    assert "scenario.element_m" not in page  # it is swept
    assert not re.search("https?:", page.replace("http://www.w3.org", ""))
    assert Path("page.svg").read_text().count("<circle") == 5


def test_studies_without_a_common_key_stand_in_rows(
    finished: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(finished)
    found = read_comparison([Path("results/faces"), Path("results/both")])
    assert found.key == ""
    chart = found.chart()
    assert len(chart.rows) == len(chart.marks) == 4
    assert chart.rows[0].startswith("faces: ")


@pytest.mark.parametrize("other", ["faces", "both"])
def test_a_study_that_sweeps_nothing_stands_beside_any_other(
    other: str, finished: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(finished)
    for pair in (("alone", other), (other, "alone")):
        found = read_comparison([Path("results") / name for name in pair])
        # it is one of the other's settings
        assert len(found.labels) == len(found.studies[pair.index(other)].settings(found.measure))
        assert found.has_common_settings


def test_two_studies_are_tested_at_a_setting_of_both(tmp_path: Path) -> None:
    fills = {"short": [0.50, 0.52, 0.54], "long": [0.70, 0.71, 0.75]}
    for name in fills:
        study = write_study(tmp_path / name)
        collect(study)
        summary = pd.read_csv(study / "summary.tsv", sep="\t")
        at = summary.index[summary["vibration.0.frequency_hz"] == 50][:3]
        summary = summary.loc[at].assign(outcome_code=0, tube_fill_fraction=fills[name])
        summary.to_csv(study / "summary.tsv", sep="\t", index=False)
    found = read_comparison([tmp_path / name for name in fills])
    exact = stats.ttest_ind(fills["long"], fills["short"], equal_var=False)
    low, high = exact.confidence_interval(0.95)
    (row,) = found.objective_table().rows
    assert [float(x) for x in row[-1].text.split(" to ")] == pytest.approx([low, high], abs=0.006)


def test_what_cannot_be_compared_is_one_sentence(
    finished: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(finished)
    for arguments, sentence in (
        (["faces.yaml"], "STUDY = 'results/faces' cannot be used: valid is two studies"),
        (["faces.yaml", "tube_demo"], "STUDY = 'tube_demo' cannot be used: valid is a finished"),
        (["faces.yaml", "no_such"], "STUDY = 'no_such' cannot be used: valid is the path of"),
    ):
        status, out, err = compare(*arguments)
        assert (status, out) == (1, "")
        assert err.startswith(sentence)
        assert len(err.splitlines()) == 1
