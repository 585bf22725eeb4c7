"""All that the step loop moves as named arrays, and back: what a checkpoint keeps.

Chunks are grains stored one after the other, which one thread computes. A chunk writes to its own
grains alone: results do not depend on how threads are scheduled, nor on their number. What a
contact law makes of two kinds of grain, roots and quotients of their sizes, is what a contact costs
most, and the same in every step: it is found once for each two kinds.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from sandmould.compiled import njit
from sandmould.dem.broad_phase import Candidates
from sandmould.dem.contact_law import Law, pair_coefficients
from sandmould.dem.grains import Floats, Grains, Ints
from sandmould.dem.near_pairs import Contacts, contacts_of, new_near_pairs
from sandmould.dem.neighbours import Pairs
from sandmould.dem.steps import Moving, new_walls
from sandmould.dem.surfaces import SurfaceArrays
from sandmould.dem.vectors import OPTIONS, dim_of
from sandmould.dem.wall_history import WallHistory

CHUNK = 4096
"""Grains of a chunk."""


@njit(**OPTIONS)
def _pair_up(radius: Floats, mass: Floats, law: Law, coefficients: Floats) -> None:
    for i in range(len(radius)):
        for j in range(len(radius)):
            r_i, r_j, m_i, m_j = radius[i], radius[j], mass[i], mass[j]
            of_two = pair_coefficients(
                law, m_i * m_j / (m_i + m_j), min(r_i, r_j), r_i * r_j / (r_i + r_j)
            )
            # One by one: a row at once takes three seconds longer to compile.
            for k in range(len(of_two)):
                coefficients[i, j, k] = of_two[k]


def pair_up(grains: Grains, law: Law) -> Floats:
    """What each two of k kinds make of each other, (k, k, 3) float64.

    The fields of ``PairCoefficients``.
    """
    kinds = len(grains.radius_of)
    coefficients = np.zeros((kinds, kinds, 3))
    _pair_up(grains.radius_of, grains.mass_of, law, coefficients)
    return coefficients


def chunk_bounds(grains: int) -> Ints:
    """Split grains into chunks of about ``CHUNK``; how many depends on the scene alone.

    Their number is even, so that two threads share them evenly.

    Gives (c + 1,) int64; first grain of each chunk.
    """
    chunks = max(1, 2 * round(grains / (2 * CHUNK)))
    return np.linspace(0, grains, chunks + 1).astype(np.int64)


def to_arrays(moving: Moving) -> dict[str, np.ndarray]:
    """Arrays from which ``from_arrays`` goes on bit for bit; loads are left out."""
    walls, dim = moving.walls, dim_of(moving.grains.position.shape[1])
    parts: dict[str, Any] = {
        "grains": moving.grains,
        "pairs": moving.pairs,
        "contacts": contacts_of(dim, moving.bound, moving.grains, moving.near),
        "candidates": walls.candidates,
        "history": walls.history,
        "surfaces": walls.arrays,
    }
    arrays = {
        f"{name}_{field}": array
        for name, part in parts.items()
        for field, array in part._asdict().items()
    }
    return arrays | {
        "orientation": moving.orientation,
        "listed": moving.listed,
        "reach": moving.reach,
        "listed_vertices": walls.listed,
    }


def from_arrays(
    arrays: Mapping[str, np.ndarray], grain_law: Law, lanes: tuple[float, ...]
) -> Moving:
    """What ``to_arrays`` kept, with no loads collected yet."""

    def part(kind: Any, name: str) -> Any:
        return kind(*(arrays[f"{name}_{field}"] for field in kind._fields))

    grains, pairs = part(Grains, "grains"), part(Pairs, "pairs")
    bound = chunk_bounds(len(grains.id))
    dim = dim_of(grains.position.shape[1])
    near = new_near_pairs(dim, len(lanes), bound, grains, pairs, part(Contacts, "contacts"), 0.0)
    walls = new_walls(
        part(SurfaceArrays, "surfaces"),
        bound,
        part(Candidates, "candidates"),
        part(WallHistory, "history"),
    )
    return Moving(
        grains,
        np.empty_like(grains.position),
        pair_up(grains, grain_law),
        pairs,
        near,
        lanes,
        bound,
        walls._replace(listed=arrays["listed_vertices"]),
        arrays["orientation"],
        arrays["listed"],
        arrays["reach"],
    )
