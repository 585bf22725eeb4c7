"""The surface of what is drawn, in small pieces: where each lies, whither it looks, how large."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from sandmould.arrays import Flags, Floats, Ints
from sandmould.geometry.geometry import Block
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.outline import Outline
from sandmould.scenario.casting.shapes import Body, Pixels

SMOOTH_PIXELS = 2.0
"""Standard deviation over which the direction of a picture's edge is taken: a staircase of pixels
stands for a slope, runs along an axis stay straight."""


@dataclass(frozen=True)
class Pieces:
    """Pieces of a surface."""

    place_m: Floats
    """(n, d) float64, m: middle of each."""
    normal: Floats
    """(n, d) float64: unit vector out of the solid."""
    area_m2: Floats
    """(n,) float64, m2, or m in 2D."""

    def only(self, which: Flags) -> Pieces:
        """Some of them."""
        return Pieces(self.place_m[which], self.normal[which], self.area_m2[which])


def pieces_of(body: Body, low_m: Floats, cell_m: float) -> Pieces:
    """Cut a solid's surface into pieces.

    Parameters
    ----------
    body : Body
        A polygon, block, mesh or picture.
    low_m : (d,) float64, m
        A corner of the grid; edges of 2D are cut where they leave its cells.
    cell_m : float, m
        Side of the grid's cells; triangles are halved until no side is longer than half of it.

    Raises
    ------
    TypeError
        When the solid is of another kind.
    """
    if isinstance(body, Pixels):
        if body.pixel_m <= 0.5 * cell_m:
            return _slopes(body)
        return _edge_pieces(*_pixel_edges(body), low_m, cell_m)
    if isinstance(body, Outline):
        return _edge_pieces(body.vertices_m, np.roll(body.vertices_m, -1, axis=0), low_m, cell_m)
    if isinstance(body, Block):
        corners, facets = body.corners(), body.facets()
        if corners.shape[1] == 2:
            return _edge_pieces(corners[facets[:, 0]], corners[facets[:, 1]], low_m, cell_m)
        return _triangle_pieces(corners[facets], cell_m)
    if isinstance(body, TriangleMesh):
        return _triangle_pieces(body.corners_m, cell_m)
    raise TypeError(f"{body.name} is a {type(body).__name__}; its surface is not known")


def _edge_pieces(start_m: Floats, end_m: Floats, low_m: Floats, cell_m: float) -> Pieces:
    """Edges, cut where they cross the lines of the grid."""
    parts = []
    for a, b in zip(start_m, end_m, strict=True):
        shares = [np.array([0.0, 1.0])]
        for axis in range(2):
            p, q = (np.array([a[axis], b[axis]]) - low_m[axis]) / cell_m
            lines = np.arange(np.ceil(min(p, q)), np.floor(max(p, q)) + 1.0)
            if p != q:
                shares.append((lines - p) / (q - p))
        cuts = np.unique(np.clip(np.concatenate(shares), 0.0, 1.0))
        middle, part = 0.5 * (cuts[1:] + cuts[:-1]), np.diff(cuts)
        along, length = b - a, float(np.linalg.norm(b - a))
        normal = np.array([along[1], -along[0]]) / length
        place = a + middle[:, None] * along
        parts.append((place, np.tile(normal, (len(middle), 1)), part * length))
    place, normals, area = (np.concatenate(part) for part in zip(*parts, strict=True))
    return Pieces(place, normals, area)


def _triangle_pieces(corners_m: Floats, cell_m: float) -> Pieces:
    """Triangles, halved across their longest side until it is short."""
    across = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
    double = np.linalg.norm(across, axis=1)
    flat = double > 0.0
    left, normal, area = corners_m[flat], across[flat] / double[flat, None], 0.5 * double[flat]
    done = []
    while len(left):
        side = np.linalg.norm(np.roll(left, -1, axis=1) - left, axis=2)
        small = side.max(axis=1) <= 0.5 * cell_m
        done.append((left[small].mean(axis=1), normal[small], area[small]))
        left, normal, area = left[~small], normal[~small], area[~small]
        # the longest side comes first
        first = np.argmax(side[~small], axis=1)
        order = (first[:, None] + np.arange(3)) % 3
        a, b, c = np.moveaxis(np.take_along_axis(left, order[:, :, None], axis=1), 1, 0)
        half = 0.5 * (a + b)
        left = np.concatenate([np.stack([a, half, c], axis=1), np.stack([half, b, c], axis=1)])
        normal, area = np.tile(normal, (2, 1)), np.tile(0.5 * area, 2)
    place, normals, areas = (np.concatenate(part) for part in zip(*done, strict=True))
    return Pieces(place, normals, areas)


def _steps(dark: Flags) -> list[Ints]:
    """Pixels on the low side of the edges between dark and light ones, (k, 2) for each axis."""
    found = []
    for axis in range(2):
        before, after = (
            np.take(dark, range(k, dark.shape[axis] - 1 + k), axis=axis) for k in (0, 1)
        )
        found.append(np.argwhere(before != after))
    return found


def _pixel_edges(body: Pixels) -> tuple[Floats, Floats]:
    """Ends of all edges between dark and light pixels, which are taken as drawn."""
    dark = np.pad(body.distance_in_pixels < 0.0, 1)
    unit, corners = np.eye(2, dtype=np.int64), []
    for axis, step in enumerate(_steps(dark)):
        first = step + unit[axis] - 1
        corners.append(np.stack([first, first + unit[1 - axis]]))
    start, end = np.concatenate(corners, axis=1)
    return body.low_m + body.pixel_m * start, body.low_m + body.pixel_m * end


def _slopes(body: Pixels) -> Pieces:
    """Edges between dark and light pixels, each as long as the slope that it is a step of."""
    # Steps across axis a make |n_a| of a line of normal n; with |n_a| of their own length they add
    # up to the line's, for n_x^2 + n_y^2 = 1.
    dark = np.pad(body.distance_in_pixels < 0.0, 1)
    smooth = gaussian_filter(np.pad(dark, 8).astype(np.float64), SMOOTH_PIXELS)
    across, up = np.gradient(smooth)
    slope = np.stack([across, up], axis=-1)[8:-8, 8:-8]
    parts = []
    for axis, step in enumerate(_steps(dark)):
        beyond = step + np.eye(2, dtype=np.int64)[axis]
        normal = -(slope[tuple(step.T)] + slope[tuple(beyond.T)])
        outward = np.where(dark[tuple(step.T)], 1.0, -1.0)
        lost = normal[:, axis] * outward <= 1e-12
        normal[lost] = outward[lost, None] * np.eye(2)[axis]
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        place = body.low_m + body.pixel_m * (0.5 * (step + beyond) - 0.5)
        parts.append((place, normal, body.pixel_m * np.abs(normal[:, axis])))
    places, normals, areas = (np.concatenate(part) for part in zip(*parts, strict=True))
    return Pieces(places, normals, areas)
