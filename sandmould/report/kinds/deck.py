"""What the report of a study of a user's deck says and shows of its own."""

from __future__ import annotations

from sandmould.kinds.deck.own.computation import WENT_ON
from sandmould.report.curves import curve_figures, measure_curves
from sandmould.report.kinds.kind import Findings, KindPages, KindReport
from sandmould.report.method import deck_method
from sandmould.runs.columns import DETAIL
from sandmould.scenario.own_deck import OwnDeck
from sandmould.study.collect import Collected
from sandmould.wording.grounds import scatter_grounds


def _notes(
    scenario: OwnDeck, collected: Collected, seeks_best: bool, is_controlled: bool
) -> tuple[str, ...]:
    """Whose deck it is, and how many runs were killed and went on."""
    said = "The deck is the user's own: what it simulates, and how well, it alone says."
    went_on = int(collected.summary[DETAIL].astype(str).str.contains(WENT_ON).sum())
    resumed = f"Runs gone on with from a restart file after a kill: {went_on}."
    return (said, resumed) if went_on else (said,)


def _pages(findings: Findings[OwnDeck], film_budget_bytes: int) -> KindPages:
    """See ``KindPages``."""
    scenario, collected = findings.scenario, findings.collected
    # the objective first
    measures = dict.fromkeys([findings.verdict.measure, *scenario.measures])
    curves = measure_curves(collected.of_sweep, findings.verdict, list(measures))
    return KindPages(
        "deck.html",
        deck_method(scenario, collected.keys, collected.summary),
        "the end of the deck's log",
        {"curves": curves},
        curve_figures(curves),
        grounds=scatter_grounds(findings.verdict, "seeds", findings.study.seeks_best),
    )


REPORT = KindReport(_pages, _notes)
