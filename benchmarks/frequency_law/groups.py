"""Which properties of the shaking the fill goes with, over all curves of the law at once.

A curve is predicted from the other curves alone: were the fill a function of some groups, curves of
other springs, depths and holds would predict it.
"""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from benchmarks.frequency_law.series import FillCurve
from sandmould.scenario.box import Tube
from sandmould.scenario.vibration import STANDARD_GRAVITY_M_S2

Array = NDArray[np.float64]
GROUPS = {
    "frequency_hz": "frequency f",
    "acceleration_g": "acceleration",
    "velocity_m_s": "velocity",
    "displacement_m": "amplitude",
    "in_modes": "f over c/(4 H)",
}
"""What the fill may go with, as the page calls it. Amplitudes are peaks of the box's motion."""
EXPLANATIONS: dict[str, tuple[str, ...]] = {
    "how long the bed flies in a period: of a body that bounces without rebound it goes with "
    "acceleration alone": ("acceleration_g",),
    "how long the wave of a landing takes through the bed and back, 2 H/c, in periods": (
        "in_modes",
    ),
    "how fast it lands": ("velocity_m_s",),
    "sag of the bed under its weight, g H²/(2 c²), over the amplitude": ("sag_over_amplitude",),
    "strain of a landing, velocity over c, and 2 H/c in periods": ("strain", "in_modes"),
    "velocity over that of a fall through the bed, sqrt(g H), and 2 H/c in periods": (
        "over_fall",
        "in_modes",
    ),
    "velocity, and 2 H/c in periods": ("velocity_m_s", "in_modes"),
}
"""What may move the sand, and the groups that the fill would go with then."""
LAW = ("velocity_m_s", "in_modes")
"""The pair that the page's last part is about."""
DIMENSIONLESS: dict[str, tuple[str, ...]] = {
    "velocity": LAW,
    "velocity over sqrt(g H)": ("over_fall", "in_modes"),
    "velocity over sqrt(g D) of the tube": ("over_tube", "in_modes"),
    "velocity over sqrt(g d) of the grains": ("over_grain", "in_modes"),
}
"""Velocity alone, and made dimensionless by each length of the scene, with the other group."""
MAP = ("over_fall", "in_modes")
"""Those that a plan's map goes with: velocity over that of a fall through the bed instead."""

THROWN_G = 1.0
"""Below it the box never throws the sand, so nothing of the law can hold."""
HELD_G = 0.02
"""Below this standard deviation over a curve the acceleration is held."""
NEAR = 1.3
"""A setting is near a velocity within this factor."""


@dataclass(frozen=True)
class Collapse:
    """How well some groups alone predict the fill of a curve that they were not fitted to."""

    groups: tuple[str, ...]
    error: float
    """Root mean square over all settings."""


@dataclass(frozen=True)
class Regret:
    """What it costs to take the setting that some groups foretell for a curve left out."""

    study: str
    label: str
    range_hz: tuple[float, float]
    regrets: tuple[float, ...]
    """Of each set of groups: fill of the best setting less that of the one foretold."""


@dataclass(frozen=True)
class HeldOut:
    """What the law says of a study that it was not fitted to."""

    settings: pd.DataFrame
    """With ``predicted``, the law's fill."""

    @property
    def whole_error(self) -> float:
        """Root mean square of measured less predicted."""
        return math.hypot(self.shift, self.error)

    @property
    def shift(self) -> float:
        """Mean of measured less predicted."""
        return float((self.settings["fill"] - self.settings["predicted"]).mean())

    @property
    def error(self) -> float:
        """Root mean square of measured less predicted, without the shift."""
        return float((self.settings["fill"] - self.settings["predicted"]).std(ddof=0))

    def best_in_modes(self, column: str) -> float:
        """F over c/(4 H) where ``fill`` or ``predicted`` is largest."""
        return float(self.settings["in_modes"].iloc[int(self.settings[column].argmax())])


def settings_of(series: Sequence[FillCurve]) -> pd.DataFrame:
    """One row a setting.

    Parameters
    ----------
    series : sequence of FillCurve

    Returns
    -------
    DataFrame
        ``curve`` (int), ``study``, ``label``, ``GROUPS``, the groups of ``EXPLANATIONS`` and of
        ``DIMENSIONLESS``, mean ``fill`` and its standard error ``se``. The acceleration is that
        over the scene's own gravity.
    """
    rows: list[pd.DataFrame] = []
    for curve, one in enumerate(series):
        fills, depth_m, speed_m_s = one.fills, one.depth_m, one.wave_speed_m_s
        gravity_m_s2 = one.scenario.gravity_m_s2
        velocity_m_s, amplitude_m = one.drives["velocity_m_s"], one.drives["displacement_m"]
        widths_m = [o.diameter_m for o in one.scenario.obstacles if isinstance(o, Tube)]
        grain_m = one.scenario.sand.mass_median_diameter_m
        rows.append(
            one.drives.assign(
                acceleration_g=one.drives["acceleration_g"] * STANDARD_GRAVITY_M_S2 / gravity_m_s2,
                strain=velocity_m_s / speed_m_s,
                over_fall=velocity_m_s / math.sqrt(gravity_m_s2 * depth_m),
                over_tube=velocity_m_s / math.sqrt(gravity_m_s2 * sum(widths_m or [math.nan])),
                over_grain=velocity_m_s / math.sqrt(gravity_m_s2 * grain_m),
                sag_over_amplitude=gravity_m_s2 * depth_m**2 / (2 * speed_m_s**2) / amplitude_m,
                curve=curve,
                study=one.study,
                label=one.label,
                frequency_hz=fills.columns.to_numpy(dtype=np.float64),
                in_modes=fills.columns.to_numpy(dtype=np.float64) / one.column_hz,
                fill=fills.mean(),
                se=fills.sem(),
            )
        )
    return pd.concat(rows, ignore_index=True)


