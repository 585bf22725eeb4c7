"""Where a step of the reference solver spends its time, part by part on a settled bed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.engines.timing import interleaved, seconds, spread
from sandmould.compiled import njit
from sandmould.dem.near_pairs import contacts_of, new_near_pairs
from sandmould.dem.neighbours import Pairs
from sandmould.dem.pairs import pass_pairs
from sandmould.dem.solver import Solver
from sandmould.dem.steps import DemScene, Moving, step_chunk
from sandmould.dem.vectors import OPTIONS, dim_of, no_vector

PARTS = ("pairs", "surfaces", "way")
"""Parts of a step in their order."""


@njit(**OPTIONS)
def _part_of_steps(dim: Any, parts: int, times: int, scene: DemScene, moving: Moving) -> None:
    """Do the first parts of a step over and over, chunk by chunk as the step loop does.

    Nothing moves: the next places are written beside those of now.
    """
    grains, ahead, none = moving.grains, moving.ahead, no_vector(dim)
    for _ in range(times):
        for c in range(len(moving.bound) - 1):
            if parts > 1:
                step_chunk(
                    dim, c, scene, moving, grains, ahead, none, none, scene.gravity, scene.dt,
                    parts > 2,
                )  # fmt: skip
            else:
                pass_pairs(
                    dim, moving.lanes, c, grains, ahead, moving.coefficients, moving.near,
                    scene.grain_law, scene.damping, scene.gravity, scene.dt, False,
                )  # fmt: skip


def _with_near(moving: Moving, chosen: np.ndarray, gap_m: float) -> Moving:
    """Choose the near pairs among some of the listed ones."""
    grains, pairs = moving.grains, moving.pairs
    counted = np.concatenate([[0], np.cumsum(chosen)])[pairs.start]
    some = Pairs(counted.astype(np.uint32), pairs.other[chosen])
    dim, width = dim_of(grains.position.shape[1]), len(moving.lanes)
    contacts = contacts_of(dim, moving.bound, grains, moving.near)
    near = new_near_pairs(dim, width, moving.bound, grains, some, contacts, gap_m)
    return moving._replace(near=near)


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
    cache as it does in the step loop. What the whole list takes beyond lists of the touching pairs
    alone and of the others alone is the price of their sharing rows.

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
    grains, pairs, gap_m = moving.grains, moving.pairs, 2.0 * float(moving.near.left[0])
    first = np.repeat(np.arange(len(grains.id)), np.diff(pairs.start))
    apart_m = np.linalg.norm(grains.position[pairs.other] - grains.position[first], axis=1)
    touching = apart_m < grains.radius[pairs.other] + grains.radius[first]
    blocks = {
        name: _block(solver, moving, i + 1, block_s) for i, name in enumerate(PARTS)
    } | {
        "touching": _block(solver, _with_near(moving, touching, gap_m), 1, block_s),
        "apart": _block(solver, _with_near(moving, ~touching, gap_m), 1, block_s),
        "no pairs": _block(solver, _with_near(moving, np.zeros_like(touching), gap_m), 1, block_s),
    }  # fmt: skip
    times = interleaved(blocks | {"step": step}, rounds)
    sums = np.array([times[name] for name in (*PARTS, "step")])
    parts = np.diff(sums, axis=0, prepend=0.0)
    touch, apart, bare = (np.array(times[name]) for name in ("touching", "apart", "no pairs"))
    within = {
        "the loop over grains": bare,
        "pairs apart": apart - bare,
        "contacts": touch - bare,
        "mixed rows": parts[0] - touch - apart + bare,
    }
    names = (*PARTS, "rest")
    return {
        "ns_per_grain_step": spread(times["step"]),
        "parts": {name: spread(part) for name, part in zip(names, parts.tolist(), strict=True)},
        "within_pairs": {name: spread(part.tolist()) for name, part in within.items()},
    }
