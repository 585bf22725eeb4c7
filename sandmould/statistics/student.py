"""Student's distribution, from a library that a third of a second is waited for: when asked."""

from __future__ import annotations

from typing import Any


def stdtr(freedom: Any, value: Any) -> Any:
    """Probability of less than a value, of as many degrees of freedom."""
    from scipy import special

    return special.stdtr(freedom, value)


def stdtrit(freedom: Any, probability: Any) -> Any:
    """Value that a probability lies below, of as many degrees of freedom."""
    from scipy import special

    return special.stdtrit(freedom, probability)
