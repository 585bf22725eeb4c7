"""The report of a study in which nothing is drawn by lot asks for no replicates."""

from __future__ import annotations

from pathlib import Path

import pytest

from sandmould.report.page import write_report
from tests.finished_study import finished_study, study_text

FLOW = """\
based_on: tank
scenario:
  case: {particle_m: 0.004, width_m: 0.016, depth_m: 0.032}
  duration_s: 0.01
  record_s: 0.005
  dt_max_s: 0.002
objective: {measure: h20_sd_pa}
sweep: {keys: {relaxations: [1, 2]}}
"""


@pytest.mark.slow
@pytest.mark.parametrize("text", [study_text((0.02,)), FLOW], ids=["casting", "flow"])
def test_it_asks_for_no_replicates(
    text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("plain.yaml").write_text(text)
    finished_study(tmp_path / "plain.yaml")
    folder = Path("results/plain")
    write_report(folder, folder / "report.html")
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "usable replicates" not in page
    assert "nothing is drawn by lot, so a setting is one run" in page
