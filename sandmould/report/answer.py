"""The first screen of a report: what to set on the machine, how sure that is, what to do next."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from sandmould.report.optimum import TWO_SIDED, OptimumPages
from sandmould.report.robustness import RobustnessPages
from sandmould.report.tables import Cell, Column, KeyNumber, Table, share_of_what_fits
from sandmould.runs.columns import finished
from sandmould.runs.formatting import (
    display_scale,
    filled_space,
    name_of,
    number,
    range_text,
    rounded,
    unit_of,
    value_text,
    with_margin,
)
from sandmould.runs.templates import Note, worded
from sandmould.scenario.drive import DISPLACEMENT, VELOCITY, BoxDrive
from sandmould.statistics.answer import Answer
from sandmould.statistics.config import FULL_SHARE
from sandmould.statistics.evidence import usable_values
from sandmould.statistics.optimum import Optimum
from sandmould.statistics.verdict import Verdict
from sandmould.wording.answer import OF_DRIVE, AnswerWords, place_text
from sandmould.wording.next_steps import NextSteps
from sandmould.wording.robustness import recommendation_sentence

_AMPLITUDES = (DISPLACEMENT, VELOCITY)
MOST_CHOICES = 12
"""Settings that the first screen lists."""


@dataclass(frozen=True)
class FirstScreen:
    """What the first screen shows."""

    headline: str
    """Answers the question of the title in one sentence or a few short ones."""
    is_sound: bool
    """Whether the question is answered."""
    figures: tuple[KeyNumber, ...]
    """What to set and what comes of it; empty where several settings may be the best."""
    table: Table | None
    """What each of several settings does."""
    grounds: tuple[Note, ...]
    """How sure it is."""
    steps: NextSteps


def optimum_headline(
    pages: OptimumPages,
    robustness: RobustnessPages | None,
    answer: Answer,
    summary: pd.DataFrame,
    has_speed: bool,
) -> tuple[str, bool]:
    """Say in one sentence where the optimum of a refined study lies.

    ``has_speed``: whether the study gives the wave speed of the real sand.
    """
    optimum, advised = pages.optimum, pages.recommendation
    if optimum is None:
        return pages.sentences[0], False
    if robustness is not None and robustness.assessment.is_artefact:
        return robustness.sentences[0], False
    ends = [end for key in optimum.keys if (end := optimum.at_end(key))]
    if advised is not None and advised.interval_hz is None:
        follows = robustness is not None and robustness.assessment.follows_springs
        if not follows or has_speed or ends:
            return recommendation_sentence(advised), False
        return worded("optimum.j2", places=[]), False
    places = []
    for key, value in optimum.setting.items():
        low, high = optimum.interval(key) if advised is None else advised.interval_hz or (0, 0)
        name = "" if len(optimum.keys) == 1 and unit_of(key) else f"{name_of(key)} "
        at = f"{name}{value_text(key, float(f'{value:.3g}'))}"
        interval = f"95 %: {range_text(key, low, float(f'{high:.3g}'))}"
        drive = drive_at(summary, optimum.keys, optimum.setting)
        places.append(place_text(at, optimum.keys, drive, interval))
    share = share_at(optimum, summary, answer.verdict.measure)
    said = worded(
        "optimum.j2", it=AnswerWords(answer), places=places, ends=ends, sound=pages.sound,
        share="" if math.isnan(share) else f"{100 * share:.0f} %", is_full=share >= FULL_SHARE,
        is_vague=optimum.is_vague,
    )  # fmt: skip
    return said, pages.sound


def drive_at(
    summary: pd.DataFrame, keys: Sequence[str], setting: Mapping[str, float]
) -> BoxDrive | None:
    """The drive between the settings of a sweep; None where runs have none.

    Over one key logarithms are interpolated between the means of its settings, which is exact for
    an amplitude that is held. Over several keys it is the nearest setting's, each key over its
    range.
    """
    if not all(column in summary for column in _AMPLITUDES):
        return None
    rows = summary[finished(summary)].dropna(subset=[*_AMPLITUDES, *keys])
    if rows.empty:
        return None
    means = rows.groupby(list(keys))[list(_AMPLITUDES)].mean().reset_index()
    at = means[list(keys)].to_numpy(dtype=np.float64)
    wanted = np.array([setting[key] for key in keys])
    values = means[list(_AMPLITUDES)].to_numpy(dtype=np.float64)
    if len(keys) == 1 and (at > 0).all() and (values > 0).all():
        x, log = np.log(wanted[0]), np.log(values)
        found = np.exp([np.interp(x, np.log(at[:, 0]), log[:, i]) for i in range(len(_AMPLITUDES))])
    else:
        width = np.maximum(np.ptp(at, axis=0), np.finfo(float).tiny)
        found = values[int((((at - wanted) / width) ** 2).sum(axis=1).argmin())]
    displacement_m, velocity_m_s = found.tolist()
    if not displacement_m > 0.0:
        return None
    return BoxDrive(velocity_m_s / displacement_m / (2 * math.pi), displacement_m)


def share_at(optimum: Optimum, summary: pd.DataFrame, measure: str) -> float:
    """Share of what fits at the optimum; NaN where runs do not tell.

    The bed is about as dense there as at the settings round it.
    """
    mean = float(usable_values(summary, measure).mean())
    return share_of_what_fits(summary, measure) * optimum.value[0] / mean


def figures_of(answer: Answer, summary: pd.DataFrame) -> tuple[KeyNumber, ...]:
    """The one setting that suits the question in words of the machine; nothing where several do."""
    if len(answer.wanted) != 1 or answer.beside:
        return ()
    verdict, setting = answer.verdict, answer.verdict.setting(answer.wanted[0])
    drive = answer.drives.get(setting.label)
    figures = [] if drive is None else [KeyNumber(f"{number(drive.frequency_hz)} Hz", "frequency")]
    figures += _motion_figures(drive)
    figures += [
        KeyNumber(value_text(key, value), name_of(key))
        for key, value in setting.values.items()
        if drive is None or key.rpartition(".")[2] not in OF_DRIVE
    ]
    share = share_of_what_fits(summary, verdict.measure, setting.values)
    runs = f"mean of {setting.n} runs, ± its 95 % interval" if setting.n > 1 else "one run"
    mean = AnswerWords(answer).value(setting.mean, setting.ci_half_width)
    if math.isfinite(share):
        figures.append(_share_figure(share, verdict.measure, "of what fits in"))
    return (*figures, KeyNumber(mean, name_of(verdict.measure), runs))


def table_of(answer: Answer) -> Table | None:
    """What settings do for each thing asked; None where one suits it.

    All settings where several things are asked, else those that suit.
    """
    every = [AnswerWords(each) for each in (answer, *answer.beside)]
    wanted = [answer.verdict.setting(label) for label in answer.wanted]
    settings = (answer.used if answer.beside else wanted)[:MOST_CHOICES]
    if len(settings) < 2:
        return None
    columns = (Column("setting", False), *(Column(of.space or of.name) for of in every))
    rows = tuple(
        (
            Cell(every[0].place(setting), str(place)),
            *(
                Cell(of.worth(own), str(own.mean)) if own.n else Cell("–", "nan")
                for of in every
                for own in [of.answer.verdict.setting(setting.label)]
            ),
        )
        for place, setting in enumerate(settings)
    )
    marked = tuple(bool(answer.beside) and s.label in answer.common for s in settings)
    return Table(columns, rows, marked)


def optimum_choice(
    pages: OptimumPages, summary: pd.DataFrame, verdict: Verdict, is_artefact: bool
) -> tuple[KeyNumber, ...]:
    """The optimum between the settings, in words of the machine; nothing where it is not to be set.

    ``is_artefact``: whether its controls show it to be none of the sand's.
    """
    optimum, advised = pages.optimum, pages.recommendation
    if optimum is None or is_artefact or (advised is not None and advised.interval_hz is None):
        return ()
    of_keys = [
        KeyNumber(
            value_text(key, rounded(value)),
            name_of(key),
            f"95 %: {range_text(key, low, float(f'{high:.3g}'))}",
        )
        for key, value in optimum.setting.items()
        for low, high in [optimum.interval(key)]
    ]
    factor, what = display_scale(verdict.measure)
    mean, se = optimum.value
    of_keys += _motion_figures(drive_at(summary, optimum.keys, optimum.setting))
    share = share_at(optimum, summary, verdict.measure)
    if math.isfinite(share):
        of_keys.append(_share_figure(share, verdict.measure, "of what fits in, about"))
    value = KeyNumber(
        with_margin(factor * mean, TWO_SIDED * factor * se),
        what,
        "fitted curve, ± its 95 % interval",
    )
    return (*of_keys, value)


def _share_figure(share: float, measure: str, label: str) -> KeyNumber:
    space = filled_space(measure).replace("_", " ")
    note = f"100 %: the sand in the {space} is as dense as that outside"
    return KeyNumber(f"{100 * share:.0f} %", label, note)


def _motion_figures(drive: BoxDrive | None) -> list[KeyNumber]:
    if drive is None:
        return []
    return [
        KeyNumber(
            f"{number(1e3 * drive.displacement_m)} mm",
            "amplitude (half of peak to peak)",
            f"{number(2e3 * drive.displacement_m)} mm end to end",
        ),
        KeyNumber(
            f"{number(drive.acceleration_g)} g",
            "peak acceleration",
            f"{number(1e3 * drive.velocity_m_s)} mm/s",
        ),
    ]
