"""What to do next after a study: which lines of its file to change, and the command to run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from sandmould.definition.certificate import frequency_key
from sandmould.definition.study import Study
from sandmould.report.agreement import AgreementPages
from sandmould.report.curves import best_passage
from sandmould.report.optimum import OptimumPages
from sandmould.report.robustness import RobustnessPages, follows_springs
from sandmould.runs.columns import RUN, finished
from sandmould.runs.formatting import is_number, listed, name_of, value_text
from sandmould.statistics.config import fewest_points
from sandmould.statistics.verdict import FEW, MANY, MOST_NAMED, Verdict, further_replicates
from sandmould.study.collect import Collected
from sandmould.study.plan.ownership import owner_of, shipped_name

WORTH = 30
"""More replicates than that of each setting are not worth the difference that they would show."""
_FEW_SHOW_NOTHING = "these few runs cannot show a difference"
_STILL = 0.02
"""Share by which a measure may still change in the last quarter of a vibration."""
_OWN_FILE = "my_study.yaml"


@dataclass(frozen=True)
class NextStep:
    """One thing to do."""

    text: str
    line: str = ""
    """What to write for it into the study's file."""
    command: str = ""


@dataclass(frozen=True)
class NextSteps:
    """All that is worth doing, the most useful first."""

    steps: tuple[NextStep, ...]
    before: str
    """Which file the lines belong in; empty without lines."""
    command: str
    """What then computes them; empty without lines."""


def next_steps(
    study_folder: Path,
    study: Study,
    collected: Collected,
    verdict: Verdict,
    is_sound: bool,
    specific: Sequence[NextStep] = (),
) -> NextSteps:
    """Say what to do after a study.

    Parameters
    ----------
    study_folder : Path
        ``results/<study>``.
    study : Study
    collected : Collected
    verdict : Verdict
    is_sound : bool
        Whether the question is answered.
    specific : sequence of NextStep, optional
        What this answer, and its kind of study, ask for.
    """
    steps = [*_failed(collected.summary), *specific]
    if study.seeks_best:
        steps += [*_longer(collected.of_sweep, verdict), *_certificate(study, verdict)]
        if is_sound and not steps:
            steps.append(NextStep("Nothing is left to compute: try it on the real machine."))
    owner = owner_of(study_folder)
    has_lines = any(step.line for step in steps)
    shipped = shipped_name(owner)
    file = _OWN_FILE if shipped or owner is None else owner
    name = shipped or study_folder.name
    where = f"Write them into a file {file} below based_on: {name}" if file == _OWN_FILE else (
        f"Write them into {file}"
    )  # fmt: skip
    return NextSteps(
        tuple(steps),
        f"{where}, then run" if has_lines else "",
        f"sandmould run {file}" if has_lines else "",
    )


def setting_steps(study: Study, verdict: Verdict) -> list[NextStep]:
    """What the comparison of settings asks for: more runs, or values past the sweep's end."""
    return [*_replicates(study, verdict), *_beyond(verdict, study)]


def optimum_steps(
    study: Study, pages: OptimumPages, robustness: RobustnessPages | None
) -> list[NextStep]:
    """What an optimum and its controls ask for.

    Parameters
    ----------
    study : Study
    pages : OptimumPages
    robustness : RobustnessPages, optional
        Its controls.
    """
    optimum = pages.optimum
    if optimum is None:
        return [NextStep("Add settings to the sweep, or runs to each of them.")]
    steps = []
    for key in optimum.keys:
        end = optimum.at_end(key)
        if end:
            side = {"lowest": "below", "highest": "above"}.get(end, "on both sides of")
            text = f"Add {_a(name_of(key))} {side} what was swept: the best may lie there."
            steps.append(NextStep(text))
    low_high = {key: optimum.interval(key) for key in study.refine.interval}
    if any(high - low > study.refine.interval[k] for k, (low, high) in low_high.items()):
        text = "Go on with more rounds: the interval is not yet as narrow as asked."
        steps.append(NextStep(text, f"refine: {{rounds: {study.refine.rounds + 2}}}"))
    cause = robustness.assessment.cause if robustness is not None else ""
    if cause == "artefact of what is held constant":
        text = "State with hold what your table really holds, and sweep again."
        steps.append(NextStep(text))
    elif cause == "artefact of the numerics":
        text = "Repeat it with a smaller time step (time_step.fraction) until the optimum stays."
        steps.append(NextStep(text))
    elif study.certificate.sand_wave_speed is None and follows_springs(robustness):
        text = "Say how fast waves run in your sand: the best frequency goes with that."
        line = 'certificate: {sand_wave_speed: {low_m_s: ..., high_m_s: ..., by: "..."}}'
        steps.append(NextStep(text, line))
    return steps


