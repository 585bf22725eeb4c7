"""What the size of the model's grains does, in words."""

from __future__ import annotations

from collections.abc import Sequence

from sandmould.runs.templates import sentences
from sandmould.statistics.grain_change import GrainChange, order_of
from sandmould.statistics.grain_check import FACTOR


def grain_sentences(
    changes: Sequence[GrainChange],
    beside: Sequence[GrainChange],
    better: str,
    narrow: Sequence[str],
    is_short: bool,
) -> tuple[str, ...]:
    """Say what coarser grains change, what finer ones should give, and what is not known.

    Parameters
    ----------
    changes : sequence of GrainChange
        Of the objective, at the best setting and, where it was computed, at the next; not empty.
    beside : sequence of GrainChange
        Of what else is judged, at the best setting.
    narrow : sequence of str
        Tubes and cavities that fewer than five of the largest grains fit across.
    is_short : bool
        Whether the change is told of the best setting alone.
    """
    return sentences(
        "grain_size.j2",
        changes=changes,
        shown=[*(changes[:1] if is_short else changes), *beside],
        factor=f"{FACTOR:g}",
        two=len(changes) > 1,
        order=order_of(changes[0], changes[1], better) if len(changes) > 1 else "",
        narrow=narrow,
    )
