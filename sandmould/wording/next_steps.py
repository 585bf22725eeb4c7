"""What to do next after a study: which lines of its file to change, and the command to run."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from sandmould.definition.certificate import frequency_key
from sandmould.definition.study import Study
from sandmould.kinds.sand.kind import SandStudy
from sandmould.kinds.sand.narrow import Narrow
from sandmould.runs.formatting import filled_space, listed, name_of, value_text, with_article
from sandmould.runs.templates import worded
from sandmould.statistics.answer import Answer, Decided
from sandmould.statistics.config import fewest_points
from sandmould.statistics.optimum import Optimum
from sandmould.statistics.robustness import Robustness
from sandmould.statistics.verdict import FEW
from sandmould.wording.answer import AnswerWords

WORTH = 30
"""More replicates than that of each setting are not worth the difference that they would show."""
FINE_ENOUGH = 0.02
"""Share of a value that sizes of elements or steps may leave open."""
OWN_FILE = "my_study.yaml"
SIZE_SCALE = "sand.size_scale"


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


def step(name: str, line: str = "", command: str = "", **values: object) -> NextStep:
    """A step by its name in ``next_step.j2``."""
    return NextStep(worded("next_step.j2", step=name, **values), line, command)


def with_file(steps: Sequence[NextStep], owner: str | None, shipped: str, name: str) -> NextSteps:
    """Say which file the lines of steps belong in.

    ``owner``: the user's file of the study, if known; ``shipped``: the shipped study that it is.
    """
    file = OWN_FILE if shipped or owner is None else owner
    below = f" a file {file} below based_on: {shipped or name}"
    where = f"Write them into{below if file == OWN_FILE else f' {file}'}, then run"
    has_lines = any(each.line for each in steps)
    command = f"sandmould run {file}" if has_lines else ""
    return NextSteps(tuple(steps), where if has_lines else "", command)


def failed_steps(causes: Mapping[str, str]) -> list[NextStep]:
    """What runs that did not finish ask for, by their causes as the runs state them."""
    if not causes:
        return []
    runs = list(causes)
    names = " ".join(runs) if len(runs) <= 2 else f"{runs[0]} ..."
    told = next((" ".join(cause.split()) for cause in causes.values() if cause), "")
    command = f"sandmould again {names}"
    return [step("again", command=command, runs=len(runs), cause=told.rstrip("."))]


def answer_steps(study: Study, answer: Answer) -> list[NextStep]:
    """What the answer of a study asks for: never what is refused, or was computed."""
    decided, key = answer.decided, name_of(answer.asked.keys[0]) if answer.asked.keys else ""
    if decided is Decided.NO_RESULT:
        return []
    if decided is Decided.FINEST:
        return _finer(answer)
    steps = [step("cheapest", key=key)] if decided is Decided.NO_EFFECT else []
    steps += [*_chance(study, answer), *_onwards(answer)]
    reaches = decided is not Decided.NONE_REACHES or steps
    unclear = answer.passage and answer.passage.is_unclear
    spaces = [each for each in (answer, *answer.beside)
              if each.nearly_empty and AnswerWords(each).space]  # fmt: skip
    if AnswerWords(answer).space and not (spaces or reaches or unclear):
        spaces = [answer]
    for each in spaces:
        space = filled_space(each.asked.measure).replace("_", " ")
        steps.append(step("turn", space=space))
    return steps


def _onwards(answer: Answer) -> Iterable[NextStep]:
    """Longer shaking, or values beyond the ends of the sweep, where these may do better."""
    decided = answer.decided
    if answer.asked.better == "neither":
        return
    is_done = {Decided.REACHED, Decided.EQUAL, Decided.NO_EFFECT}
    open_ = [a for a in (answer, *answer.beside) if a.decided not in is_done]
    late = next((a for a in open_ if a.longer_helps), None)
    if late is not None:
        more = AnswerWords(late).more if math.isfinite(late.more_s) else ""
        words = AnswerWords(late)
        yield step("longer", measure=words.name, more=more, target=words.goal_text)
    elif answer.is_rising and decided is Decided.NONE_REACHES and not answer.nearly_empty:
        words = AnswerWords(answer)
        yield step("slow", more=words.more, space=words.space)
    is_unsure = not answer.shown and min((s.n for s in answer.used), default=0) > 1
    same = (Decided.EQUAL, Decided.NO_EFFECT)
    if decided in same or (decided is Decided.REACHED and not is_unsure):
        return
    if decided is Decided.OPEN and answer.asked.by_lot and not _is_worth(answer.further_runs):
        return
    for end in answer.beyond:
        side = "above" if end.is_highest else "below"
        value = value_text(end.key, end.value)
        yield step("beyond", a_key=with_article(name_of(end.key)), side=side, value=value)


def _chance(study: Study, answer: Answer) -> Iterable[NextStep]:
    """More runs of each setting, where they would decide or tell chance at all."""
    if answer.shown:
        yield from _also_reach(answer)
    same = (Decided.EQUAL, Decided.NO_EFFECT)
    if not answer.asked.by_lot or answer.shown or answer.decided in same:
        return
    fewest, decided = min(s.n for s in answer.used), answer.decided
    compares = len(answer.used) > 1 and answer.asked.better != "neither"
    is_short = decided is Decided.NONE_REACHES and not answer.verdict.resolved
    is_short |= decided is Decided.REACHED
    if fewest < (2 if compares and not is_short else FEW):
        runs = max(FEW, study.replicates + (fewest >= FEW))
        if runs > study.replicates:
            yield step("chance", f"replicates: {runs}", runs=runs)
        return
    runs = answer.runs_to_reach(answer.best) if answer.may_reach else 0
    if is_short and answer.best and 0 < runs <= WORTH:
        of_one = len(answer.used) == 1
        yield step("reach", f"replicates: {answer.best.planned + runs}", runs=runs, of_one=of_one)
    if decided is not Decided.OPEN:
        return
    alike, more = answer.alike, answer.further_runs
    if not _is_worth(more):
        yield step("choose", settings=listed([s.label for s in alike]))
        return
    # rounds may have given these settings more runs than the study's file says
    runs, so_far = max(1, more or 0), max(s.planned for s in alike)
    best, others = alike[0].label, listed([s.label for s in alike[1:]])
    yield step("more", f"replicates: {so_far + runs}", runs=runs, best=best, others=others)


def _also_reach(answer: Answer) -> Iterable[NextStep]:
    """More runs of settings that reach the target on average, where others are shown to."""
    needed = [(answer.runs_to_reach(s), s) for s in answer.unsure]
    needed = [(runs, s) for runs, s in needed if 0 < runs <= WORTH]
    if needed:
        runs = max(runs for runs, _ in needed)
        planned = max(s.planned for _, s in needed)
        names = listed([s.label for _, s in needed])
        yield step("reach_too", f"replicates: {planned + runs}", runs=runs, settings=names)


def _is_worth(further_runs: int | None) -> bool:
    return further_runs is not None and further_runs <= WORTH


def _finer(answer: Answer) -> list[NextStep]:
    """A finer size, where those computed leave more open than is usually good enough."""
    refining = answer.refining
    assert refining is not None
    share = refining.error / abs(refining.value) if refining.value else 0.0
    finer = refining.sizes[-1] / 2
    swept = [setting.values[refining.key] for setting in answer.verdict.settings]
    is_tried = any(size <= finer for size in swept)  # and gave no value
    if share <= FINE_ENOUGH or refining.error <= answer.chance_at_finest or is_tried:
        return []
    sizes = ", ".join(f"{size:g}" for size in (*refining.sizes, finer))
    line = f"sweep: {{keys: {{{refining.key}: [{sizes}]}}}}"
    return [step("finer", line, key=name_of(refining.key), percent=100 * share)]


def optimum_steps(
    study: Study, optimum: Optimum | None, robustness: Robustness | None
) -> list[NextStep]:
    """What an optimum and its controls ask for."""
    if optimum is None:
        return [step("settings")]
    steps = []
    for key in optimum.keys:
        untried = [end for end in optimum.reached(key) if not study.table_limit_at(end)]
        if untried:
            one = "above" if untried[0].is_highest else "below"
            side = one if len(untried) == 1 else "on both sides of"
            steps.append(step("outside", a_key=with_article(name_of(key)), side=side))
    within = [key for key in study.refine.interval if not optimum.reached(key)]
    low_high = {key: optimum.interval(key) for key in within}
    wide = [high - low > study.refine.interval[k] for k, (low, high) in low_high.items()]
    if any(wide) or (optimum.is_vague and not steps):
        steps.append(step("rounds", f"refine: {{rounds: {study.refine.rounds + 2}}}"))
    if robustness is None:
        return steps
    if robustness.cause == "held artefact":
        steps.append(step("hold"))
    elif robustness.cause == "numerics artefact":
        steps.append(step("time_step"))
    elif study.certificate.sand_wave_speed is None and robustness.follows_springs:
        line = 'certificate: {sand_wave_speed: {low_m_s: ..., high_m_s: ..., by: "..."}}'
        steps.append(step("wave_speed", line))
    return steps


def certificate_steps(study: Study, answer: Answer) -> list[NextStep]:
    """The controls of a best frequency, where none were asked for."""
    is_best = answer.best is not None and study.seeks_best
    is_swept = study.sweep.number_of_points > 1 and frequency_key(study.sweep)
    is_open = is_best and is_swept and not study.certificate.controls
    if not isinstance(study, SandStudy) or not is_open:
        return []
    fewest = fewest_points(1)
    if study.sweep.number_of_points < fewest:
        return [step("frequencies", fewest=fewest)]
    return [step("certificate", "certificate: {controls: [springs, hold, time_step]}")]


def narrow_steps(study: Study, answer: Answer, spaces: Sequence[Narrow]) -> list[NextStep]:
    """Finer grains, where the narrowest space that is judged is too narrow for the model's."""
    measures = (each.asked.measure for each in (answer, *answer.beside))
    judged = {filled_space(measure).replace("_", " ") for measure in measures}
    of_judged = [it for it in spaces if judged & set(it.names) and it.scale >= 1.0]
    if SIZE_SCALE in study.sweep.swept or not of_judged:
        return []
    it = min(of_judged, key=lambda it: it.scale)
    space = next(name for name in it.names if name in judged)
    line = f"scenario: {{sand: {{size_scale: {it.scale:g}}}}}"
    return [step("narrow", line, space=space, it=it)]


def coarse_step(study: Study, size_scale: float) -> NextStep | None:
    """Finer grains, where nothing else is left and nothing tells what their size does."""
    if size_scale <= 1.0 or SIZE_SCALE in study.sweep.swept:
        return None
    line = f"scenario: {{sand: {{size_scale: {size_scale / 1.5:.3g}}}}}"
    return step("coarse", line, times=size_scale)


def sand_steps(study: Study, is_sound: bool) -> list[NextStep]:
    """What a calibrated sand is good for."""
    if not study.calibration.sands or not is_sound:
        return []
    return [step("sand", f"material: {study.calibration.sands[0].name}")]
