"""What a sweep of the springs' hardness says of grains without overlap."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.special import stdtrit

from sandmould.runs.formatting import name_of, number, unit_of, with_margin
from sandmould.scenario.hardness import bed_hardness
from sandmould.scenario.scenario import Scenario
from sandmould.statistics.hard_limit import extrapolate
from sandmould.statistics.mean_tests import CONFIDENCE
from sandmould.statistics.verdict import Verdict

HARDNESS_KEYS = ("sand.disc_thickness_m", "contact.wave_speed_m_s")
"""Keys that change all springs over their load alike, and nothing else."""
_HAVE_LIMITS = ("solid_fraction", "_density_raw_kg_m3", "_density_corrected_kg_m3", "_angle_deg")
"""Endings of measures that go with the overlaps of grains: packing, density, angles."""


def hard_limit_text(
    verdict: Verdict, keys: Sequence[str], by_setting: Mapping[str, Scenario]
) -> str:
    """Say where a measure goes with 1/kappa; empty for sweeps of anything else.

    Parameters
    ----------
    verdict : Verdict
    keys : sequence of str
        Swept keys.
    by_setting : mapping of label to Scenario
    """
    measure = verdict.measure
    if len(keys) != 1 or keys[0] not in HARDNESS_KEYS or not measure.endswith(_HAVE_LIMITS):
        return ""
    levels = []
    for setting in verdict.settings:
        scenario = by_setting.get(setting.label)
        hardness = bed_hardness(scenario) if scenario is not None else None
        if hardness is not None and setting.n > 1:
            student = float(stdtrit(setting.n - 1, 0.5 + CONFIDENCE / 2))
            levels.append((hardness.kappa_bed, setting.mean, setting.ci_half_width / student))
    kappa, mean, error = np.array(levels, dtype=np.float64).reshape(-1, 3).T
    limit = extrapolate(kappa, mean, error)
    what = f"The limit of the {name_of(measure)} for hard grains, 1/kappa = 0,"
    if limit.why_not:
        return f"{what} cannot be told: {limit.why_not}."
    value = f"{with_margin(limit.value, limit.half_width)} {unit_of(measure)}".rstrip()
    span = f"{number(float(f'{kappa.min():.3g}'))} to {number(float(f'{kappa.max():.3g}'))}"
    levels_text = f"{len(kappa)} levels of kappa, {span}"
    return f"{what} is {value} (95 % interval), by a line through {levels_text}."
