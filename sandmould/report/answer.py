"""The first screen of a report: what to set on the machine, how sure that is, what to do next."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from sandmould.definition.certificate import frequency_among
from sandmould.report.drive import drive_at
from sandmould.report.filling import FULL_SHARE
from sandmould.report.next_steps import NextSteps
from sandmould.report.optimum import TWO_SIDED, OptimumPages
from sandmould.report.robustness import RobustnessPages, follows_springs
from sandmould.report.sureness import Ground
from sandmould.report.tables import Cell, Column, KeyNumber, Table, share_of_what_fits
from sandmould.runs.formatting import (
    OF_BED,
    display_scale,
    filled_space,
    listed,
    name_of,
    number,
    range_text,
    value_text,
    with_margin,
)
from sandmould.scenario.drive import DISPLACEMENT, VELOCITY, BoxDrive
from sandmould.statistics.evidence import usable_values
from sandmould.statistics.settings import Setting
from sandmould.statistics.verdict import Verdict

MOST_CHOICES = 4
"""Settings that are shown in words of the machine where several may be the best."""
_MOST_LABELS = 8
_OF_DRIVE = ("frequency_hz", "acceleration_g", "velocity_m_s", "displacement_m")
"""Ends of swept keys that the motion of the box states."""


@dataclass(frozen=True)
class Answer:
    """What the first screen shows."""

    headline: str
    """Answers the question of the title in one sentence."""
    is_sound: bool
    """Whether the question is answered."""
    figures: tuple[KeyNumber, ...]
    """What to set and what comes of it; empty where several settings may be the best."""
    table: Table | None
    """The same of all these settings."""
    grounds: tuple[Ground, ...]
    """How sure it is."""
    steps: NextSteps


def headline_of(
    verdict: Verdict, keys: Sequence[str], drives: Mapping[str, BoxDrive]
) -> tuple[str, bool]:
    """Say in one sentence which setting to use, and whether the runs decide that.

    Parameters
    ----------
    verdict : Verdict
        Of a study that looks for the best setting.
    keys : sequence of str
        Swept keys.
    drives : mapping of str to BoxDrive
        By the label of the setting.
    """
    best, others = verdict.best, verdict.comparisons
    if best is None:
        return verdict.sentences[0], False
    if not others:
        return f"Not resolved: there are results of {best.label} alone, nothing to compare.", False
    verb = "Shake at" if frequency_among(keys) and len(keys) == 1 else "Use"
    if verdict.resolved:
        motion = _motion(drives.get(best.label), keys)
        return f"{verb} {best.label}{motion}: there {_best_text(verdict)}.", True
    alike = _or([best.label, *(c.other for c in others if not c.separated)])
    worse = [c.other for c in others if c.separated]
    if not worse and _is_full_everywhere(verdict):
        space = filled_space(verdict.measure).replace("_", " ")
        return f"{verb} {alike}: the {space} is full at each, in the mean of the runs.", False
    if not worse:
        return f"Not resolved: these runs cannot tell which is best, {alike}.", False
    are = "are" if len(worse) > 1 else "is"
    return (
        f"{verb} {alike}: these runs cannot tell which of them is best. "
        f"{listed(worse, most=_MOST_LABELS)} {are} worse.",
        False,
    )


def _is_full_everywhere(verdict: Verdict) -> bool:
    """Whether sand fills what fits at every setting, where the measure is that share."""
    is_share = verdict.measure.endswith(OF_BED) and verdict.better == "larger"
    return is_share and all(setting.mean >= FULL_SHARE for setting in verdict.settings)


def optimum_headline(
    pages: OptimumPages,
    robustness: RobustnessPages | None,
    verdict: Verdict,
    summary: pd.DataFrame,
    has_speed: bool,
) -> tuple[str, bool]:
    """Say in one sentence where the optimum of a refined study lies.

    Parameters
    ----------
    pages : OptimumPages
    robustness : RobustnessPages, optional
        Its controls.
    verdict : Verdict
    summary : DataFrame
        One row a run of the sweep.
    has_speed : bool
        Whether the study gives the wave speed of the real sand.
    """
    optimum = pages.optimum
    if optimum is None:
        return pages.sentences[0], False
    if robustness is not None and robustness.assessment.is_artefact:
        return robustness.assessment.sentences[0], False
    advised = pages.recommendation
    if advised is not None and advised.interval_hz is None:
        ends = any(optimum.at_end(key) for key in optimum.keys)
        if follows_springs(robustness) and not (has_speed or ends):
            return (
                "No frequency in Hz is recommended: the best one goes with the hardness of the "
                "sand, and that of your sand is not given.",
                False,
            )
        return advised.sentence, False
    places = []
    for key, value in optimum.setting.items():
        low, high = optimum.interval(key) if advised is None else advised.interval_hz or (0, 0)
        name = "" if len(optimum.keys) == 1 else f"{name_of(key)} "
        at = value_text(key, float(f"{value:.3g}"))
        places.append(f"{name}{at} ({range_text(key, low, float(f'{high:.3g}'))})")
    verb = "Shake at" if frequency_among(optimum.keys) and len(optimum.keys) == 1 else "Use"
    drive = _as_drive(drive_at(summary, optimum.keys, optimum.setting))
    motion = _motion(drive, optimum.keys)
    if pages.sound:
        return f"{verb} {listed(places)}{motion}: there {_best_text(verdict)}.", True
    return (
        f"Not resolved: by these runs the best is near {listed(places)}{motion}, but that is not "
        "certain enough.",
        False,
    )


def _motion(drive: BoxDrive | None, keys: Sequence[str]) -> str:
    """How the box moves, but for what the swept keys say."""
    said = {key.rpartition(".")[2] for key in keys}
    if drive is None:
        return ""
    amplitude = (
        f" with an amplitude of {number(1e3 * drive.displacement_m)} mm, half of peak to peak"
    )
    acceleration = f" ({number(drive.acceleration_g)} g)"
    return (amplitude if "displacement_m" not in said else "") + (
        acceleration if "acceleration_g" not in said else ""
    )


def _as_drive(drive: Mapping[str, float] | None) -> BoxDrive | None:
    """The motion that has these amplitudes."""
    if drive is None or not drive[DISPLACEMENT] > 0.0:
        return None
    frequency_hz = drive[VELOCITY] / drive[DISPLACEMENT] / (2 * math.pi)
    return BoxDrive(frequency_hz, drive[DISPLACEMENT])


def _best_text(verdict: Verdict) -> str:
    """What is best there, as a clause."""
    space = filled_space(verdict.measure)
    if space != verdict.measure and verdict.better == "larger":
        return f"the {space.replace('_', ' ')} fills best"
    most = "highest" if verdict.better == "larger" else "lowest"
    return f"the {name_of(verdict.measure)} is {most}"


def _or(labels: Sequence[str]) -> str:
    """Labels of which one is to be chosen."""
    if len(labels) > _MOST_LABELS:
        return f"{', '.join(labels[: _MOST_LABELS - 1])} or one of {len(labels)} settings in all"
    comma = "; " if any("," in label for label in labels) else ", "
    return f"{comma.join(labels[:-1])} or {labels[-1]}" if len(labels) > 1 else labels[0]


def choices_of(
    verdict: Verdict, summary: pd.DataFrame, drives: Mapping[str, BoxDrive]
) -> tuple[tuple[KeyNumber, ...], ...]:
    """Settings that may be the best, the best mean first, in words of the machine.

    Parameters
    ----------
    verdict : Verdict
    summary : DataFrame
        One row a run of the sweep.
    drives : mapping of str to BoxDrive
        By label.
    """
    if verdict.best is None:
        return ()
    open_ = {c.other for c in verdict.comparisons if not c.separated}
    ranked = [verdict.best, *(_setting(verdict, c.other) for c in verdict.comparisons)]
    alike = [s for s in ranked if s is verdict.best or s.label in open_][:MOST_CHOICES]
    return tuple(_figures(s, verdict, summary, drives.get(s.label)) for s in alike)


def choices_table(choices: Sequence[Sequence[KeyNumber]]) -> Table:
    """Several settings below each other, what they share said once below the table.

    Parameters
    ----------
    choices : sequence of sequence of KeyNumber
        As ``choices_of`` gives them, of two settings or more.
    """
    first, *others = choices
    shared = [
        it.note
        for place, it in enumerate(first)
        if it.note and all(other[place].note == it.note for other in others)
    ]
    columns = tuple(Column(it.label) for it in first)
    rows = tuple(
        tuple(Cell(it.value, it.value, note="" if it.note in shared else it.note) for it in choice)
        for choice in choices
    )
    note = "; ".join(shared)
    return Table(columns, rows, (False,) * len(rows), f"{note[:1].upper()}{note[1:]}.")


def optimum_choice(
    pages: OptimumPages, summary: pd.DataFrame, verdict: Verdict, is_artefact: bool
) -> tuple[KeyNumber, ...]:
    """The optimum between the settings, in words of the machine; nothing where it is not to be set.

    Parameters
    ----------
    pages : OptimumPages
    summary : DataFrame
        One row a run of the sweep.
    verdict : Verdict
    is_artefact : bool
        Whether its controls show it to be none of the sand's.
    """
    optimum, advised = pages.optimum, pages.recommendation
    if optimum is None or is_artefact or (advised is not None and advised.interval_hz is None):
        return ()
    drive = _as_drive(drive_at(summary, optimum.keys, optimum.setting))
    of_keys = [
        KeyNumber(
            value_text(key, float(f"{value:.3g}")),
            name_of(key),
            f"95 %: {range_text(key, low, float(f'{high:.3g}'))}",
        )
        for key, value in optimum.setting.items()
        for low, high in [optimum.interval(key)]
    ]
    factor, what = display_scale(verdict.measure)
    mean, se = optimum.value
    of_keys += _motion_figures(drive)
    share = share_of_what_fits(summary, verdict.measure) * mean
    used = usable_values(summary, verdict.measure)
    if math.isfinite(share):
        # the bed is about as dense at the optimum as at the settings round it
        share /= float(used.mean())
        of_keys.append(_share_figure(share, verdict.measure, "of what fits in, about"))
    value = KeyNumber(
        with_margin(factor * mean, TWO_SIDED * factor * se),
        what,
        "fitted curve, ± its 95 % interval",
    )
    return (*of_keys, value)


def _share_figure(share: float, measure: str, label: str) -> KeyNumber:
    space = filled_space(measure).replace("_", " ")
    note = f"100 %: the {space} packed as densely as the sand round it"
    return KeyNumber(f"{100 * share:.0f} %", label, note)


def _setting(verdict: Verdict, label: str) -> Setting:
    return next(s for s in verdict.settings if s.label == label)


def _figures(
    setting: Setting, verdict: Verdict, summary: pd.DataFrame, drive: BoxDrive | None
) -> tuple[KeyNumber, ...]:
    """What is set, how the box then moves, and what comes of it."""
    figures = [] if drive is None else [KeyNumber(f"{number(drive.frequency_hz)} Hz", "frequency")]
    figures += _motion_figures(drive)
    figures += [
        KeyNumber(value_text(key, value), name_of(key))
        for key, value in setting.values.items()
        if drive is None or key.rpartition(".")[2] not in _OF_DRIVE
    ]
    share = share_of_what_fits(summary, verdict.measure, setting.values)
    factor, what = display_scale(verdict.measure)
    runs = f"mean of {setting.n} runs, ± its 95 % interval" if setting.n > 1 else "one run"
    mean = with_margin(factor * setting.mean, factor * setting.ci_half_width)
    if math.isfinite(share):
        figures.append(_share_figure(share, verdict.measure, "of what fits in"))
    return (*figures, KeyNumber(mean, what, runs))


def _motion_figures(drive: BoxDrive | None) -> list[KeyNumber]:
    if drive is None:
        return []
    return [
        KeyNumber(
            f"{number(1e3 * drive.displacement_m)} mm",
            "amplitude (half of peak to peak)",
            f"{number(1e3 * drive.end_to_end_m)} mm end to end",
        ),
        KeyNumber(
            f"{number(drive.acceleration_g)} g",
            "peak acceleration",
            f"{number(1e3 * drive.velocity_m_s)} mm/s",
        ),
    ]
