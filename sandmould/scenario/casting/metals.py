"""What of a metal is solid at which temperature, by the usual laws."""

from __future__ import annotations

import numpy as np

POINTS = 400
"""Of a law between solidus and liquidus."""


def solid_fractions(
    law: str, solidus_k: float, liquidus_k: float, melting_k: float, partition: float
) -> tuple[tuple[float, float], ...]:
    """Solid fraction over temperature of a binary alloy with a straight liquidus.

    By the lever rule solid and liquid are of one composition each; by Scheil's (Zeitschrift fuer
    Metallkunde 34 (1942) 70-72) nothing diffuses in the solid. What is left at the solidus, that
    of the eutectic, freezes there.

    Parameters
    ----------
    law : str
        ``line``, ``lever`` or ``scheil``.
    solidus_k, liquidus_k : float, K
    melting_k : float, K
        Of the pure metal.
    partition : float
        Solute in the solid over that in the liquid beside it.

    Returns
    -------
    pairs of temperature (K) and fraction; none for a straight line
    """
    if law == "line":
        return ()
    at = np.linspace(solidus_k, liquidus_k, POINTS)
    below = (melting_k - at) / (melting_k - liquidus_k)
    if law == "scheil":
        solid = 1.0 - below ** (1.0 / (partition - 1.0))
    else:
        solid = (1.0 - 1.0 / below) / (1.0 - partition)
    solid = np.clip(solid, 0.0, 1.0)
    solid[-1] = 0.0
    return tuple(zip(at.tolist(), solid.tolist(), strict=True))
