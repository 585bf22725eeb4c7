"""Whether a coupled run is to be trusted: its convergence log classified."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd

LAST_SHARE = 0.1
"""Of the time of a convergence log: its last part, which is classified."""
RESIDUAL_SHARE = 0.1
"""Residual over displacement up to which a loop holds. Equally good loops end some ten per cent
apart, for the rest of sand under a pattern depends on the way there."""
MADE_SHARE = 0.1
"""Of the stored energy: what the loop may have added to the work of the sand."""
State = Literal["holds", "lags", "one way", "cycles", "diverged"]
_MEANS: dict[State, str] = {
    "holds": "the sand saw the pattern where its loads bend it",
    "lags": "the sand saw the pattern elsewhere than its loads bend it, so the shape is no answer",
    "one way": "the sand never felt the pattern give way",
    "cycles": "the loop itself shakes the sand, so the shape is no answer",
    "diverged": "the shape means nothing",
}
_STEPPED: dict[State, str] = {
    "holds": "the pattern moved with the grains and is where their loads bend it",
    "lags": "the pattern still swings about where its loads bend it, so the shape is not at rest",
}
"""What other words are needed for of a pattern that is stepped with the grains."""
_VERBS: dict[State, str] = {
    "holds": "holds", "lags": "lags", "one way": "is one way", "cycles": "goes in cycles",
    "diverged": "diverged",
}  # fmt: skip


@dataclass(frozen=True)
class LoopVerdict:
    """What the last part of a convergence log says."""

    state: State
    residual_fraction: float
    """Median of residual over displacement, infinite where the surface never moved; NaN without
    residuals. Of a log without them that has kinetic energies it is the amplitude of the motion
    that these are of, sqrt(2 T / U): a swing of a share a about rest has T = a^2 U / 2 in the mean.
    """
    spikes: int
    """Windows whose residual is larger than the displacement."""
    made_j: float
    """Energy of the shape at the interface in the end less the work of the sand that contact with
    floor, walls and obstacles left it; above 0 the loop itself gave it."""
    stored_j: float
    """Median of the elastic energy."""
    last_s: float
    """Length of the last part."""
    stepped: bool = False
    """Whether the pattern was stepped with the grains: its residual is a swing, no delay."""

    @property
    def error_fraction(self) -> float:
        """How far the shape may be off, over its displacement; infinite where nothing tells.

        The residual, or as far as the energy that the loop itself made would bend the pattern:
        energy goes with the square of the displacement.
        """
        if self.state == "diverged":
            return np.inf
        share = self.made_j / self.stored_j if self.stored_j > 0.0 else 0.0
        bent = float(np.sqrt(share)) if share > MADE_SHARE else 0.0
        return bent if np.isnan(self.residual_fraction) else max(self.residual_fraction, bent)

    @property
    def meaning(self) -> str:
        """What the state means of such a scheme."""
        return _STEPPED.get(self.state, _MEANS[self.state]) if self.stepped else _MEANS[self.state]

    @property
    def sentence(self) -> str:
        """The verdict with its reasons."""
        reasons = []
        if self.state == "one way":
            return f"One way: {self.meaning}."
        if np.isinf(self.residual_fraction):
            reasons.append("loads and no motion of the surface")
        elif not np.isnan(self.residual_fraction):
            what = "a swing" if self.stepped else "a residual"
            reasons.append(f"{what} of {100 * self.residual_fraction:.0f} % of the displacement")
        if self.spikes:
            reasons.append(f"{self.spikes} windows whose residual is above the displacement")
        if self.made_j > MADE_SHARE * self.stored_j:
            reasons.append(
                f"{self.made_j:.2g} J that no sand gave beside {self.stored_j:.2g} J in the foam"
            )
        because = f"; in the last {self.last_s:.2g} s {', '.join(reasons)}" if reasons else ""
        return f"{self.state.capitalize()}: {self.meaning}{because}."


def classify_loop(log: pd.DataFrame, stopped: bool = False) -> LoopVerdict | None:
    """Classify the end of a convergence log; None where no sand pressed and it was not stopped.

    Energy of the shape at the interface above the work of the sand was never given by sand: such
    a loop goes in cycles, which shake the sand. It diverged where the median residual is above the
    displacement too, or where it was stopped for that or has values that are not finite. Work above
    the stored energy is only lost in the loop's delay, as in a dashpot: such a loop lags while its
    residual is large, and it holds where that is small in the median and in no window above the
    displacement. A loop that lags at the end of a run is no answer at rest either: sand can be at
    rest on a surface that is not where its loads bend the pattern.

    ``log``: of any scheme; rows in order of time. Without ``residual_m`` it has no windows: the
    pattern was stepped with the grains. ``stopped``: whether the run ended because its pattern ran
    away.
    """
    if log.empty or not log["load_n"].any():
        return LoopVerdict("diverged", np.nan, 0, np.nan, np.nan, 0.0) if stopped else None
    start_s, end_s = log["time_s"].iloc[[0, -1]]
    last_s = LAST_SHARE * float(end_s - start_s)
    last = log[log["time_s"] >= end_s - last_s]
    stored = at_interface = stored_energy_j(last)
    residual, spikes = np.nan, 0
    if "residual_m" in log:
        # Before the first move there is nothing that a residual could be a share of.
        shares = last["residual_m"] / last["displacement_m"].where(last["displacement_m"] > 0.0)
        residual, spikes = float(shares.median()), int((shares > 1.0).sum())
        if not last["displacement_m"].any() and last["residual_m"].any():
            residual = np.inf
        # The log has the energy of the solution, which a slow loop is far from: the shape at the
        # interface stores at least as much less as if both had one form.
        at_interface = stored / (1.0 + shares) ** 2
    elif "kinetic_j" in log and stored.any():
        residual = float(np.sqrt(2.0 * last["kinetic_j"].mean() / stored.mean()))
    stored_j = float(stored.median())
    given = last["work_j"] - last["contact_j"] if "contact_j" in last else last["work_j"]
    made_j = float(at_interface.median()) - float(given.median())
    state: State = "holds"
    is_fed = made_j > MADE_SHARE * stored_j
    if stopped or not np.isfinite(last[["displacement_m", "work_j"]]).to_numpy().all():
        state = "diverged"
    elif "factor" in log and not log["factor"].any():
        state = "one way"
    elif is_fed:
        state = "diverged" if residual > 1.0 else "cycles"
    elif residual > RESIDUAL_SHARE or spikes:
        state = "lags"
    stepped = "kinetic_j" in log
    return LoopVerdict(state, residual, spikes, made_j, stored_j, last_s, stepped)


def stored_energy_j(log: pd.DataFrame) -> pd.Series[float]:
    """Elastic energy in the convergence log of any scheme."""
    return log["energy_j" if "energy_j" in log else "elastic_j"]


def study_sentence(verdicts: Sequence[LoopVerdict]) -> str:
    """How many runs of a study hold, and what the others do."""
    states = [v.state for v in verdicts]
    if not states:
        return "No run has a convergence log that tells of its loop."
    count = f"all {len(states)} runs" if len(states) > 1 else "the one run"
    if len(set(states)) == 1:
        sentence = f"The loop {_VERBS[states[0]]} in {count}"
    else:
        counts = ", ".join(f"{_VERBS[s]} in {states.count(s)}" for s in _VERBS if s in states)
        sentence = f"The loop {counts} of {len(states)} runs"
    rest = "" if set(states) == {"holds"} else ": only where it holds is a shape an answer"
    return f"{sentence}{rest}."
