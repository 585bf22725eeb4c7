"""How sure an answer is, in a few lines: scatter, springs, wave speed, certificate, grains."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sandmould.definition.certificate import frequency_key
from sandmould.definition.study import Study
from sandmould.kinds.sand.narrow import narrow_spaces
from sandmould.kinds.sand.table_motion import throws_no_sand
from sandmould.report.robustness import RobustnessPages
from sandmould.runs.formatting import listed, name_of, number
from sandmould.scenario.hardness import bed_hardness
from sandmould.scenario.scenario import Scenario
from sandmould.statistics.answer import Answer
from sandmould.statistics.settings import Setting
from sandmould.statistics.verdict import Verdict
from sandmould.wording.answer import reasons_text


@dataclass(frozen=True)
class Ground:
    """One reason to trust an answer, or to doubt it."""

    about: str
    text: str


def finished_ground(answer: Answer) -> tuple[Ground, ...]:
    """Say which runs do not count, and why."""
    if not answer.left_out:
        return ()
    return (Ground("Runs", f"{reasons_text(answer.left_out)}, of {answer.planned}: not counted."),)


def scatter_ground(verdict: Verdict, differ_in: str, seeks_best: bool) -> tuple[Ground, ...]:
    """Say how much replicates differ.

    Parameters
    ----------
    verdict : Verdict
    differ_in : str
        What the replicates of a setting do not share.
    seeks_best : bool
        Whether the two best settings are to be compared.
    """
    used = [s for s in verdict.settings if s.n]
    if not used:
        return ()
    sds = [s.sd for s in used if math.isfinite(s.sd)]
    if not sds:
        text = "one run of each setting: how much chance matters is not known."
        return (Ground("Scatter", text),)
    sd = math.sqrt(sum(x * x for x in sds) / len(sds))
    text = (
        f"{_runs(used)} of each setting, alike but for {differ_in}. Their "
        f"{name_of(verdict.measure)} differs by {number(sd, 2)} (standard deviation)"
    )
    first = verdict.comparisons[0] if verdict.comparisons and seeks_best else None
    if first is None or not first.tested or verdict.best is None:
        return (Ground("Scatter", f"{text}."),)
    return (
        Ground(
            "Scatter",
            f"{text}; the means of {verdict.best.label} and {first.other} differ by "
            f"{number(abs(first.difference), 2)}.",
        ),
    )


def _runs(settings: Sequence[Setting]) -> str:
    fewest, most = min(s.n for s in settings), max(s.n for s in settings)
    return f"{most} runs" if fewest == most else f"{fewest} to {most} runs"


def certificate_ground(study: Study, robustness: RobustnessPages | None) -> tuple[Ground, ...]:
    """Say what the controls of a best frequency showed; nothing for other studies.

    Parameters
    ----------
    study : Study
    robustness : RobustnessPages, optional
        None where they were not run.
    """
    if not study.seeks_best or not frequency_key(study.sweep):
        return ()
    if robustness is not None:
        return (Ground("Certificate", robustness.sentences[0]),)
    text = (
        "Three tests of the best frequency have not been run. They show whether it changes with "
        "the model's springs, with what the table holds constant, and with the time step."
    )
    return (Ground("Certificate", text),)


def sand_grounds(scenario: Scenario, study: Study, verdict: Verdict) -> tuple[Ground, ...]:
    """Say how sure the answer of a study of sand is.

    Parameters
    ----------
    scenario : Scenario
        Of the run that is shown.
    study : Study
    verdict : Verdict
    """
    grounds = [*scatter_ground(verdict, "the grains' starting places", study.seeks_best)]
    hardness = bed_hardness(scenario)
    if study.seeks_best and frequency_key(study.sweep):
        sand = study.certificate.sand_wave_speed
        if hardness is not None:
            of_sand = ""
            if sand is not None:
                low, high = number(sand.low_m_s), number(sand.high_m_s)
                of_sand = f" In the real sand it is {low} to {high} m/s."
            text = (
                "the model's sand is as hard as a bed in which waves run at "
                f"{number(hardness.wave_speed_m_s)} m/s.{of_sand}"
            )
            grounds.append(Ground("Springs", text))
        grounds += _held(scenario)
    grounds += [Ground("Narrow", text) for text in narrow_spaces(scenario).values()]
    scale = scenario.sand.size_scale
    if scale > 1.0:
        text = f"{scale:g} times as large as those of the real sand, to save time."
        grounds.append(Ground("Grains", text))
    return tuple(grounds)


def weak_ground(by_setting: Mapping[str, Scenario]) -> tuple[Ground, ...]:
    """Say at which settings the box never throws the sand."""
    weak = [label for label, scenario in by_setting.items() if throws_no_sand(scenario)]
    if not weak:
        return ()
    text = f"at {listed(weak, most=8)} the box never throws the sand: expect little there."
    return (Ground("Below 1 g", text),)


def _held(scenario: Scenario) -> list[Ground]:
    """What the drive holds when the frequency changes, and what that leaves open."""
    if not scenario.vibrations:
        return []
    hold = scenario.vibrations[0].hold
    held = {
        "acceleration": "the acceleration stays the same when the frequency changes",
        "velocity": "the velocity stays the same when the frequency changes",
        "displacement": "the amplitude (half of peak to peak) stays the same when the frequency "
        "changes, as with an eccentric",
        "unbalance": "rotating masses shake the table, as with an unbalance motor",
    }[hold]
    return [Ground("Drive", f"{held}. With another drive another frequency may be best.")]
