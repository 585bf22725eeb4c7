"""Where a step of the reference solver spends its time, part by part on a settled bed."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np

from benchmarks.engines.timing import interleaved, seconds, spread
from sandmould.compiled import njit
from sandmould.dem.motion import drift, kick
from sandmould.dem.pairs import gather_incoming, pair_forces
from sandmould.dem.solver import Solver
from sandmould.dem.steps import DemScene, Moving
from sandmould.dem.surface_contacts import surface_forces
from sandmould.dem.vectors import OPTIONS, dim_of, no_vector

PARTS = ("pairs", "surfaces", "gather", "kick", "drift")
"""Parts of a step in their order."""


@njit(**OPTIONS)
def _part_of_steps(dim: Any, parts: int, times: int, scene: DemScene, moving: Moving) -> None:
    """Do the first parts of a step over and over, chunk by chunk as the step loop does.

    Nothing moves: the kick and the drift last for no time, and cost what they always cost.
    """
    grains, walls, bound = moving.grains, moving.walls, moving.bound
    for _ in range(times):
        for c in range(len(bound) - 1):
            first, last = bound[c], bound[c + 1]
            pair_forces(
                dim, c, bound, grains, moving.coefficients, moving.near, scene.grain_law, scene.dt
            )
            if parts > 1:
                surface_forces(
                    dim, walls.first_row[c], walls.first_row[c + 1], walls.candidates,
                    grains.position, grains.velocity, grains.spin, grains.kind,
                    grains.radius_of, grains.mass_of,
                    grains.force, grains.moment, walls.arrays, no_vector(dim), no_vector(dim),
                    scene.wall_law, scene.dt, True, walls.history, walls.loads[c],
                    walls.travel[0], walls.due,
                )  # fmt: skip
            if parts > 2:
                gather_incoming(dim, c, moving.near, grains)
            if parts > 3:
                kick(dim, first, last, grains, scene.gravity, scene.damping, 0.0)
            if parts > 4:
                drift(dim, first, last, grains, 0.0)


def _with_near(moving: Moving, chosen: np.ndarray) -> Moving:
    """Keep some of the near pairs of grains; those of a chunk move up to its front."""
    near, bound = moving.near, moving.bound
    rows = {
        name: getattr(near, name).copy() for name in ("other", "touching", "friction", "rolling")
    }
    stop = near.stop.copy()
    for first, (begin, end) in zip(near.first, pairwise(bound), strict=False):
        before = np.concatenate([[0], np.cumsum(chosen[first : near.stop[end - 1]])])
        stop[begin:end] = first + before[near.stop[begin:end] - first]
        kept = first + np.flatnonzero(chosen[first : near.stop[end - 1]])
        for array in rows.values():
            array[first : first + len(kept)] = array[kept]
    return moving._replace(near=near._replace(stop=stop, **rows))


def _block(solver: Solver, moving: Moving, parts: int, block_s: float) -> Callable[[], float]:
    """Give a block whose value is ns per grain and repetition of the first parts."""
    dim, scene, n = dim_of(solver.dimension), solver.scene, len(solver.grains.id)

    def work(times: int) -> float:
        return seconds(lambda: _part_of_steps(dim, parts, times, scene, moving))

    work(1)
    times = max(1, round(block_s / work(10) * 10))
    return lambda: 1e9 * work(times) / (n * times)


def measure_phases(
    solver: Solver, step: Callable[[], float], rounds: int, block_s: float
) -> dict[str, Any]:
    """Time of each part of a step, and what makes up the one of the pairs; spoils the state.

    Each part is the difference of a step with it and a step without it, so that it finds the
    cache as it does in the step loop. Lists of the touching pairs alone and of the others alone
    have no branch to be guessed: what the whole list takes beyond both is the price of guessing.

    Parameters
    ----------
    solver : Solver
    step : callable
        Block of whole steps on another solver with the same bed, ns per grain-step.
    rounds : int
    block_s : float

    Returns
    -------
    dict
        Spreads in ns per grain-step.
    """
    moving = solver.moving  # what the step loop itself is given
    moving.near.gap[0] = -1.0  # no look is due
    touching = moving.near.touching.astype(bool)
    blocks = {
        name: _block(solver, moving, i + 1, block_s) for i, name in enumerate(PARTS)
    } | {
        "touching": _block(solver, _with_near(moving, touching), 1, block_s),
        "apart": _block(solver, _with_near(moving, ~touching), 1, block_s),
        "no pairs": _block(solver, _with_near(moving, np.zeros_like(touching)), 1, block_s),
    }  # fmt: skip
    times = interleaved(blocks | {"step": step}, rounds)
    sums = np.array([times[name] for name in (*PARTS, "step")])
    parts = np.diff(sums, axis=0, prepend=0.0)
    touch, apart, bare = (np.array(times[name]) for name in ("touching", "apart", "no pairs"))
    within = {
        "the loop over grains": bare,
        "pairs apart": apart - bare,
        "contacts": touch - bare,
        "guessing which": parts[0] - touch - apart + bare,
    }
    names = (*PARTS, "rest")
    return {
        "ns_per_grain_step": spread(times["step"]),
        "parts": {name: spread(part) for name, part in zip(names, parts.tolist(), strict=True)},
        "within_pairs": {name: spread(part.tolist()) for name, part in within.items()},
    }


def measure_listing(solver: Solver, rounds: int) -> dict[str, float]:
    """Time of one listing of near pairs and near surfaces, ns per grain."""
    nowhere = np.zeros(solver.dimension)
    n = len(solver.grains.id)
    return spread([1e9 * seconds(lambda: solver._list(nowhere)) / n for _ in range(rounds)])
