"""The page: charts, when to take what, and how far the step loop is from the machine's limits."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchmarks.frame import render
from benchmarks.speed_and_accuracy import casting, foam, grains
from benchmarks.speed_and_accuracy.grains import results_of
from benchmarks.speed_and_accuracy.method import Method

BEDS = ("2 500 discs", "8 000 spheres")


def methods() -> list[Method]:
    """All charts, in the order of the page."""
    of_grains = (grains.engines_and_step, grains.scale_and_springs, grains.dimensions)
    of_foam = (foam.schemes, foam.one_way, casting.heat, casting.flow, foam.calibration)
    return [read() for read in (*of_grains, grains.damping, *of_foam)]


def page(results: Mapping[str, Any]) -> str:
    """Write the page.

    Parameters
    ----------
    results : mapping
        Trials of layouts.
    """
    limits = results_of("engines")["roofline"]
    values = {
        "charts": {method.name: method for method in methods()},
        "peaks": limits["peaks"],
        "roofline": [bed for bed in limits["beds"] if bed["bed"] in BEDS],
        "of_loop": results_of("core_loop")["beds"],
    }
    return render(Path(__file__).with_name("page.md.j2"), {**results, **values})
