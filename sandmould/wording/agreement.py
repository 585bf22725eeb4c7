"""Whether settings that should agree do, in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from sandmould.runs.formatting import listed, name_of
from sandmould.runs.templates import sentences
from sandmould.statistics.agreement import Compared
from sandmould.statistics.equivalence import PERCENT

MOST_NAMED = 2
"""Compared pairs that a sentence names; of more it counts them."""


def agreement_sentences(compared: Sequence[Compared]) -> tuple[str, ...]:
    """Say first whether all agree, then what does not."""
    by_verdict = {
        verdict: _named([c for c in compared if c.agreement.verdict == verdict], compared)
        for verdict in ("different", "not resolved", "not tested")
    }
    agreeing = sum(c.agreement.verdict == "equivalent" for c in compared)
    return sentences(
        "agreement.j2",
        total=len(compared),
        agreeing=agreeing,
        percent=PERCENT,
        different=by_verdict["different"],
        open=by_verdict["not resolved"],
        untested=by_verdict["not tested"],
    )


def _named(compared: Sequence[Compared], every: Sequence[Compared]) -> str:
    """Measures with the pairs they were compared for; more than two pairs are counted."""
    of = Counter(c.measure for c in every)
    parts = []
    for measure, count in Counter(c.measure for c in compared).items():
        pairs = [
            f"{c.first} – {c.second}{f' at {c.at}' if c.at else ''}"
            for c in compared
            if c.measure == measure
        ]
        few = len(compared) <= MOST_NAMED
        said = listed(pairs) if few else f"{count} of {of[measure]} pairs"
        parts.append(f"{name_of(measure)} ({said})")
    return listed(parts)
