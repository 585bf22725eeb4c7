"""The thinnest wall of a drawing: how far it is through, straight in from its surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sandmould.geometry.geometry import Block
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.outline import Outline
from sandmould.scenario.casting.shapes import Body, Pixels, held_by

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
MOST_PLACES = 20_000
"""Places of the surface that are tried."""
_STEPS = 12
"""Depths tried at each place before the thickness is found between two of them."""
_HALVINGS = 20
_SKIN = 1e-4
"""Share of the thickness asked for by which points beside the surface lie off it."""


@dataclass(frozen=True)
class ThinWall:
    """The thinnest wall, and how much of the surface belongs to thin ones."""

    thickness_m: float
    place_m: Array
    """(d,) float64, m: on its surface."""
    surface_share: float


def thinnest_wall(bodies: Sequence[Body], below_m: float) -> ThinWall | None:
    """Find walls thinner than a limit; None where none is. ``bodies``: parts that touch are one."""
    samples = [_surface(body, below_m) for body in bodies]
    place, normal, area = (np.concatenate(parts) for parts in zip(*samples, strict=True))
    if (every := -(-len(place) // MOST_PLACES)) > 1:
        place, normal, area = place[::every], normal[::every], area[::every]
    skin_m = _SKIN * below_m
    behind, before = _held(bodies, place - skin_m * normal), _held(bodies, place + skin_m * normal)
    # a face between two parts is no surface
    edge = behind != before
    inward = np.where(behind[edge], -1.0, 1.0)[:, None] * normal[edge]
    place, area = place[edge], area[edge]
    if not len(place):
        return None
    depth = below_m * (np.arange(_STEPS) + 1.0) / _STEPS
    points = place[:, None] + depth[:, None] * inward[:, None]
    out = ~_held(bodies, points.reshape(-1, place.shape[1])).reshape(len(place), _STEPS)
    thin = out.any(axis=1)
    if not thin.any():
        return None
    first = out[thin].argmax(axis=1)
    high = depth[first]
    low = np.where(first > 0, high - below_m / _STEPS, skin_m)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        held = _held(bodies, place[thin] + middle[:, None] * inward[thin])
        low, high = np.where(held, middle, low), np.where(held, high, middle)
    least = int(high.argmin())
    share = float(area[thin].sum() / area.sum())
    return ThinWall(float(high[least]), place[thin][least], share)


def _held(bodies: Sequence[Body], position_m: Array) -> Flags:
    held = np.zeros(len(position_m), dtype=np.bool_)
    for body in bodies:
        corners = body.corners()
        near = (position_m >= corners.min(axis=0)) & (position_m <= corners.max(axis=0))
        ask = near.all(axis=1) & ~held
        held[ask] = held_by(body, position_m[ask])
    return held


def _surface(body: Body, spacing_m: float) -> tuple[Array, Array, Array]:
    """Places on a surface, unit normals either way, and the area that each stands for."""
    if isinstance(body, Pixels):
        return _of_pixels(body)
    if isinstance(body, Block):
        facets = body.corners()[body.facets()]
    elif isinstance(body, Outline):
        facets = np.stack([body.vertices_m, np.roll(body.vertices_m, -1, axis=0)], axis=1)
    elif isinstance(body, TriangleMesh):
        facets = body.corners_m
    else:
        raise TypeError(f"{body.name} has no facets")
    return _of_edges(facets, spacing_m) if facets.shape[1] == 2 else _of_faces(facets, spacing_m)


def _of_edges(ends: Array, spacing_m: float) -> tuple[Array, Array, Array]:
    along = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(along, axis=1)
    number = np.clip(np.ceil(2.0 * length / spacing_m), 1, 1000).astype(np.int64)
    edge = np.repeat(np.arange(len(ends)), number)
    within = np.concatenate([(np.arange(n) + 0.5) / n for n in number])
    normal = np.stack([along[:, 1], -along[:, 0]], axis=1) / length[:, None]
    place = ends[edge, 0] + within[:, None] * along[edge]
    return place, normal[edge], (length / number)[edge]


def _of_faces(corners: Array, spacing_m: float) -> tuple[Array, Array, Array]:
    a, b, c = corners.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    area = 0.5 * np.linalg.norm(normal, axis=1)
    normal /= 2.0 * area[:, None]
    longest = np.max([np.linalg.norm(e, axis=1) for e in (b - a, c - b, a - c)], axis=0)
    parts = np.clip(np.ceil(longest / spacing_m), 1, 24).astype(np.int64)
    places, of = [], []
    for n in np.unique(parts):
        some = np.flatnonzero(parts == n)
        # centres of the n^2 like triangles that a triangle splits into
        i, j = np.divmod(np.arange(n * n), n)
        upper = i + j >= n
        u = np.where(upper, n - i - 1.0 / 3.0, i + 1.0 / 3.0) / n
        v = np.where(upper, n - j - 1.0 / 3.0, j + 1.0 / 3.0) / n
        shift = u[:, None] * (b - a)[some, None] + v[:, None] * (c - a)[some, None]
        places.append((a[some, None] + shift).reshape(-1, 3))
        of.append(np.repeat(some, n * n))
    which = np.concatenate(of)
    return np.concatenate(places), normal[which], (area / parts**2)[which]


def _of_pixels(body: Pixels) -> tuple[Array, Array, Array]:
    """Edges of pixels, with the slope of the smoothed picture: a round edge is no staircase."""
    from scipy.ndimage import gaussian_filter

    dark = np.pad(body.distance_in_pixels < 0.0, 1)
    smooth = gaussian_filter(dark.astype(np.float64), 1.0)
    slope = np.stack([np.gradient(smooth, axis=k) for k in (0, 1)], axis=-1)
    places, normals = [], []
    for axis in (0, 1):
        low, high = np.moveaxis(dark, axis, 0)[:-1], np.moveaxis(dark, axis, 0)[1:]
        at = np.argwhere(np.moveaxis(low != high, 0, axis))
        step = np.eye(2, dtype=np.int64)[axis]
        normal = slope[tuple(at.T)] + slope[tuple((at + step).T)]
        places.append(at - 1.0 + 0.5 + 0.5 * step)
        normals.append(normal)
    place, normal = np.concatenate(places), np.concatenate(normals)
    length = np.linalg.norm(normal, axis=1)
    steep = length > 1e-9
    unit = normal[steep] / length[steep, None]
    # a staircase is longer than the line that it stands for
    share = body.pixel_m / np.abs(unit).sum(axis=1)
    # off the corners of pixels, so that a point beside the edge lies in one pixel
    return body.low_m + body.pixel_m * place[steep], unit, share
