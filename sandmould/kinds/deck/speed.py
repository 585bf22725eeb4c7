"""How long a deck of the user's own takes here: a pilot of some seconds, stored."""

from __future__ import annotations

import contextlib
import json
import math
import multiprocessing
import os
import shutil
import signal
import tempfile
import textwrap
import time
from collections.abc import Sequence
from multiprocessing.context import ForkProcess
from pathlib import Path

import numpy as np
import pandas as pd

from sandmould.bad_input import BadInputError, Problem, display_path
from sandmould.digest import SHORT, digest
from sandmould.engines.registry import engine_module
from sandmould.kinds.deck.own import computation
from sandmould.kinds.deck.own import deck as own_deck
from sandmould.kinds.deck.own.measures import measured
from sandmould.kinds.deck.own.thermo import LOGGED, STEP
from sandmould.kinds.kind import StoredSpeed
from sandmould.runs.files import write_text
from sandmould.runs.formatting import display_number, name_of
from sandmould.runs.parent import end_with_parent, print_to, say
from sandmould.runs.templates import worded
from sandmould.scenario.own_deck import OwnDeck

FAILED_LOG = "pilot_failed.log"
"""Log of the last pilot that failed, in the folder of all results."""
PILOT_S = 12.0
"""A shorter run is computed whole; of a longer one its steps are counted."""
_LOOK_EVERY_S = 0.2
MOST_OFF = 1e-3
"""Share of a measure that a restart may change before it is said."""
ROUND_OFF = 1e-9
"""Share of a measure's largest value below which it is as good as nothing."""


class DeckSpeed(StoredSpeed[OwnDeck]):
    """See ``StoredSpeed``; what is stored is the processor time of a whole run."""

    basis = "by a pilot run"

    def computed_by(self, scenario: OwnDeck) -> str:
        """Engine and deck: a deck with other values is one of another price."""
        version = engine_module(scenario.engine.name).installed_version()
        seeded = scenario.model_copy(update={"seed": 1})
        starts = ("", own_deck.RESTART_FILES[0])
        decks = [own_deck.render(seeded, "pilot", "pilot", start) for start in starts]
        deck = digest(*decks, *sorted(f"{name} {of}" for name, of in scenario.measures.items()))
        return f"{scenario.engine.name} {version} {deck[:SHORT]}"

    def trial(self, scenario: OwnDeck, results: Path) -> float | None:
        """Processor time of a whole run, by a pilot; what else it has shown is kept beside it."""
        core_s, said = pilot(scenario, results)
        kept = self._said(scenario)
        with contextlib.suppress(OSError):
            kept.parent.mkdir(parents=True, exist_ok=True)
            kept.write_text(said, encoding="utf-8")
        return core_s

    def measured(self, scenario: OwnDeck, results: Path) -> float | None:
        """The same as of any speed; what a pilot has shown is said at each start."""
        rate = super().measured(scenario, results)
        with contextlib.suppress(OSError):
            if said := self._said(scenario).read_text(encoding="utf-8"):
                say(said)
        return rate

    def _said(self, scenario: OwnDeck) -> Path:
        return self.file(scenario).with_suffix(".said")

    def rate(self, scenario: OwnDeck, stored: float) -> float:
        """Expected core-seconds that a second of a core computes."""
        return scenario.expected_core_s / stored


def pilot(scenario: OwnDeck, results: Path, pilot_s: float = PILOT_S) -> tuple[float | None, str]:
    """Compute the deck for some seconds in a folder of its own, in one piece and gone on with.

    A scenario of several ranks has no pilot. ``results``: folder of all results, which keeps the
    log of a pilot that failed.

    Returns
    -------
    float or None
        Processor time of a whole run; None where the deck states no ``steps`` and did not end in
        time.
    str
        What else it has shown: sentences on lines, or nothing.

    Raises
    ------
    BadInputError
        With what the engine said, where the deck stopped with an error.
    """
    if scenario.engine.ranks > 1:
        return None, ""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "runs" / "pilot"
        folder.mkdir(parents=True)
        write_text(folder / "deck.in", own_deck.render(scenario, "pilot", "pilot"))
        core_s, status = _computed(scenario, folder, pilot_s)
        if status is not None and not (folder / "whole.json").exists():
            raise BadInputError([_failure(scenario, folder, status, results)])
        whole = _measured(scenario, folder / "work")
        is_whole = (folder / "whole.json").exists()
        beyond = _beyond(scenario, whole) if is_whole else ""
        resumed = _resumed(scenario, whole, folder, pilot_s)
        shown = (_lacks(scenario, whole), beyond, resumed)
        return core_s, "\n".join(f"{_of_values(scenario)}: {said}." for said in shown if said)


def _computed(scenario: OwnDeck, folder: Path, pilot_s: float) -> tuple[float | None, int | None]:
    """Processor time of a whole run, and the status with which the pilot ended, if it did."""
    process = multiprocessing.get_context("fork").Process(target=_compute, args=(scenario, folder))
    process.start()
    try:
        return _watched(process, folder, pilot_s), process.exitcode
    finally:
        process.kill()
        process.join()


def _lacks(scenario: OwnDeck, series: pd.DataFrame) -> str:
    """Say which columns the log of a pilot has not printed yet."""
    logged = [str(name).removeprefix(LOGGED) for name in series]
    missing = own_deck.missing_columns(scenario, logged) if len(series) else ""
    return f"in its first seconds {missing.rstrip('.')}" if missing else ""