def agreement_steps(pages: AgreementPages) -> list[NextStep]:
    """What a comparison of settings that should agree asks for."""
    if pages.sound:
        return [NextStep("Take the cheapest of them: it gives the same.")]
    text = "See in the table of comparisons which differ, and which need more runs."
    return [NextStep(text)]


def estimate_steps(study: Study, verdict: Verdict, is_sound: bool) -> list[NextStep]:
    """What a value that was to be found asks for."""
    steps = []
    if any(1 < s.n < FEW for s in verdict.settings):
        text = f"Run every setting at least {FEW} times: two runs say little of chance."
        steps.append(NextStep(text, f"replicates: {FEW}"))
    if study.calibration.sands and is_sound:
        text = "Use the sand in a study of your own:"
        steps.append(NextStep(text, f"material: {study.calibration.sands[0].name}"))
    return steps


def _failed(summary: pd.DataFrame) -> list[NextStep]:
    lost = [str(run) for run in summary.loc[~finished(summary), RUN]]
    if not lost:
        return []
    names = " ".join(lost) if len(lost) <= 2 else f"{lost[0]} ..."
    one = len(lost) == 1
    return [
        NextStep(
            f"See in the table of runs why {'a run' if one else f'{len(lost)} runs'} did not "
            f"finish. Once the cause is gone, compute {'it' if one else 'them'} again:",
            command=f"sandmould again {names}",
        )
    ]


def _replicates(study: Study, verdict: Verdict) -> list[NextStep]:
    """More runs of each setting, where they decide."""
    best = verdict.best
    if best is None or verdict.resolved or not verdict.comparisons:
        return []
    if any(not c.tested for c in verdict.comparisons):
        wanted = max(FEW, study.replicates + 1)
        text = f"Run every setting at least {wanted} times, so that chance can be told."
        return [NextStep(text, f"replicates: {wanted}")]
    more = further_replicates(verdict.comparisons, best)
    open_ = [best.label, *(c.other for c in verdict.comparisons if not c.separated)]
    if more is None or more > WORTH:
        return [NextStep(_undecided(listed(open_), best.n, more))]
    wanted = study.replicates + max(1, more)
    return [
        NextStep(
            f"Run about {max(1, more)} more fillings of each setting: they tell {listed(open_)} "
            "apart if the difference is as large as it seems.",
            f"replicates: {wanted}",
        )
    ]


def _a(name: str) -> str:
    """A name with its article."""
    return f"an {name}" if name[0] in "aeio" else f"a {name}"


def _undecided(open_: str, runs: int, more: int | None) -> str:
    """Say what to do with settings that a sensible number of runs does not tell apart."""
    if runs < MANY:
        return f"Choose between {open_} by what suits your machine: {_FEW_SHOW_NOTHING}."
    needed = f" About {more} more runs of each would tell." if more and more <= MOST_NAMED else ""
    return f"Choose between {open_} by what suits your machine: no difference shows.{needed}"


def _beyond(verdict: Verdict, study: Study) -> list[NextStep]:
    """Values past the end of the sweep, where the best lies at it."""
    steps = []
    for key in study.sweep.swept if verdict.best is not None else ():
        values = [s.values.get(key) for s in verdict.settings]
        mine = verdict.best.values.get(key) if verdict.best is not None else None
        numbers = [float(v) for v in values if is_number(v) and math.isfinite(v)]
        if len(numbers) < len(values) or min(numbers) == max(numbers):
            continue
        if mine in (min(numbers), max(numbers)):
            side = "below" if mine == min(numbers) else "above"
            text = (
                f"Add {_a(name_of(key))} {side} {value_text(key, mine)} to the sweep: the best may "
                "lie there."
            )
            steps.append(NextStep(text))
    return steps


def _longer(collected: Collected, verdict: Verdict) -> list[NextStep]:
    if verdict.measure not in collected.curves:
        return []
    passage = best_passage(collected, verdict, verdict.measure)
    if passage is None or passage[1] == 0.0:
        return []
    change = passage[2] / passage[1] - 1.0
    if abs(change) < _STILL:
        return []
    way = "rising" if change > 0 else "falling"
    text = (
        f"Shake for longer (duration_s): the {name_of(verdict.measure)} was still {way} at the "
        f"end, by {100 * abs(change):.0f} % in the last quarter."
    )
    return [NextStep(text)]


def _certificate(study: Study, verdict: Verdict) -> list[NextStep]:
    """The controls of the best frequency, where none were asked for."""
    if verdict.best is None or not frequency_key(study.sweep) or study.certificate.controls:
        return []
    fewest = fewest_points(1)
    if study.sweep.number_of_points < fewest:
        text = (
            f"Sweep {fewest} frequencies or more: with fewer the best frequency cannot be found "
            "between those that were computed."
        )
        return [NextStep(text)]
    text = (
        "Before you trust a frequency in Hz, test whether it goes with the model's springs or "
        "with what the table holds:"
    )
    return [NextStep(text, "certificate: {controls: [springs, hold, time_step]}")]
