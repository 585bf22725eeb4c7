"""The best setting and its rival once more with coarser grains: what their size does."""

from __future__ import annotations

from sandmould.scenario.quantity import Section, quantity
from sandmould.scenario.sand import ARGUED

FACTOR = 1.5
"""Size of the coarser grains over those of the study."""
FEWEST = 3
"""Replicates below which the scatter hides what the size of grains does."""


class GrainCheck(Section):
    """Runs with coarser grains, once the best setting is known."""

    price_share: float = quantity(
        0.2,
        "The best setting and the next best are computed again with grains 1.5 times as large, "
        "which tells what the size of the grains does. This is the most that these runs may take "
        "of the price of the sweep; 0: none. There are none either with fewer than three "
        "replicates, for grains of real size, or where nothing is to be best.",
        source=ARGUED,
        ge=0,
        le=1,
    )