def thrown(settings: pd.DataFrame) -> pd.DataFrame:
    """Settings whose box throws the sand."""
    return settings[settings["acceleration_g"] > THROWN_G].reset_index(drop=True)


def collapses(settings: pd.DataFrame, names: Sequence[str] = tuple(GROUPS)) -> list[Collapse]:
    """Each of these groups and each pair of them: singles first, then best first."""
    found = [
        Collapse(groups, error_of(settings, groups))
        for number in (1, 2)
        for groups in itertools.combinations(names, number)
    ]
    return sorted(found, key=lambda collapse: (len(collapse.groups), collapse.error))


def error_of(settings: pd.DataFrame, groups: Sequence[str] = LAW) -> float:
    """Root mean square of what other curves predict less what was measured."""
    return float(np.sqrt(np.mean((predicted_by_others(settings, groups) - settings["fill"]) ** 2)))


def predicted_by_others(settings: pd.DataFrame, groups: Sequence[str] = LAW) -> Array:
    """Fill of each setting as all other curves predict it, (n,) float64."""
    predicted = np.empty(len(settings))
    for curve in settings["curve"].unique():
        left_out = (settings["curve"] == curve).to_numpy()
        predicted[left_out] = FillLaw(settings[~left_out], groups).at(settings[left_out])
    return predicted


def regrets(settings: pd.DataFrame, asked: Sequence[Sequence[str]]) -> list[Regret]:
    """Ask sets of groups for the best setting of each curve that holds the acceleration.

    Parameters
    ----------
    settings : DataFrame
        As of ``settings_of``; each curve is left out of the fit in turn.
    asked : sequence of groups
    """
    found = []
    for curve, mine in settings.groupby("curve", sort=False):
        if mine["acceleration_g"].std() > HELD_G:
            continue
        others = settings[settings["curve"] != curve]
        best = [FillLaw(others, names).at(mine).argmax() for names in asked]
        fill, hz = mine["fill"].to_numpy(), mine["frequency_hz"]
        found.append(
            Regret(
                mine["study"].iloc[0],
                mine["label"].iloc[0],
                (float(hz.min()), float(hz.max())),
                tuple(float(fill.max() - fill[each]) for each in best),
            )
        )
    return found


def held_out(settings: pd.DataFrame, others: pd.DataFrame, names: Sequence[str] = LAW) -> HeldOut:
    """Ask the law of ``settings`` for those of another curve, where its box throws the sand."""
    asked = thrown(others)
    return HeldOut(asked.assign(predicted=FillLaw(settings, names).at(asked)))


class FillLaw:
    """A smooth function of the logarithms of some groups: a Gaussian process with noise.

    Parameters
    ----------
    settings : DataFrame
        As of ``settings_of``.
    groups : sequence of str
        Columns of the settings.
    """

    def __init__(self, settings: pd.DataFrame, groups: Sequence[str] = LAW) -> None:
        from sklearn.gaussian_process import GaussianProcessRegressor
        from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

        self._groups = list(groups)
        points = np.log(settings[self._groups].to_numpy(dtype=np.float64))
        self._low, self._span = points.min(axis=0), np.ptp(points, axis=0)
        kernel = ConstantKernel(1.0, (1e-2, 1e3)) * Matern(
            [0.5] * len(self._groups), (0.05, 20.0), nu=2.5
        ) + WhiteKernel(1e-2, (1e-6, 1.0))
        self._process: Any = GaussianProcessRegressor(
            kernel, normalize_y=True, n_restarts_optimizer=0
        )
        with warnings.catch_warnings(), threadpool_limits(1):
            # A length at its bound says that the fill hardly depends on a group.
            warnings.simplefilter("ignore")
            self._process.fit((points - self._low) / self._span, settings["fill"].to_numpy())

    def at(self, settings: pd.DataFrame) -> Array:
        """Fill at settings, (n,) float64."""
        points = np.log(settings[self._groups].to_numpy(dtype=np.float64))
        predicted: Array = self._process.predict((points - self._low) / self._span)
        return predicted


def shaken_range(
    settings: pd.DataFrame, velocity: float, group: str = "velocity_m_s"
) -> tuple[float, float]:
    """Least and greatest f over c/(4 H) of the settings near a velocity."""
    near = np.abs(np.log(settings[group] / velocity)) < np.log(NEAR)
    in_modes = settings.loc[near, "in_modes"]
    return float(in_modes.min()), float(in_modes.max())
