"""Shows a study while it is computed: a live table on a terminal, plain lines elsewhere."""

from __future__ import annotations

import math
import os
import sys
import time
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

from rich.console import Console
from rich.live import Live

from sandmould.execution.cluster.queue import Job, Outlook, jobs_of, outlook
from sandmould.execution.screen.run_watch import Ended, Running, RunWatch, failure, file_time_s
from sandmould.execution.screen.table import StudyView, counts_text, study_table, times_text
from sandmould.runs.parent import Words
from sandmould.runs.progress import duration_text
from sandmould.study.plan.announcement import stored_speeds
from sandmould.study.plan.build_plan import Plan
from sandmould.study.plan.price import TimeLeft, computed_wall_s

if TYPE_CHECKING:
    from sandmould.execution.screen.so_far import SoFar

LOOK_EVERY_S = 1.0
SHARE_OF_TIME = 0.02
"""Of a core, that looking may take: at thousands of runs it is done less often."""
SELDOM_S = 5.0
ASK_EVERY_S = 30.0
"""Between two looks at the queue of a cluster."""
LINE_EVERY_S = 30.0
"""Between two plain lines on the whole study."""
_TELLING = 20.0
"""Percent from which a run tells how long it takes: grains that fall are cheap."""
_NEARLY = 0.95
"""Most that is called done of a run that does not say how far it is."""


