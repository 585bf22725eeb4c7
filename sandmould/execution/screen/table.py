"""The live table of a study: what runs, how far it is, what it says so far."""

from __future__ import annotations

from dataclasses import dataclass

from rich.cells import cell_len, set_cell_size
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from sandmould.execution.screen.run_watch import Ended, Running
from sandmould.runs.progress import duration_text

_FEWEST_ROWS = 3
_WIDE = 100
"""Columns of a terminal from which simulated time and speed have room."""
_NAME_SHARE = 0.4
"""Of the width, that names of runs take at most."""


@dataclass(frozen=True)
class StudyView:
    """A study that is being computed."""

    name: str
    runs: int
    """All of the study, those of earlier starts included."""
    done: int
    """Those that reached their end."""
    running: tuple[tuple[Running, float], ...]
    """Runs that are being computed, each with the time that it will still take, s."""
    waiting: int
    filling: int
    """Of what is running, the fills that runs share; they are no runs."""
    passed_s: float
    """Since this start."""
    left_s: float
    """Until the report is written."""
    share: float
    """Of the time of this start, that has passed."""
    so_far: str
    """What the runs say; empty before the first has a value."""
    ended: tuple[Ended, ...]
    """Runs of this start that reached their end, the last one last."""
    failures: tuple[Ended, ...]
    """All that failed, the last one last."""
    awaits: str = ""
    """What the queue of a cluster has to do first; nobody knows when that is."""

    @property
    def now(self) -> str:
        """What is being done or waited for, where no run is computed."""
        return self.awaits or ("" if self.running or self.waiting else "tables and report")


def study_table(view: StudyView, width: int, height: int) -> RenderableType:
    """Lay out a study for a terminal, no higher than it is.

    States are words, never colours alone.
    """
    head = [Text.assemble((view.name, "bold"), f"  {counts_text(view)}"), _whole(view, width)]
    if view.so_far:
        head.append(Text(f"So far: {view.so_far}", style="bold"))
    above = sum(-(-cell_len(text.plain) // width) for text in head)
    failures, running, ended = _shares(view, max(_FEWEST_ROWS, height - above - 3))
    return Group(
        *head,
        *([_running_table(view.running[:running], width)] if running else []),
        *_more(len(view.running) - running, "running"),
        *[_line(f"finished  {run.run}", width) for run in view.ended[len(view.ended) - ended :]],
        *[
            _line(f"failed    {run.run}: {run.said}", width, "bold")
            for run in view.failures[len(view.failures) - failures :]
        ],
        *_more(len(view.failures) - failures, "failed"),
    )


def counts_text(view: StudyView) -> str:
    """How many runs are where."""
    parts = [
        f"{number} {what}"
        for number, what in (
            (len(view.failures), "failed"), (len(view.running) - view.filling, "running"),
            (view.waiting, "waiting"),
        )
        if number
    ]  # fmt: skip
    if view.filling:
        parts.append(f"{view.filling} shared {'fill' if view.filling == 1 else 'fills'} running")
    return ", ".join([f"{view.done} of {view.runs} runs done", *parts])


def times_text(view: StudyView) -> str:
    """What has passed and what is left."""
    left = f"about {duration_text(view.left_s)} left" if view.left_s >= 1.0 else "soon done"
    doing = f", {view.now}" if view.now else ""
    return f"{duration_text(view.passed_s)} passed, {left}{doing}"


def _whole(view: StudyView, width: int) -> Text:
    """The bar of the whole study with its times."""
    times = f" {100 * view.share:3.0f} % {times_text(view)}"
    return Text.assemble(_bar(view.share, max(10, min(width - cell_len(times), 60))), times)


def _bar(share: float, width: int) -> Text:
    """A bar whose length tells without colour, in letters that any terminal has."""
    full = round(min(max(share, 0.0), 1.0) * (width - 2))
    return Text(f"[{'#' * full}{'.' * (width - 2 - full)}]", no_wrap=True)


def _running_table(running: tuple[tuple[Running, float], ...], width: int) -> Table:
    names = max((cell_len(at.run) for at, _ in running), default=0)
    name_width = min(max(names, 3), int(_NAME_SHARE * width))
    table = Table.grid(padding=(0, 1))
    for at, left_s in running:
        name = set_cell_size(_cut(at.run, name_width), name_width)
        left = f"{duration_text(left_s)} left" if left_s >= 1.0 else "soon"
        cells: list[RenderableType] = [
            Text(name, no_wrap=True),
            _bar(at.percent / 100, 22 if width >= _WIDE else 12),
            f"{at.percent:3.0f} %",
            Text(_cut(at.stage or "begins", 12), no_wrap=True),
        ]
        if width >= _WIDE:
            cells += [f"{at.simulated_s:.3f} s", f"{at.work_per_s / 1e6:.2f} M/s"]
        table.add_row(*cells, Text(left, no_wrap=True))
    return table


def _shares(view: StudyView, rows: int) -> tuple[int, int, int]:
    """Lines for failures, for runs that are computed and for those that have just ended."""
    failures = min(len(view.failures), max(1, rows // 3))
    rows -= failures + (len(view.failures) > failures)
    running = min(len(view.running), max(1, rows - 1))
    rows -= running + (len(view.running) > running)
    return failures, running, min(len(view.ended), max(0, rows), 5)


def _more(number: int, what: str) -> list[Text]:
    return [Text(f"and {number} more {what}")] if number > 0 else []


def _line(text: str, width: int, style: str = "") -> Text:
    return Text(_cut(text, width), style=style, no_wrap=True)


def _cut(text: str, width: int) -> str:
    """Text of one line, cut where it is too wide."""
    flat = " ".join(text.splitlines())
    return flat if cell_len(flat) <= width else f"{set_cell_size(flat, width - 3)}..."
