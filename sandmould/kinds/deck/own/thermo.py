"""Logs of LAMMPS and LIGGGHTS: their tables of thermodynamic output and their run times."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

STEP = "Step"
LOGGED = "log_"
"""Begins the names of the log's own columns in ``series.tsv``."""
_LOOP = re.compile(
    r"^Loop time of (\d+\.?\d*(?:e[-+]?\d+)?) on \d+ procs for (\d+) steps with (\d+) atoms",
    re.MULTILINE,
)


@dataclass(frozen=True)
class Thermo:
    """What the logs of one run say."""

    table: pd.DataFrame
    """One row an output, columns as the engine names them, in order of the log."""
    grains: int
    """At the end of the last ``run``."""
    steps: int
    """Of all runs, those that were done again included, and one that was cut short as far as it is
    logged, or to where the next attempt begins: a log is written some steps late."""
    grain_steps: float
    """Steps of each ``run`` that ended, times grains at its end."""
    loop_s: float
    """Wall time of all these."""


def read_thermo(logs: Sequence[Path]) -> Thermo:
    """Read the logs of a run that went on from restart files, the first attempt first.

    Rows of an attempt from the step on at which the next one begins are left out.

    ``logs``: one an attempt.
    """
    together = pd.DataFrame(columns=[STEP])
    grain_steps = loop_s = 0.0
    every_step = last_grains = 0
    reached = math.inf
    for log in logs:
        text = log.read_text(encoding="utf-8", errors="replace")
        ended = 0
        for found in _LOOP.finditer(text):
            loop, steps, grains = found.groups()
            loop_s += float(loop)
            grain_steps += float(steps) * float(grains)
            every_step, last_grains = every_step + int(steps), int(grains)
            ended = found.end()
        table = pd.DataFrame(list(_rows(text)))
        if table.empty:
            continue
        every_step += int(max(0.0, table[STEP].iloc[0] - reached))
        reached = math.inf
        if cut_short := [row[STEP] for row in _rows(text[ended:])]:
            reached = cut_short[-1]
            every_step += int(reached - cut_short[0])
        together = together[together[STEP] < table[STEP].iloc[0]]
        together = table if together.empty else pd.concat([together, table], ignore_index=True)
    return Thermo(together, last_grains, every_step, grain_steps, loop_s)


def _rows(text: str) -> Iterator[dict[str, float]]:
    """Rows of all tables; what stands between them, such as warnings, is passed over."""
    columns: list[str] = []
    for line in text.splitlines():
        words = line.split()
        if words[:1] == [STEP]:
            columns = words
        elif line.startswith("Loop time"):
            columns = []
        elif columns and len(words) == len(columns):
            try:
                row = dict(zip(columns, map(float, words), strict=True))
            except ValueError:
                continue
            if math.isfinite(row[STEP]):
                yield row
