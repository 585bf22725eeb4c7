"""One run of the user's deck: from its newest restart file, or from its beginning, to its end."""

from __future__ import annotations

import contextlib
import ctypes
import json
import math
import shutil
import threading
import time
from pathlib import Path

import pandas as pd

from sandmould.engines.registry import deck_reader, engine_module
from sandmould.engines.session import EngineStop
from sandmould.kinds.deck.own.deck import (
    OUTPUT,
    RESTART_FILES,
    check_unchanged,
    missing_columns,
    names_used,
    render,
)
from sandmould.kinds.deck.own.measures import missing_dump
from sandmould.kinds.deck.own.thermo import LOGGED, STEP, Thermo, read_thermo
from sandmould.plain_file import UNREADABLE, read_json
from sandmould.runs.files import write_text
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.runs.products import Computed, Cost, cpu_time_s, peak_memory_bytes
from sandmould.runs.progress import LINE_EVERY_S, Progress
from sandmould.scenario.own_deck import CLOCK, OwnDeck

FLUSH_EVERY_S = 0.5
"""What a killed run can lose of its log."""
_DECK = "deck.in"
_SPENT = "spent.json"
"""In ``work``: wall and processor time of all attempts at a run."""
WENT_ON = "gone on from"
"""How the outcome of a run that was killed begins to say where it was taken up again."""


def compute(scenario: OwnDeck, folder: Path, run: str, study: str) -> Computed:
    """Have the engine read the deck of a run.

    A restart file that cannot be gone on from is left for the one before it, and that for the
    beginning.

    ``folder``: the run's, with its deck where that is rendered; it runs in ``work/output``.

    Raises
    ------
    BadInputError
        When its files are no longer those of the plan.
    """
    engine, reader = engine_module(scenario.engine.name), deck_reader(scenario.engine.name)
    world = engine.communicator()
    is_root = world is None or world.rank == 0
    folder = folder.absolute()  # the engine works in a folder of its own
    work = folder / "work"
    output, rendered = work / OUTPUT, folder / _DECK
    candidates = [f"../{path.name}" for path in restarts(scenario, work)] if is_root else []
    if world is not None:
        candidates = world.bcast(candidates)
    check_unchanged(scenario, is_rendered=not candidates)
    spent = _Spent(work / _SPENT)
    cost = Cost(scenario.engine.name, scenario.engine.ranks, math.nan, math.nan)
    notes: list[str] = []
    outcome, detail = Outcome.FINISHED, ""
    for restart in (*candidates, ""):
        logs = _logs(work)
        log = work / f"engine_{len(logs) + 1}.log"
        if is_root:
            if restart or not rendered.is_file():
                deck = render(scenario, run, study, restart)
            else:
                deck = rendered.read_text(encoding="utf-8")
            _lay_out(scenario, output, deck, bool(restart))
        if world is not None:
            world.barrier()
        progress = Progress(run, work, scenario.steps, "steps")
        progress.earlier_cpu_s = spent.earlier_cpu_s
        watch = _Watch(log, progress, spent, is_root)
        try:
            with watch:
                reader.read_deck(output, _DECK, log)
            if restart and not (rows := read_thermo([log]).table).empty:
                notes.append(f"{WENT_ON} {Path(restart).name} at step {rows[STEP].iloc[0]:.0f}")
            break
        except EngineStop as stop:
            if restart and read_thermo([log] if log.exists() else []).table.empty:
                notes.append(f"{Path(restart).name} could not be gone on from: {stop.detail}")
                continue
            outcome, detail = stop.outcome, stop.detail
            if is_root:
                _end_log(log, detail)
            break
    thermo = read_thermo(_logs(work))
    if outcome is Outcome.FINISHED:
        missing = missing_columns(scenario, [str(column) for column in thermo.table])
        missing = missing or missing_dump(scenario, output)
        if said := missing or _wrong_end(scenario, read_thermo([log]), bool(restart)):
            outcome, detail = Outcome.BAD_INPUT, said
    cost.version = str(engine.installed_version())
    cost.grains = thermo.grains
    cost.steps, cost.grain_steps, cost.engine_wall_s = (
        thermo.steps, thermo.grain_steps, thermo.loop_s
    )  # fmt: skip
    cost.wall_s, cost.cpu_s = spent.now_s()
    cost.peak_memory_bytes = peak_memory_bytes()
    cost.largest_overlap_fraction = math.nan
    last_s = float(thermo.table[CLOCK].iloc[-1]) if CLOCK in thermo.table else 0.0
    detail = "; ".join([detail, *notes] if detail else notes)
    return Computed(RunOutcome(outcome, detail, last_s, last_s), cost, is_root)


