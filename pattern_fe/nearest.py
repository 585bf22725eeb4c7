"""Nearest places on the facets of a surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_PAIRS = 200_000
"""Of points and facets held in memory together."""


def nearest_on_facets(points_m: Array, corners_m: Array) -> tuple[NDArray[np.int64], Array, Array]:
    """Find the facet nearest each point, and the place on it.

    ``points_m``: (k, d) float64, m. ``corners_m``, (nf, d, d) float64, m: corners of segments in
    2D, of triangles in 3D.

    Returns
    -------
    facet : (k,) int64
    shares : (k, d) float64
        Shape functions of its corners at that place.
    place_m : (k, d) float64, m
    """
    k, d = points_m.shape
    facet, shares = np.zeros(k, dtype=np.int64), np.zeros((k, d))
    rows = max(1, _PAIRS // len(corners_m))
    for first in range(0, k, rows):
        part = slice(first, first + rows)
        found = _shares(points_m[part, None], corners_m[None])
        at = np.einsum("kfc,fcd->kfd", found, corners_m)
        away2 = np.sum((points_m[part, None] - at) ** 2, axis=2)
        facet[part] = away2.argmin(axis=1)
        shares[part] = found[np.arange(len(found)), facet[part]]
    return facet, shares, np.einsum("kc,kcd->kd", shares, corners_m[facet])


def _shares(point: Array, corner: Array) -> Array:
    """Shares of the corners at the nearest place, for all pairs of points and facets."""
    if corner.shape[2] == 2:
        along = _along(point, corner[:, :, 0], corner[:, :, 1])
        return np.stack([1.0 - along, along], axis=2)
    a, b, c = (corner[:, :, i] for i in range(3))
    ab, ac, ap = b - a, c - a, point - a
    bb, bc, cc = _dot(ab, ab), _dot(ab, ac), _dot(ac, ac)
    pb, pc = _dot(ap, ab), _dot(ap, ac)
    size = bb * cc - bc * bc
    v, w = (cc * pb - bc * pc) / size, (bb * pc - bc * pb) / size
    best = np.stack([1.0 - v - w, v, w], axis=2)
    outside = (best < 0.0).any(axis=2)
    nearest2 = np.where(outside, np.inf, 0.0)
    for i in range(3):
        start, end = corner[:, :, i], corner[:, :, (i + 1) % 3]
        along = _along(point, start, end)
        away2 = np.sum((point - start - along[..., None] * (end - start)) ** 2, axis=2)
        on_edge = np.zeros_like(best)
        on_edge[..., i], on_edge[..., (i + 1) % 3] = 1.0 - along, along
        nearer = outside & (away2 < nearest2)
        best[nearer], nearest2[nearer] = on_edge[nearer], away2[nearer]
    return best


def _along(point: Array, start: Array, end: Array) -> Array:
    """Share of a segment's length at which the point nearest to another lies."""
    edge = end - start
    return np.asarray(np.clip(_dot(point - start, edge) / _dot(edge, edge), 0.0, 1.0))


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.sum(a * b, axis=-1))
