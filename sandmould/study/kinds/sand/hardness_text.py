"""How hard a bed is, as the plan and the report say it."""

from __future__ import annotations

from sandmould.runs.formatting import listed, number
from sandmould.scenario.hardness import DEEP_OVERLAP, LEAST_KAPPA, Hardness


def hardness_text(hardness: Hardness) -> str:
    """Figures of a bed before it is filled, without an end stop."""
    return (
        f"kappa {_rounded(hardness.kappa_bed)} (bed), {_rounded(hardness.kappa_walls)} (walls), "
        f"wave speed {_rounded(hardness.wave_speed_m_s)} m/s along a row of grains, c/(4 H) "
        f"{_rounded(hardness.column_hz)} Hz; {_rounded(hardness.pressure_pa)} Pa at the foot of "
        f"{_rounded(1e3 * hardness.depth_m)} mm of sand"
    )


def softness_warning(hardness: Hardness | None, overlap_fraction: float = 0.0) -> str:
    """Say that a bed is too soft for its packing to count; empty where it is hard.

    Parameters
    ----------
    hardness : Hardness, optional
    overlap_fraction : float
        That 99 of 100 contacts do not exceed, over the radius, as measured; 0 before any run.
    """
    why = []
    if hardness is not None and hardness.soft:
        kappa = {"bed": hardness.kappa_bed, "walls": hardness.kappa_walls}
        why = [f"kappa of the {name} is {_rounded(kappa[name])}" for name in hardness.soft]
        why[-1] += f", where hard grains want {number(LEAST_KAPPA)} or more"
    if overlap_fraction > DEEP_OVERLAP:
        why.append(
            f"one contact in a hundred is deeper than {number(100 * overlap_fraction, 2)} % of a "
            f"radius, where hard grains stay below {number(100 * DEEP_OVERLAP)} %"
        )
    if not why:
        return ""
    of_what = "Packing, density, angles and fills are not those of hard grains."
    return f"Soft sand: {listed(why)}. {of_what}"


def _rounded(value: float) -> str:
    return number(float(f"{value:.3g}"))
