"""What makes the report of a kind of study: its notes, its pages, and what few kinds have."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic

import pandas as pd

from sandmould.definition.study import Study
from sandmould.drawing.chart import Chart
from sandmould.kinds.kind import ScenarioT
from sandmould.report.bed_mode import BedMode
from sandmould.report.heaps import Heap
from sandmould.report.method import Row
from sandmould.report.next_steps import NextStep
from sandmould.report.robustness import RobustnessPages
from sandmould.report.sureness import Ground
from sandmould.statistics.verdict import Verdict
from sandmould.study.collect import Collected


@dataclass(frozen=True)
class KindPages:
    """The part of a report that depends on what is simulated."""

    template: str
    """File of ``templates/report``."""
    method: tuple[Row, ...]
    ends: str
    """When measures are taken, where the objective names no time."""
    advice: tuple[str, ...]
    """What follows the verdict."""
    context: Mapping[str, Any]
    """What the template is given beside what all are given."""
    figures: Mapping[str, Chart | bytes] = field(default_factory=dict)
    """What is written as files too, by name."""
    beside: Mapping[str, str] = field(default_factory=dict)
    """Scripts for the folder ``SPHERES`` beside the page, by file name."""
    answer: str = ""
    """Answers the title's question in one sentence; empty where the objective does."""
    grounds: tuple[Ground, ...] = ()
    """How sure the answer is."""
    steps: tuple[NextStep, ...] = ()
    """What to do next that other kinds do not ask for."""
    warning: str = ""
    """Why the verdict is to be doubted, beside it; empty where there is no reason."""


@dataclass(frozen=True)
class Findings(Generic[ScenarioT]):
    """What the pages of a kind are drawn from."""

    study_folder: Path
    study: Study
    scenario: ScenarioT
    """Of the run that is shown."""
    collected: Collected
    verdict: Verdict
    film_budget_bytes: int
    """Most that the film of one run may weigh."""
    href: str
    """Address of the study's folder, seen from the report."""
    by_setting: Mapping[str, ScenarioT]
    """A scenario of each setting, by its label."""


@dataclass(frozen=True)
class KindReport(Generic[ScenarioT]):
    """What reports of one kind of study say and show of their own."""

    notes: Callable[[ScenarioT, Collected, bool, bool], tuple[str, ...]]
    """What the simulation leaves open; arguments are those of ``notes_of``."""
    pages: Callable[[Findings[ScenarioT]], KindPages]
    """What it draws."""
    shows_drives: bool = False
    """Whether settings are listed with the drive of a vibrating table."""
    robustness: Callable[[Path, Study, Collected, ScenarioT], RobustnessPages | None] | None = None
    """What its controls say; arguments are those of ``robustness_of``."""
    mode: Callable[[ScenarioT, pd.DataFrame], BedMode | None] | None = None
    """First mode of the bed, for a frequency; arguments are those of ``mode_of``."""
    heaps: Callable[[Path, pd.DataFrame, Verdict, ScenarioT], tuple[Heap, ...]] | None = None
    """Pictures of what was measured; arguments are those of ``heaps_of``."""
