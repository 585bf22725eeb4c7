"""What the report of a study of flow says and shows of its own."""

from __future__ import annotations

from sandmould.casting.mps.scene import scheme_of
from sandmould.drawing.figure_files import numbered, pictures
from sandmould.report.flow import flow_method, flow_pages
from sandmould.report.kinds.kind import Findings, KindPages, KindReport
from sandmould.scenario.casting.flow import MetalFlow, StillTank
from sandmould.study.collect import Collected


class FlowReport(KindReport[MetalFlow]):
    """See ``KindReport``."""

    def notes(
        self, scenario: MetalFlow, collected: Collected, seeks_best: bool, is_controlled: bool
    ) -> tuple[str, ...]:
        """What the paper leaves open."""
        gradient = (
            "The gradient as printed, eq. (3), points the wrong way and makes every run fail. The "
            f"gradient used here, {scheme_of(scenario).gradient}, is a choice."
        )
        if isinstance(scenario.case, StillTank):
            return (gradient,)
        return (
            gradient,
            "The paper gives neither the particle size in space nor the speed of the stream.",
        )

    def pages(self, findings: Findings[MetalFlow], film_budget_bytes: int) -> KindPages:
        """See ``KindPages``."""
        scenario, of_sweep = findings.scenario, findings.collected.of_sweep
        pages = flow_pages(
            findings.study_folder, scenario, of_sweep, findings.verdict, film_budget_bytes
        )
        return KindPages(
            "flow.html",
            flow_method(scenario, findings.collected.keys),
            "the end of the run",
            {"pages": pages},
            {
                **pictures(stability_map=pages.map, fields=pages.fields),
                **numbered("histories", (history.chart for history in pages.histories)),
            },
            answer=pages.answer,
            grounds=pages.grounds,
            steps=pages.steps,
        )