def _beyond(scenario: OwnDeck, series: pd.DataFrame) -> str:
    """Say which windows of measures do not lie within a whole run."""
    if "time_s" not in series or not len(series):
        return ""
    lasts_s = float(series["time_s"].iloc[-1] - series["time_s"].iloc[0])
    windows = {
        ".".join(("measures", name, key)): value
        for name, taken in scenario.taken.items()
        for key, value in (("from_s", taken.from_s), ("over_last_s", taken.over_last_s))
        if value is not None and value > lasts_s * (1.0 + 1e-6)  # round-off
    }
    return worded("deck_windows.j2", windows=windows, lasts_s=lasts_s) if windows else ""


def _resumed(scenario: OwnDeck, whole: pd.DataFrame, folder: Path, pilot_s: float) -> str:
    """Have the deck go on from the older of its restart files, and say what that changes."""
    work, why = folder / "work", folder / "why.txt"
    if not (files := computation.restarts(scenario, work)):
        return ""
    for newer in files[:-1]:
        newer.unlink()
    for left in (folder / "begun", folder / "whole.json", why):
        left.unlink(missing_ok=True)
    _computed(scenario, folder, pilot_s)
    said = why.read_text(encoding="utf-8") if why.exists() else computation.WENT_ON
    if not said.startswith(computation.WENT_ON):
        return f"a run that is killed does not go on as it should. {said}"
    return difference(whole, _measured(scenario, work), list(scenario.measures))


def _measured(scenario: OwnDeck, work: Path) -> pd.DataFrame:
    """The log of a pilot with the measures beside it."""
    series = computation.series(work)
    return pd.concat([measured(scenario, series, work / own_deck.OUTPUT), series], axis=1)


def difference(whole: pd.DataFrame, resumed: pd.DataFrame, measures: Sequence[str]) -> str:
    """Say which measures a restart changes, at the last step of both series, or nothing."""
    step = LOGGED + STEP
    names = [name for name in measures if name in whole]
    one, other = (
        table.drop_duplicates(step, keep="last").set_index(step)[names]
        for table in (whole, resumed)
    )
    gap = (other - one).dropna(how="all").abs()
    parted = gap[(gap > 0).any(axis=1)]
    if parted.empty:
        return ""
    last, largest = gap.index[-1], one.abs().max()
    off = gap.loc[last] > np.maximum(MOST_OFF * one.loc[last].abs(), ROUND_OFF * largest)
    told = [
        f"{name_of(n)} {display_number(n, now, 4)} instead of {display_number(n, before, 4)}"
        for n, now, before in zip(names, other.loc[last], one.loc[last], strict=True)
        if off[n]
    ]
    if not told:
        return ""
    grew = "they part slowly, as colliding grains make much of the last digit"
    if (parted.iloc[0] > MOST_OFF * largest).any():
        grew = "they part at once, so the deck does not bring back all that it needs"
    return (
        "gone on from a restart file, it comes to other values than in one piece: at step "
        f"{last:.0f} {', '.join(told)}; {grew}"
    )


def _failure(scenario: OwnDeck, folder: Path, status: int, results: Path) -> Problem:
    """Say why a pilot failed, and keep its log."""
    why = folder / "why.txt"
    said = why.read_text(encoding="utf-8") if why.exists() else f"its process ended with {status}"
    said = said.rstrip(". ")
    logs = [path for path in (folder / "work" / "engine_1.log", folder / "log") if path.exists()]
    kept = results / FAILED_LOG
    results.mkdir(parents=True, exist_ok=True)
    shutil.copy(logs[0], kept)
    return Problem(
        "scenario.template", scenario.template, "a deck that runs",
        sentence=f"{_of_values(scenario)} stopped in a pilot run. {said}. Its "
        f"log: {display_path(kept)}",
    )  # fmt: skip


def _of_values(scenario: OwnDeck) -> str:
    """Name the deck of a pilot."""
    values = textwrap.shorten(json.dumps(scenario.values, ensure_ascii=False), 120)
    return f"{Path(scenario.template).name} with the values {values}"


def _watched(process: ForkProcess, folder: Path, pilot_s: float) -> float | None:
    """What a whole run takes, once the pilot has ended or has gone on for long enough."""
    whole, progress = folder / "whole.json", folder / "work" / "progress.json"
    begun_s = None
    while process.is_alive():
        if begun_s is None and (folder / "begun").exists():
            begun_s = time.monotonic()
        if begun_s is not None and time.monotonic() - begun_s > pilot_s:
            break
        time.sleep(_LOOK_EVERY_S)
    if whole.exists():
        return max(float(json.loads(whole.read_text())), 1e-3)
    if not progress.exists() or begun_s is None:
        return None
    now = json.loads(progress.read_text())
    taken_s = progress.stat().st_mtime - (folder / "begun").stat().st_mtime
    whole_s = float(now["left_s"]) + taken_s
    return whole_s if math.isfinite(whole_s) else None


def _compute(scenario: OwnDeck, folder: Path) -> None:
    """Compute the pilot of a folder, in a process that may be killed."""
    end_with_parent(signal.SIGKILL)
    with (folder / "log").open("w") as log, open(os.devnull) as nothing:
        os.dup2(nothing.fileno(), 0)
        print_to(log.fileno())
    write_text(folder / "begun", "")
    computed = computation.compute(scenario, folder, "pilot", "pilot")
    outcome = computed.outcome
    write_text(folder / "why.txt", outcome.detail or outcome.outcome.label)
    if outcome.outcome == 0:
        write_text(folder / "whole.json", json.dumps(computed.cost.cpu_s))
