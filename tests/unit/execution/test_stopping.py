"""A command that is asked to end takes all that it started with it, silently."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

# In place of Snakemake: a job that waits, and a word of each process at the terminal's interrupt.
JOB = "import os, sys, time; print(os.getpid(), flush=True); time.sleep(60)"
STARTED = f"""
import subprocess, sys
try:
    subprocess.run([sys.executable, "-c", {JOB!r}])
except KeyboardInterrupt:
    print("noise", file=sys.stderr)
"""
COMMAND = f"""
import sys
from sandmould.execution.stopping import run_in_group, until_stopped
sys.exit(until_stopped(lambda: run_in_group(lambda: exec({STARTED!r})), "mine"))
"""


def started(*prefix: str) -> tuple[subprocess.Popen[str], int]:
    """Start the command as a terminal does, in a group of its own; the process of its job."""
    command = [*prefix, sys.executable, "-c", COMMAND]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, process_group=0,
        # whoever runs the tests may ignore a closed terminal, which children inherit
        preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_DFL),
    )  # fmt: skip
    assert process.stdout is not None
    return process, int(process.stdout.readline())


def is_alive(pid: int) -> bool:
    """Whether a process is there and no zombie."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"


def gone(pid: int) -> bool:
    """Wait for a process to end: the kernel takes a moment."""
    deadline = time.monotonic() + 10
    while is_alive(pid) and time.monotonic() < deadline:
        time.sleep(0.01)
    return not is_alive(pid)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_all_with_one_sentence(number: signal.Signals) -> None:
    process, job = started()
    os.killpg(process.pid, number)
    _, said = process.communicate(timeout=30)
    assert process.returncode == 128 + number
    assert said == "\nmine was stopped: the same command goes on with it.\n"
    assert gone(job)


def test_under_nohup_a_closed_terminal_ends_nothing() -> None:
    process, job = started("env", "--ignore-signal=HUP")
    os.killpg(process.pid, signal.SIGHUP)
    time.sleep(0.2)
    assert process.poll() is None
    assert is_alive(job)
    os.killpg(process.pid, signal.SIGTERM)
    process.communicate(timeout=30)
    assert gone(job)


def test_temporary_files_of_a_killed_command_go_with_the_next(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    process, job = started()
    process.kill()
    process.wait(timeout=30)
    os.kill(job, signal.SIGKILL)
    (left,) = tmp_path.iterdir()
    process, _ = started()
    assert not left.exists()
    assert len([*tmp_path.iterdir()]) == 1
    process.terminate()
    process.communicate(timeout=30)
    assert [*tmp_path.iterdir()] == []


def test_a_killed_command_leaves_no_snakemake_behind() -> None:
    process, job = started()
    parent = int(Path(f"/proc/{job}/stat").read_text().rpartition(")")[2].split()[1])
    process.kill()
    process.wait(timeout=30)
    assert gone(parent)
    os.kill(job, signal.SIGKILL)  # a run ends with its own parent; this one does not
