"""The report of a study in which nothing is drawn by lot asks for no replicates."""

from __future__ import annotations

from pathlib import Path

import pytest

from sandmould.report.page import write_report
from tests.finished_study import FLOW, finished_study, study_text


@pytest.mark.slow
@pytest.mark.parametrize(
    "text", [study_text((0.02,)), FLOW.replace("[1]", "[1, 2]")], ids=["casting", "flow"]
)
def test_it_asks_for_no_replicates(
    text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("plain.yaml").write_text(text)
    finished_study(tmp_path / "plain.yaml")
    folder = Path("results/plain")
    write_report(folder, folder / "report.html")
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "replicates: " not in page
    assert "Fewer than 3 runs" not in page
    assert "Nothing is random, so a setting is one run" in page
