"""What is to be seen of a study at one moment."""

from __future__ import annotations

from dataclasses import dataclass

from sandmould.execution.screen.run_watch import Ended, Running


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
