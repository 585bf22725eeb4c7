"""The law as a map that the plan of a study reads: config/fill_map.yaml."""

from __future__ import annotations

import numpy as np
import pandas as pd

from benchmarks.frequency_law import groups

POINTS = 20
"""Along either axis, evenly over the logarithms of what the records have."""


def map_text(settings: pd.DataFrame, error: float) -> str:
    """Tabulate the law over the groups of ``MAP``, empty where no record is near.

    Parameters
    ----------
    settings : DataFrame
        What the law is fitted to.
    error : float
        Of fill, where curves are foretold by the others.
    """
    axes = {name: _points(settings[name]) for name in groups.MAP}
    law = groups.FillLaw(settings, groups.MAP)
    rows = []
    for velocity in axes["over_fall"]:
        low, high = groups.shaken_range(settings, velocity, "over_fall")
        asked = pd.DataFrame({"over_fall": velocity, "in_modes": axes["in_modes"]})
        near = asked["in_modes"].between(low / groups.NEAR, high * groups.NEAR)
        fill = np.where(near, law.at(asked), np.nan)
        rows.append(", ".join(".nan" if np.isnan(x) else f"{x:.3f}" for x in fill))
    lines = [
        "# Fill of the tube over two numbers, docs/frequency_law.md. Written by",
        "# python -m benchmarks.frequency_law; do not edit.",
        f"error: {error:.3f}  # root mean square where a curve is foretold by the others",
        "range: {tube_width_m: [0.016, 0.036], bed_depth_m: [0.08, 0.34], "
        "wave_speed_m_s: [60, 260], size_scale: [4, 6], duration_s: [1.5, 3]}"
        "  # of the records; times between which the top stays, tube_law_screen",
        *(f"{name}: [{', '.join(f'{x:.4g}' for x in points)}]" for name, points in axes.items()),
        "fill:  # a row a velocity",
        *(f"  - [{row}]" for row in rows),
    ]
    return "\n".join(lines) + "\n"


def _points(values: pd.Series[float]) -> np.ndarray:
    return np.geomspace(values.min(), values.max(), POINTS)