class Screen:
    """What a person sees of one start of a study."""

    def __init__(
        self,
        plan: Plan,
        results: Path,
        cores: int,
        live: bool | None = None,
        submits: bool = False,
        begun_s: float | None = None,
    ) -> None:
        """Look at what is there.

        ``live``: whether to draw a table again and again; by default where stderr is a terminal
        that can. ``submits``: whether runs are computed by jobs of Slurm, on its cores.
        ``begun_s``: when the command began, on the clock of ``time.monotonic``; now unless given.
        """
        self._folder = results / plan.study.name
        logs = self._folder / "logs"
        logs.mkdir(parents=True, exist_ok=True)
        self.log = logs / "snakemake.log"
        """Takes all that Snakemake and its jobs print."""
        self._words = Words(logs / "words.txt")
        self._plan, self._cores = plan, cores
        self._submits = submits
        self._jobs: list[Job] = []
        self._asked_s = -math.inf
        self._live = is_live_terminal() if live is None else live
        self._console = Console(stderr=True, highlight=False, markup=False, emoji=False)
        self._table: Live | None = None
        lacks = plan.lacks(results)
        every = (*plan.fills, *plan.runs)
        self._folders = {run.run: self._folder / run.place for run in every}
        waiting = [run.run for run in every if run.run in lacks]
        self._watch = RunWatch(self._folders, waiting, file_time_s(logs / "words.txt"))
        self._fills = {fill.run for fill in plan.fills}
        whole = [run.run for run in plan.runs if run.run not in lacks]
        self.failures = [Ended(run, said) for run in whole if (said := failure(self._folders[run]))]
        """Runs that failed, in this start or before."""
        self._told: set[str] = set()
        self._done = len(whole) - len(self.failures)
        self._ended: list[Ended] = []
        self._so_far: SoFar | None = None
        self._time_left: TimeLeft | None = None
        self._begun = False
        """Whether a run has begun."""
        self._whole = whole
        self._begun_s = time.monotonic()
        self._command_begun_s = begun_s or self._begun_s
        self._next_line_s = self._begun_s + LINE_EVERY_S

    def __enter__(self) -> Screen:
        if self._live:
            self._table = Live(
                console=self._console, auto_refresh=False, transient=True, redirect_stdout=False
            )
            self._table.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            if error is None:
                self.look()
        finally:
            if self._table is not None:
                self._table.stop()
                self._table = None
        # Of a start that computed nothing, since its input is bad, there is nothing to count.
        if error is None and (self._ended or self.failures or not self._watch.waiting):
            passed = duration_text(time.monotonic() - self._command_begun_s)
            self._print(f"{self._plan.study.name}: {counts_text(self._view())} after {passed}")

    def environment(self) -> dict[str, str]:
        """Environment of what is started."""
        return self._words.environment()

    def look(self) -> float:
        """Look once and show what is new; gives the seconds until the next look."""
        begun = time.process_time()
        if words := self._words.new().strip("\n"):
            self._print(words)
        all_ended = self._watch.look()
        for run in all_ended:
            wall_s = computed_wall_s(self._folders[run.run])
            self._time_left_known(begun=True).learn(run.run, wall_s)
        # Runs tell of a fill that failed.
        ended = [run for run in all_ended if run.run not in self._fills]
        for run in ended:
            self._end(run)
        if self._table is not None:
            view = self._view(self._said_so_far())
            size = self._console.size
            self._table.update(study_table(view, size.width, size.height), refresh=True)
        else:
            self._lines(ended)
        spent_s = time.process_time() - begun
        return min(max(LOOK_EVERY_S, spent_s / SHARE_OF_TIME), SELDOM_S)

    @property
    def is_explained(self) -> bool:
        """Whether what went wrong is that runs failed, which is said of each."""
        return bool(self.failures) and not self._watch.waiting

    def tell_failures(self, most: int = 12) -> None:
        """Say of each failed run why, unless that was said before."""
        untold = [run for run in self.failures if run.run not in self._told]
        for run in untold[:most]:
            self._print(f"{run.run} failed: {run.said}")
        if len(untold) > most:
            self._print(f"and {len(untold) - most} more failed: the report lists them")
        if self.failures:
            self._print("A failed run is computed once more by: sandmould again RUN")

    def _end(self, run: Ended) -> None:
        self._so_far_known().add([run.run])
        if run.said:
            self.failures.append(run)
        else:
            self._done += 1
            self._ended.append(run)

    def _time_left_known(self, begun: bool = False) -> TimeLeft:
        """What foretells the time: made anew until a run begins, once the speed is measured."""
        if self._time_left is None or not self._begun:
            every = (*self._plan.fills, *self._plan.runs)
            self._time_left = TimeLeft(every, stored_speeds(self._plan))
            for run in self._whole:
                self._time_left.learn(run, computed_wall_s(self._folders[run]))
            self._begun = begun or bool(self._watch.running)
        return self._time_left

    def _so_far_known(self) -> SoFar:
        """What judges the runs: made once one has ended, since it waits for a library of tables."""
        if self._so_far is None:
            from sandmould.execution.screen.so_far import SoFar

            self._so_far = SoFar(self._plan.study.study, self._folder)
            self._so_far.add(self._whole)
        return self._so_far

    def _view(self, so_far: str = "") -> StudyView:
        time_left, running = self._time_left_known(), self._watch.running
        passed_s = time.monotonic() - self._begun_s
        for run, at in running.items():
            if at.percent >= _TELLING and at.percent < 100.0:
                taken_s = self._watch.since_s + passed_s - at.begun_s
                time_left.foresee(run, 100 * taken_s / at.percent)
        shares = {run: self._share(at, passed_s) for run, at in running.items()}
        waiting = [run for run in self._watch.waiting if run not in running]
        self._cores, begins_s, awaits = self._outlook(bool(running))
        left_s = time_left.seconds(shares, waiting, self._cores)
        left_s += begins_s if left_s else 0.0
        return StudyView(
            name=self._plan.study.name,
            runs=len(self._plan.runs),
            done=self._done,
            running=tuple(
                (at, time_left.seconds_of(run, shares[run])) for run, at in running.items()
            ),
            waiting=len([run for run in waiting if run not in self._fills]),
            filling=len([run for run in running if run in self._fills]),
            passed_s=passed_s,
            left_s=left_s,
            awaits=awaits,
            share=passed_s / (passed_s + left_s) if passed_s + left_s else 0.0,
            so_far=so_far,
            ended=tuple(self._ended),
            failures=tuple(self.failures),
        )

    def _outlook(self, computes: bool) -> Outlook:
        """What the queue of a cluster lets the study do."""
        if not self._submits:
            return Outlook(self._cores)
        if (now := time.monotonic()) - self._asked_s > ASK_EVERY_S:
            self._jobs, self._asked_s = jobs_of(self._folders), now
        if not self._watch.waiting and any(job.lives for job in self._jobs):
            return Outlook(self._cores, awaits="the end of jobs in the queue")
        return outlook(self._jobs, computes, self._cores, now - self._asked_s)

    def _said_so_far(self) -> str:
        """What the runs say; nothing at the end of a start that had nothing to compute."""
        judged = self._so_far is not None or self._watch.waiting
        return self._so_far_known().sentence() if judged and (self._done or self.failures) else ""

    def _share(self, at: Running, passed_s: float) -> float:
        """What is done of a run; of one that cannot tell, by the time that it has taken."""
        if at.percent > 0.0:
            return at.percent / 100
        taken_s = self._watch.since_s + passed_s - at.begun_s
        whole_s = self._time_left_known().seconds_of(at.run, 0.0)
        return min(_NEARLY, max(0.0, taken_s / whole_s)) if whole_s else 0.0

    def _lines(self, ended: list[Ended]) -> None:
        """Plain lines: each run that has ended, and now and then the whole study."""
        total = len(self._plan.runs)
        before = self._done + len(self.failures) - len(ended)
        for number, run in enumerate(ended, before + 1):
            value = self._so_far_known().value_text(run.run)
            how = f"failed: {run.said}" if run.said else ", ".join(filter(None, ["done", value]))
            self._print(f"[{number}/{total}] {run.run} {how}")
            self._told.add(run.run)
        if (now := time.monotonic()) >= self._next_line_s:
            self._next_line_s = now + LINE_EVERY_S
            view = self._view(self._said_so_far())
            so_far = f"; so far: {view.so_far}" if view.so_far else ""
            self._print(f"{view.name}: {counts_text(view)}; {times_text(view)}{so_far}")

    def _print(self, text: str) -> None:
        if self._live:
            self._console.print(text, soft_wrap=True)
        else:
            print(text, file=sys.stderr, flush=True)


def is_live_terminal() -> bool:
    """Whether stderr is a terminal that a table can be drawn on again and again."""
    return sys.stderr.isatty() and os.environ.get("TERM", "dumb") not in ("", "dumb", "unknown")
