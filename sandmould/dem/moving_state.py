"""All that the step loop moves as named arrays, and back: what a checkpoint keeps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from sandmould.dem.broad_phase import Candidates
from sandmould.dem.chunks import chunk_bounds
from sandmould.dem.contact_law import Law
from sandmould.dem.grains import Grains
from sandmould.dem.kinds import pair_up
from sandmould.dem.near_pairs import Contacts, contacts_of, new_near_pairs
from sandmould.dem.neighbours import Pairs
from sandmould.dem.steps import Moving, new_walls
from sandmould.dem.surfaces import SurfaceArrays
from sandmould.dem.vectors import dim_of
from sandmould.dem.wall_history import WallHistory


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
