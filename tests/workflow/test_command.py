"""The command ``sandmould`` computes and reports a study of seconds in an empty folder."""

from __future__ import annotations

import contextlib
import os
import pty
import re
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
from typer.testing import CliRunner

from sandmould.cli.commands import app
from tests.workflow.dry_runs import dry_run

COARSE = """\
based_on: plates
scenario: {heat_transfer_w_m2_k: null}
sweep:
  design: list
  points:
    - {exchange: corrected, element_m: 0.01, layers: []}
    - {exchange: faces, element_m: 0.01, layers: []}
reference: {exchange: corrected, element_m: 0.01}
"""


def test_a_study_from_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("coarse.yaml").write_text(COARSE)
    command = [sys.executable, "-m", "sandmould.cli", "run", "coarse.yaml", "--cores", "2"]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert ran.returncode == 0, ran.stderr
    results = Path("results", "coarse")
    said = (results / "verdict.txt").read_text().strip()
    assert said
    assert ran.stdout == f"{said} The report: results/coarse/report.html\n"
    *lines, last = ran.stderr.splitlines()
    first, second = (line for line in lines if line.startswith("["))
    assert first.startswith("[1/2] ")
    assert second.startswith("[2/2] ")
    assert last.startswith("coarse: 2 of 2 runs done after ")
    assert not re.search("rule|jobid|Select jobs", ran.stderr)
    # The shipped profile lets two short runs share a job.
    assert len(list((results / "batches").glob("*.done"))) == 1
    summary = pd.read_csv(results / "summary.tsv", sep="\t")
    assert list(summary["outcome"]) == ["finished"] * 2
    assert {p.name for p in tmp_path.iterdir()} == {".snakemake", "coarse.yaml", "results"}

    # Nothing is left to do: the same is said without Snakemake, which agrees.
    again = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert (again.stdout, again.stderr) == (ran.stdout, "coarse: 2 of 2 runs done, nothing left\n")
    files = ("--configfile", "coarse.yaml", "--cores", "1")
    dry = dry_run(*files, folder=tmp_path)
    assert "Nothing to be done" in dry.stdout + dry.stderr
    (results / "summary.tsv").touch()
    again = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert again.returncode == 0
    assert "coarse: 2 of 2 runs done after " in again.stderr

    said = CliRunner().invoke(app, ["status", "coarse.yaml"])
    assert said.stdout.startswith("coarse: 2 done of 2 runs\n")
    page = results / "report.html"
    page.unlink()
    again = CliRunner().invoke(app, ["report", "coarse.yaml"])
    assert again.exit_code == 0, again.output
    assert page.stat().st_size > 1e5


HIDE_CURSOR, SHOW_CURSOR = "\x1b[?25l", "\x1b[?25h"


def test_on_a_terminal_a_table_is_drawn_and_taken_away(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("TERM", "xterm")
    Path("coarse.yaml").write_text(COARSE)
    command = [sys.executable, "-m", "sandmould.cli", "run", "coarse.yaml", "--cores", "2"]
    stopped, said = on_a_terminal(command, until="0 of 2 runs done", types="\x03")
    assert stopped == 130, said
    assert said.count("coarse was stopped: the same command goes on with it.") == 1
    assert "Traceback" not in said
    assert said.rindex(SHOW_CURSOR) > said.rindex(HIDE_CURSOR)
    status, said = on_a_terminal(command)
    assert status == 0, said
    assert "2 of 2 runs done after " in said
    assert said.rindex(SHOW_CURSOR) > said.rindex(HIDE_CURSOR)
    *_, last = said.splitlines()
    assert last.endswith(" The report: results/coarse/report.html")


def on_a_terminal(command: list[str], until: str = "", types: str = "") -> tuple[int, str]:
    """Run a command on a terminal of its own; type something once it has said something."""
    pid, terminal = pty.fork()
    if not pid:
        os.execv(command[0], command)
    said = b""
    with contextlib.suppress(OSError):  # that is how a terminal says that nobody is left on it
        while words := os.read(terminal, 65536):
            said += words
            if types and until.encode() in said:
                os.write(terminal, types.encode())
                types = ""
    os.close(terminal)
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]), said.decode(errors="replace")
