"""A folder has one owner on all machines; a dead one is followed, a living one is waited for."""

from __future__ import annotations

import errno
import fcntl
import json
import multiprocessing
import os
import threading
import time
from pathlib import Path

import pytest

from sandmould.execution.locks import computing, is_locked
from sandmould.runs import claim
from sandmould.runs.claim import CLAIM_FILE, Claim, owner_of


@pytest.fixture(autouse=True)
def _soon(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a second be long."""
    for name, seconds in (("BEAT_S", 0.05), ("STALE_S", 4.0), ("_POLL_S", 0.01)):
        monkeypatch.setattr(claim, name, seconds)


def as_of(folder: Path, machine: str, age_s: float = 0.0) -> None:
    """Write the claim of a process of some machine."""
    owner = {"host": machine, "boot": machine, "pid": 1, "job": "7", "token": machine}
    path = folder / CLAIM_FILE
    path.write_text(json.dumps(owner))
    os.utime(path, (time.time() - age_s,) * 2)


def test_another_machine_is_waited_for_until_it_lets_go(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    as_of(tmp_path, "node7")
    owner = owner_of(tmp_path)
    assert owner is not None
    assert owner.text() == "job 7 on node7"
    let_go = threading.Event()

    def let_it_go() -> None:
        let_go.set()
        (tmp_path / CLAIM_FILE).unlink()

    threading.Timer(0.3, let_it_go).start()
    mine = Claim(tmp_path, alone=True)
    assert let_go.is_set()
    assert "waiting for job 7 on node7, which works there" in capsys.readouterr().err
    assert owner_of(tmp_path) is None  # of this machine the lock tells
    assert owner_of(tmp_path, here=True) is not None
    mine.let_go()
    assert list(tmp_path.iterdir()) == []


def test_a_dead_owner_is_followed(tmp_path: Path) -> None:
    as_of(tmp_path, "node7", age_s=9.0)
    Claim(tmp_path, alone=True).let_go()
    # One of this machine at once: it does not hold the lock any more, or its number is nobody's.
    child = multiprocessing.get_context("fork").Process(target=_die_with, args=(tmp_path,))
    child.start()
    child.join()
    assert (tmp_path / CLAIM_FILE).exists()
    claim.STALE_S = 1000.0
    Claim(tmp_path, alone=False).let_go()
    # A file that was cut short is nobody's once it is old.
    claim.STALE_S = 0.2
    (tmp_path / CLAIM_FILE).write_text("{")
    Claim(tmp_path, alone=True).let_go()


def _die_with(folder: Path) -> None:
    Claim(folder, alone=True)
    os._exit(9)


def test_an_owner_renews_its_claim_and_hears_of_its_loss(tmp_path: Path) -> None:
    lost = threading.Event()
    Claim(tmp_path, alone=True, lost=lost.set)
    first = (tmp_path / CLAIM_FILE).stat().st_mtime
    time.sleep(0.3)
    assert (tmp_path / CLAIM_FILE).stat().st_mtime > first
    assert not lost.is_set()
    as_of(tmp_path, "node7")
    assert lost.wait(5.0)


def test_a_claim_is_kept_by_a_process_that_works_in_another_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "run").mkdir()
    monkeypatch.chdir(tmp_path)
    lost = threading.Event()
    mine = Claim(Path("run"), alone=True, lost=lost.set)
    first = Path("run", CLAIM_FILE).stat().st_mtime
    monkeypatch.chdir("/")
    time.sleep(0.3)
    assert not lost.is_set()
    assert (tmp_path / "run" / CLAIM_FILE).stat().st_mtime > first
    mine.let_go()
    assert not (tmp_path / "run" / CLAIM_FILE).exists()


def test_where_the_file_system_has_no_locks_the_claim_keeps_two_apart(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none_here(file: object, how: int) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", none_here)
    entered = threading.Event()

    def second() -> None:
        with computing(tmp_path):
            entered.set()

    with computing(tmp_path):
        assert is_locked(tmp_path)
        beside = threading.Thread(target=second)
        beside.start()
        assert not entered.wait(0.2)
    assert entered.wait(5.0)
    beside.join()
    assert not is_locked(tmp_path)


def test_of_many_machines_one_at_a_time_owns_a_folder(tmp_path: Path) -> None:
    """Eight machines in turns, some of which die while they own it: no two are there at once."""
    fork = multiprocessing.get_context("fork")
    inside, most, turns = fork.Value("i", 0), fork.Value("i", 0), fork.Value("i", 0)

    def machine(number: int) -> None:
        claim._boot = lambda: f"node{number}"  # type: ignore[assignment]
        for turn in range(12):
            mine = Claim(tmp_path, alone=True)
            with inside.get_lock():
                inside.value += 1
                most.value = max(most.value, inside.value)
            time.sleep(0.002)
            with inside.get_lock():
                inside.value -= 1
                turns.value += 1
            if number == 0 and turn == 5:
                os._exit(9)  # without a word: the others wait until it is stale
            mine.let_go()

    machines = [fork.Process(target=machine, args=(number,)) for number in range(8)]
    for each in machines:
        each.start()
    for each in machines:
        each.join(60)
    assert (most.value, turns.value) == (1, 7 * 12 + 6)


def test_pipes_in_place_of_files_of_a_lock_hang_nothing(tmp_path: Path) -> None:
    for name in ("lock", "lock_owner"):
        os.mkfifo(tmp_path / name)
    assert not is_locked(tmp_path)
    os.utime(tmp_path / "lock_owner", (0.0, 0.0))
    with computing(tmp_path):
        assert (tmp_path / "lock").is_file()
