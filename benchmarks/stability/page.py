"""The pages on stability."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.frame import render
from benchmarks.stability.runs import BLOWS_UP

TITLES = {
    "contact": "one grain on the floor",
    "column": "column of {grains} grains",
    "bed": "settled bed of {grains} discs",
}
ENGINE_TITLES = {"reference": "reference", "lammps": "LAMMPS", "liggghts": "LIGGGHTS"}


def of_one_mode(damping_ratio: Any) -> Any:
    """Eq. (42) over eq. (41)."""
    return np.sqrt(1 + np.square(damping_ratio)) - damping_ratio


def _largest_error(results: dict[str, Any]) -> float:
    """Largest deviation of a measured limit from the exact one, relative."""
    return max(
        abs(row["largest_stable_over_critical"] * scene["critical_s"] / limits["whole_s"] - 1)
        for scene in results["scenes"].values()
        for rows in scene["maps"].values()
        for limits, row in zip(scene["limits"], rows, strict=True)
    )


def _first_blow_up(results: dict[str, Any], scene: str) -> str:
    """Smallest step that blew up over the exact limit, over all engines and damping ratios."""
    of_scene = results["scenes"][scene]
    ratios = [
        x / (limits["whole_s"] / of_scene["critical_s"])
        for rows in of_scene["maps"].values()
        for limits, row in zip(of_scene["limits"], rows, strict=True)
        for x, outcome in zip(results["steps_over_critical"], row["outcomes"], strict=True)
        if outcome == BLOWS_UP
    ]
    return f"{min(ratios):.2f}" if ratios else "none"


def _agreement(results: dict[str, Any]) -> list[bool]:
    """Whether an outcome is the same on all engines, point by point."""
    return [
        len({row["outcomes"][k] for row in rows}) == 1
        for scene in results["scenes"].values()
        for rows in zip(*scene["maps"].values(), strict=True)
        for k in range(len(results["steps_over_critical"]))
    ]


def page(results: dict[str, Any]) -> str:
    """Write the page.

    Parameters
    ----------
    results : dict
        What ``benchmarks.stability`` measured.
    """
    scenes = {
        name: scene | {"title": TITLES[name].format(grains=scene["grains"])}
        for name, scene in results["scenes"].items()
    }
    limits = scenes["bed"]["limits"]
    return render(Path(__file__).with_name("page.md.j2"), {
        **results,
        "scenes": scenes,
        "titles": ENGINE_TITLES,
        "of_one_mode": of_one_mode,
        "largest_error": _largest_error(results),
        "agreement": _agreement(results),
        "known_within": max(
            row["known_within"]
            for scene in scenes.values()
            for rows in scene["maps"].values()
            for row in rows
        ),
        "blow_up": {scene: _first_blow_up(results, scene) for scene in scenes},
        "one_contact": [
            step_s / row["whole_s"]
            for step_s, row in zip(results["bed_one_contact_s"], limits, strict=True)
        ],
        "planned": [row["planned_s"] / row["whole_s"] for row in limits],
        "grain": [row["grain_s"] / row["whole_s"] for row in limits],
    })  # fmt: skip


def longer_steps(results: dict[str, Any]) -> str:
    """Write the page on what makes a step longer.

    Parameters
    ----------
    results : dict
        What ``benchmarks.stability`` measured.
    """
    return render(Path(__file__).with_name("longer_steps.md.j2"), results)
