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
from sandmould.report.robustness import RobustnessPages
from sandmould.report.tables import ReportPicture
from sandmould.runs.templates import Note
from sandmould.scenario.drive import BoxDrive
from sandmould.statistics.answer import Answer
from sandmould.statistics.verdict import Verdict
from sandmould.study.collect import Collected
from sandmould.wording.next_steps import NextStep


@dataclass(frozen=True)
class KindPages:
    """The part of a report that depends on what is simulated."""

    template: str = "shell.html"
    """File of ``templates/report``."""
    method: tuple[Note, ...] = ()
    ends: str = "the end of the run"
    """When measures are taken, where the objective names no time."""
    context: Mapping[str, Any] = field(default_factory=dict)
    """What the template is given beside what all are given."""
    figures: Mapping[str, Chart | bytes] = field(default_factory=dict)
    """What is written as files too, by name."""
    picture: ReportPicture | None = None
    """What the first screen shows of the setting that it names."""
    beside: Mapping[str, str] = field(default_factory=dict)
    """Scripts for the folder ``SPHERES`` beside the page, by file name."""
    answer: str = ""
    """Answers the title's question in one sentence; empty where the objective does."""
    grounds: tuple[Note, ...] = ()
    """How sure the answer is."""
    steps: tuple[NextStep, ...] = ()
    """What to do next that other kinds do not ask for."""
    at_last: NextStep | None = None
    """What is still worth computing where nothing else is."""
    findings: tuple[str, ...] = ()
    """What stands below the answer, a sentence or two each."""
    warning: str = ""
    """Why the verdict is to be doubted, beside it; empty where there is no reason."""


@dataclass(frozen=True)
class Findings(Generic[ScenarioT]):
    """What a report is made from."""

    study_folder: Path
    href: str
    """Address of the study's folder, seen from the report."""
    study: Study
    collected: Collected
    verdict: Verdict
    """All settings, compared."""
    answer: Answer
    scenario: ScenarioT
    """Of the run that is shown."""
    by_setting: Mapping[str, tuple[ScenarioT, pd.DataFrame]]
    """Scenario and rows of the summary of the settings that are listed, by label."""
    notes: tuple[str, ...]
    """What the simulation leaves open."""


@dataclass(frozen=True)
class KindReport:
    """What reports of one kind of study say and show of their own: nothing, unless it says so."""

    pages: Callable[[Findings[Any], int], KindPages] = lambda *_: KindPages()
    """What it draws; the film of one run may weigh so many bytes."""
    notes: Callable[[Any, Collected, bool, bool], tuple[str, ...]] = lambda *_: ()
    """What the simulation of a scenario leaves open, whether or not the study looks for the best
    setting, and whether or not its controls have been run."""
    drive: Callable[[Any, pd.DataFrame], BoxDrive | None] = lambda *_: None
    """Drive of the vibrating table at a setting, as ``drive_of``."""
    robustness: Callable[[Findings[Any]], RobustnessPages | None] = lambda _: None
    """What its controls say."""
    mode: Callable[[Findings[Any]], BedMode | None] = lambda _: None
    """First mode of the bed, for a frequency."""
    heaps: Callable[[Path, pd.DataFrame, Verdict, Any], tuple[ReportPicture, ...]] = lambda *_: ()
    """Pictures of what was measured, as ``steepest_heaps``."""