def _wrong_end(scenario: OwnDeck, thermo: Thermo, went_on: bool) -> str:
    """Say that a deck did not end at the step that the study states; empty where it did.

    A deck may count its steps anew on the way: unless it went on from a restart file, those of
    all its runs together may be the stated ones instead. ``thermo``: of the last attempt.
    """
    if scenario.steps is None or thermo.table.empty:
        return ""
    last = int(thermo.table[STEP].iloc[-1])
    if last == scenario.steps or (not went_on and thermo.steps == scenario.steps):
        return ""
    said = f"the deck ended at step {last}, not at steps = {scenario.steps}"
    if went_on:
        return f"{said}: after a restart write run {scenario.steps} upto"
    return f"{said}: state the steps that the deck runs, or none"


def series(work: Path) -> pd.DataFrame:
    """Time in s, and the whole log beside it."""
    table = read_thermo(_logs(work)).table
    clock = table[[CLOCK]].set_axis(["time_s"], axis=1) if CLOCK in table else table[[]]
    return pd.concat([clock, table.add_prefix(LOGGED)], axis=1)


def restarts(scenario: OwnDeck, work: Path) -> list[Path]:
    """Restart files of an earlier attempt, the newest first."""
    files = [work / name for name in RESTART_FILES if (work / name).is_file()]
    if not files or "restart" not in names_used(scenario):
        return []
    return sorted(files, key=lambda path: path.stat().st_mtime, reverse=True)


def _lay_out(scenario: OwnDeck, output: Path, deck: str, goes_on: bool) -> None:
    """Make the folder that the deck runs in; one that goes on keeps what it has written."""
    if not goes_on and output.exists():
        shutil.rmtree(output)
    output.mkdir(parents=True, exist_ok=True)
    for name in scenario.files:
        shutil.copy(scenario.paths[name], output)
    (output / _DECK).write_text(deck, encoding="utf-8")


def _logs(work: Path) -> list[Path]:
    """Logs of all attempts in order."""
    return sorted(work.glob("engine_*.log"), key=lambda path: int(path.stem.split("_")[1]))


def _end_log(log: Path, said: str) -> None:
    """End a log with what the engine said, where it died before it had written that."""
    text = log.read_text(encoding="utf-8", errors="replace") if log.exists() else ""
    if "ERROR" not in text:
        log.write_text(f"{text}\n{said}\n".lstrip(), encoding="utf-8")


class _Spent:
    """What a run has taken, with the attempts at it that were killed."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._begun_s, self._cpu_begun_s = time.monotonic(), cpu_time_s()
        self._earlier_s = self.earlier_cpu_s = 0.0
        with contextlib.suppress(*UNREADABLE):
            before = read_json(path)
            self._earlier_s, self.earlier_cpu_s = float(before["wall_s"]), float(before["cpu_s"])

    def now_s(self) -> tuple[float, float]:
        """Wall and processor time of all attempts."""
        wall_s = self._earlier_s + time.monotonic() - self._begun_s
        return wall_s, self.earlier_cpu_s + cpu_time_s() - self._cpu_begun_s

    def note(self) -> None:
        """Write it down for the next attempt."""
        with contextlib.suppress(OSError):
            text = json.dumps(dict(zip(("wall_s", "cpu_s"), self.now_s(), strict=True)))
            write_text(self._path, text)


class _Watch:
    """Has a log written out while the engine fills it, and shows how far it has come."""

    def __init__(self, log: Path, progress: Progress, spent: _Spent, is_root: bool) -> None:
        self._log, self._progress, self._spent, self._is_root = log, progress, spent, is_root
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._look, daemon=True)

    def __enter__(self) -> None:
        self._begun = time.monotonic()
        if self._is_root:
            self._thread.start()

    def __exit__(self, *_: object) -> None:
        self._over.set()
        if self._is_root:
            self._thread.join()
            self._spent.note()

    def _look(self) -> None:
        first: float | None = None
        last_line = time.monotonic()
        libc = ctypes.CDLL(None)
        while not self._over.wait(FLUSH_EVERY_S):
            libc.fflush(None)  # LAMMPS keeps some kilobytes of its log to itself
            self._spent.note()
            if time.monotonic() - last_line < LINE_EVERY_S or not self._log.exists():
                continue
            last_line = time.monotonic()
            table = read_thermo([self._log]).table
            if table.empty:
                continue
            step = float(table[STEP].iloc[-1])
            first = float(table[STEP].iloc[0]) if first is None else first
            rate = (step - first) / (time.monotonic() - self._begun)
            time_s = float(table[CLOCK].iloc[-1]) if CLOCK in table else math.nan
            self._progress.show("deck", time_s, step, rate)
