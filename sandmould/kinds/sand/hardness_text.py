"""How hard a bed is, as the plan and the report say it."""

from __future__ import annotations

from sandmould.runs.formatting import listed, number
from sandmould.scenario.hardness import DEEP_OVERLAP, LEAST_KAPPA, Hardness

_NOT_HARD = "Packing, density, angles and fills are not those of hard grains."


def hardness_text(hardness: Hardness) -> str:
    """Figures of a bed before it is filled, without an end stop."""
    return (
        f"kappa {_rounded(hardness.kappa_bed)} (bed), {_rounded(hardness.kappa_walls)} (walls), "
        f"wave speed {_rounded(hardness.wave_speed_m_s)} m/s along a row of grains, c/(4 H) "
        f"{_rounded(hardness.column_hz)} Hz at the planned depth H of "
        f"{_rounded(1e3 * hardness.depth_m)} mm; {_rounded(hardness.pressure_pa)} Pa at the foot"
    )


def hardness_lines(hardness: Hardness) -> list[tuple[str, str]]:
    """The same for the plan: heads and plain sentences, good or not first."""
    said = []
    for name, kappa in (("bed", hardness.kappa_bed), ("walls", hardness.kappa_walls)):
        what = "too soft" if name in hardness.soft else "hard enough"
        text = f"{what}. kappa is {_rounded(kappa)}; from {number(LEAST_KAPPA)} on it is good."
        said.append((f"Hardness of the {name}", text))
    if hardness.soft:
        said.append(("Soft sand", _NOT_HARD))
    text = (
        f"{_rounded(hardness.wave_speed_m_s)} m/s along a row of grains. A bed of the planned "
        f"depth H of {_rounded(1e3 * hardness.depth_m)} mm then swings by itself at about "
        f"{_rounded(hardness.column_hz)} Hz: c/(4 H)."
    )
    return [*said, ("Wave speed c", text)]


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
    return f"Soft sand: {listed(why)}. {_NOT_HARD}"


def _rounded(value: float) -> str:
    return number(float(f"{value:.3g}"))
