"""What the report of a study of a user's deck says and shows of its own."""

from __future__ import annotations

from sandmould.report.kinds.kind import Findings, KindPages, KindReport
from sandmould.report.method import deck_method
from sandmould.report.sureness import scatter_ground
from sandmould.report.time_series import curve_figures, measure_curves, whole_conclusion
from sandmould.scenario.own_deck import OwnDeck
from sandmould.study.collect import Collected


def _notes(
    scenario: OwnDeck, collected: Collected, seeks_best: bool, is_controlled: bool
) -> tuple[str, ...]:
    """Whose deck it is."""
    return ("The deck is the user's own: what it simulates, and how well, it alone says.",)


def _pages(findings: Findings[OwnDeck], film_budget_bytes: int) -> KindPages:
    """See ``KindPages``."""
    scenario, collected = findings.scenario, findings.collected
    # the objective first
    measures = dict.fromkeys([findings.verdict.measure, *scenario.measures])
    curves = measure_curves(collected.of_sweep, findings.verdict, list(measures), whole_conclusion)
    return KindPages(
        "deck.html",
        deck_method(scenario, collected.keys, collected.summary),
        "the end of the deck's log",
        {"curves": curves},
        curve_figures(curves),
        grounds=scatter_ground(findings.verdict, "their seed", findings.study.seeks_best),
    )


REPORT = KindReport(_pages, _notes)
