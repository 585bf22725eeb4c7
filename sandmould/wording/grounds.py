"""How sure an answer is, in a few lines: scatter, wave speed, what the table holds, grains."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from sandmould.definition.certificate import frequency_key
from sandmould.definition.study import Study
from sandmould.kinds.sand.narrow import narrow_spaces, thin_walls
from sandmould.kinds.sand.table_motion import throws_no_sand
from sandmould.runs.formatting import display_number, number
from sandmould.runs.templates import Note, notes
from sandmould.scenario.hardness import bed_hardness
from sandmould.scenario.scenario import Scenario
from sandmould.statistics.verdict import Verdict


def scatter_grounds(verdict: Verdict, differ_in: str, seeks_best: bool) -> tuple[Note, ...]:
    """Say how much replicates differ; ``differ_in``: what those of a setting do not share."""
    used = [s for s in verdict.settings if s.n]
    as_share = verdict.is_wide
    sds = [s.sd / (s.mean if as_share else 1.0) for s in used if math.isfinite(s.sd)]
    sd = math.sqrt(sum(x * x for x in sds) / len(sds)) if sds else math.nan
    sd_text = f"{number(100 * sd, 2)} %" if as_share else display_number(verdict.measure, sd, 2)
    first = verdict.comparisons[0] if verdict.comparisons and seeks_best else None
    return notes(
        "scatter.j2",
        verdict=verdict,
        runs=[s.n for s in used],
        differ_in=differ_in,
        sd=sd_text if sds else "",
        unlike=verdict.spread is not None and verdict.spread.are_unlike,
        first=first if first and first.tested and verdict.best else None,
    )


def sand_grounds(
    scenario: Scenario,
    study: Study,
    verdict: Verdict,
    by_setting: Mapping[str, Scenario],
    of_grains: Sequence[str] = (),
) -> tuple[Note, ...]:
    """Say how sure the answer of a study of sand is.

    ``of_grains``: what runs with coarser grains say; empty where there are none.
    """
    vibrations = scenario.vibrations
    return scatter_grounds(verdict, "random fillings", study.seeks_best) + notes(
        "sand_grounds.j2",
        of_frequency=study.seeks_best and frequency_key(study.sweep),
        hardness=bed_hardness(scenario),
        sand=study.certificate.sand_wave_speed,
        hold=vibrations[0].hold if vibrations else "",
        narrow=narrow_spaces(scenario),
        walls=thin_walls(scenario),
        beddings_n_m3=sorted(
            {
                bedding_n_m3
                for each in (scenario, *by_setting.values())
                if each.pattern and (bedding_n_m3 := each.pattern.supports.bedding_n_m3)
            }
        ),
        scale=scenario.sand.size_scale,
        of_grains=of_grains,
        weak=[label for label, each in by_setting.items() if throws_no_sand(each)],
    )
