"""Faults, each put upon a study that is then called again by the same command."""

from __future__ import annotations

import random
import shutil
import subprocess
import time
from functools import cache
from pathlib import Path
from typing import Any

from benchmarks.reliability.attempts import (
    Attempt,
    command,
    ended,
    environment,
    kill_group,
    largest_difference,
    results_of,
    run_and_kill,
    run_to_its_end,
    started,
)

KINDS = {
    "sand": "sand, reference engine",
    "sand_fill": "sand, runs that share a fill",
    "sand_lammps": "sand, LAMMPS",
    "sand_liggghts": "sand, LIGGGHTS",
    "pattern": "sand and pattern, coupled",
    "deck": "a deck of the user's, LAMMPS",
    "casting": "solidification",
    "metal": "flow of metal",
}


@cache
def undisturbed(study: str, scratch: Path) -> tuple[Path, float]:
    """Compute a study without a fault: its working folder, and how long it took."""
    folder = _emptied(scratch / f"{study}_undisturbed")
    # once before, so that compiling and measuring the machine's speed are not in the time
    for _ in range(2):
        shutil.rmtree(results_of(study, folder), ignore_errors=True)
        attempt = run_to_its_end(study, folder)
        _must_end(attempt)
    return folder, attempt.took_s


def killed(study: str, scratch: Path, kills: int, seed: int) -> dict[str, Any]:
    """Kill the command at random moments, again and again, then let it end.

    Every third kill the folder is emptied, so that kills fall into all parts of a study.
    """
    whole, took_s = undisturbed(study, scratch)
    chance = random.Random(f"{study} {seed}")
    folder = _emptied(scratch / f"{study}_killed")
    row: dict[str, Any] = {"kills": 0, "tracebacks": 0, "not_ended": 0, "difference": 0.0}
    after_s: list[float] = []
    while row["kills"] < kills:
        attempt = run_and_kill(study, folder, chance.uniform(0.3, 0.95) * took_s)
        row["tracebacks"] += attempt.has_traceback
        if attempt.status == 0:
            _emptied(folder)
            continue
        row["kills"] += 1
        after_s.append(attempt.took_s)
        if row["kills"] % 3 == 0 or row["kills"] == kills:
            last = run_to_its_end(study, folder)
            row["tracebacks"] += last.has_traceback
            row["not_ended"] += last.status != 0
            row["difference"] = max(row["difference"], largest_difference(study, folder, whole))
            _emptied(folder)
    return row | {"study_s": round(took_s, 1), "moments_s": [round(t, 2) for t in after_s]}


def torn(study: str, scratch: Path, times: int, seed: int) -> dict[str, Any]:
    """Cut files of a killed run's checkpoints short, each as a disk does that lost its power."""
    whole, _ = undisturbed(study, scratch)
    chance = random.Random(f"{study} torn {seed}")
    row = {"times": 0, "not_ended": 0, "tracebacks": 0, "difference": 0.0, "files": 0}
    for _ in range(times):
        folder = _emptied(scratch / f"{study}_torn")
        process = started(command(study), folder)
        while process.poll() is None and not _checkpoints(study, folder):
            time.sleep(0.01)
        kill_group(process)
        process.communicate()
        for path in _checkpoints(study, folder):
            data = path.read_bytes()
            path.write_bytes(data[: chance.randrange(len(data) + 1)])
            row["files"] += 1
        last = run_to_its_end(study, folder)
        row["times"] += 1
        row["tracebacks"] += last.has_traceback
        row["not_ended"] += last.status != 0
        row["difference"] = max(row["difference"], largest_difference(study, folder, whole))
    return row


def two_drivers(study: str, scratch: Path) -> dict[str, Any]:
    """Two terminals start the same study at once."""
    whole, _ = undisturbed(study, scratch)
    folder = _emptied(scratch / f"{study}_twice")
    begun_s = time.perf_counter()
    both = [started(command(study), folder) for _ in range(2)]
    attempts = [ended(process, begun_s) for process in both]
    return {
        "statuses": [attempt.status for attempt in attempts],
        "tracebacks": sum(attempt.has_traceback for attempt in attempts),
        "difference": largest_difference(study, folder, whole),
    }


def full_disk(study: str, scratch: Path, size: str) -> dict[str, Any]:
    """The disk of the results fills up; then there is room and the command is called again."""
    mount = f"mount -t tmpfs -o size={size} tmpfs results"
    return _on_a_bad_disk(study, scratch / f"{study}_full", mount, scratch)


def read_only(study: str, scratch: Path) -> dict[str, Any]:
    """The folder of the results cannot be written."""
    mount = "mount --bind results results && mount -o remount,ro,bind results"
    return _on_a_bad_disk(study, scratch / f"{study}_read_only", mount, scratch)


def _on_a_bad_disk(study: str, folder: Path, mount: str, scratch: Path) -> dict[str, Any]:
    """Call the command where the results are on a disk of its own, then where they are not.

    What the bad disk holds is copied to the good one, as after a disk was made larger.
    """
    whole, _ = undisturbed(study, scratch)
    _emptied(folder)
    (folder / "results").mkdir()
    words = " ".join(f"'{word}'" for word in command(study))
    script = f"{mount} && {words}; status=$?; cp -r results kept; exit $status"
    begun_s = time.perf_counter()
    process = subprocess.Popen(
        ["unshare", "--map-root-user", "--mount", "sh", "-c", script], cwd=folder, text=True,
        env=environment(), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True,
    )  # fmt: skip
    attempt = ended(process, begun_s)
    shutil.rmtree(folder / "results")
    (folder / "kept").rename(folder / "results")
    last = run_to_its_end(study, folder)
    return {
        "status": attempt.status,
        "tracebacks": attempt.has_traceback + last.has_traceback,
        "said": _sentence(attempt),
        "not_ended": int(last.status != 0),
        "difference": largest_difference(study, folder, whole),
    }


def _sentence(attempt: Attempt) -> str:
    """The line of the output that tells of the disk."""
    words = ("disk", "Read-only", "read-only", "No space")
    lines = [line.strip() for line in attempt.text.splitlines()]
    return next((line for line in lines if any(word in line for word in words)), "nothing")


def _checkpoints(study: str, folder: Path) -> list[Path]:
    """Files of sealed checkpoints of all runs."""
    marks = results_of(study, folder).glob("*/*/work/checkpoint_*/mark.json")
    return sorted(path for mark in marks for path in mark.parent.iterdir())


def _emptied(folder: Path) -> Path:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


def _must_end(attempt: Attempt) -> None:
    if attempt.status:
        raise SystemExit(f"the undisturbed study failed:\n{attempt.text}")
