"""Shells cut into pieces along the lines in which they meet."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from sandmould.geometry.mesh_search import MeshSearch
from sandmould.geometry.plane_triangulation import triangulated

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Side = tuple[int, int]
_MOST_ROUNDS = 4
"""Lines of three shells may cross in a triangle; points there bring no further ones."""


@dataclass(frozen=True)
class CutShells:
    """Triangles that meet those of other shells in whole edges and corners only."""

    vertices: Array
    """(mv, 3) float64."""
    triangles: Ints
    """(mt, 3) int64."""
    shell: Ints
    """(mt,) int64: the shell that each was cut from."""


def cut(vertices: Array, triangles: Ints, shell: Ints, near: float) -> CutShells:
    """Cut shells where they meet.

    Parameters
    ----------
    vertices : (nv, 3) float64
    triangles : (nt, 3) int64
    shell : (nt,) int64
    near : float
        Points nearer than this are one.
    """
    pairs = _meeting(vertices, triangles, shell, near)
    if not len(pairs):
        return CutShells(vertices, triangles, shell)
    points = _with(vertices, crossings(vertices, triangles, pairs, near), near)
    for _ in range(_MOST_ROUNDS):
        scene = _Lines(points, triangles, pairs, 2.0 * near)
        more = scene.crossings()
        if not len(more):
            break
        points = _with(points, more, near)
    return scene.pieces(shell)


def _meeting(vertices: Array, triangles: Ints, shell: Ints, near: float) -> Ints:
    """Pairs of triangles of different shells whose boxes meet, (p, 2) int64."""
    corners = vertices[triangles]
    low, high = corners.min(axis=1) - near, corners.max(axis=1) + near
    shells = range(int(shell.max()) + 1)
    boxes = [(low[shell == n].min(axis=0), high[shell == n].max(axis=0)) for n in shells]
    may = np.zeros(len(triangles), dtype=np.bool_)
    for n, (box_low, box_high) in enumerate(boxes):
        may |= (shell != n) & (low <= box_high).all(axis=1) & (high >= box_low).all(axis=1)
    some = np.flatnonzero(may)
    if not len(some):
        return np.empty((0, 2), dtype=np.int64)
    centre = 0.5 * (low + high)
    radius = np.linalg.norm(high - centre, axis=1)
    search = MeshSearch(vertices, triangles[some])
    first, second = search.near_triangles(centre[some], radius[some])
    i, j = some[first], some[second]
    meet = (shell[i] < shell[j]) & (low[i] <= high[j]).all(axis=1) & (high[i] >= low[j]).all(axis=1)
    return np.stack([i[meet], j[meet]], axis=1)


def crossings(vertices: Array, triangles: Ints, pairs: Ints, near: float) -> Array:
    """Points in which edges of one triangle pass another or its edges, (k, 3) float64."""
    found = []
    for turn in (False, True):
        i, j = pairs.T[::-1] if turn else pairs.T
        a, b, c = vertices[triangles[j]].transpose(1, 0, 2)
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        for k in range(3):
            # from the same end in both triangles of the edge
            ends = np.sort(triangles[i][:, [k, (k + 1) % 3]], axis=1)
            p, q = vertices[ends[:, 0]], vertices[ends[:, 1]]
            of_p, of_q = np.sum((p - a) * normal, axis=1), np.sum((q - a) * normal, axis=1)
            through = of_p * of_q < 0.0
            share = of_p[through] / (of_p - of_q)[through]
            place = p[through] + share[:, None] * (q - p)[through]
            found.append(place[_over(place, vertices[triangles[j[through]]], near)])
            if not turn:
                found.extend(_between_edges(vertices, triangles, j, p, q, near))
    return np.concatenate(found)


def _over(place: Array, corners: Array, near: float) -> NDArray[np.bool_]:
    """Which points in the planes of triangles lie in the triangles or near their edges."""
    a, b, c = corners.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    within = np.ones(len(place), dtype=np.bool_)
    for p, q in ((a, b), (b, c), (c, a)):
        inward = np.cross(normal, q - p)
        within &= np.sum((place - p) * inward, axis=1) >= -near * np.linalg.norm(inward, axis=1)
    return within


def _between_edges(
    vertices: Array, triangles: Ints, j: Ints, p: Array, q: Array, near: float
) -> list[Array]:
    """Points in which some edges meet the edges of some triangles."""
    found = []
    for k in range(3):
        ends = np.sort(triangles[j][:, [k, (k + 1) % 3]], axis=1)
        r, s = vertices[ends[:, 0]], vertices[ends[:, 1]]
        share, other = _nearest_shares(p, q, r, s)
        crossing = (share > 0.0) & (share < 1.0) & (other > 0.0) & (other < 1.0)
        here = (p + share[:, None] * (q - p))[crossing]
        there = (r + other[:, None] * (s - r))[crossing]
        found.append(here[np.linalg.norm(here - there, axis=1) <= near])
    return found


def _nearest_shares(p: Array, q: Array, r: Array, s: Array) -> tuple[Array, Array]:
    """How far along lines p to q and r to s they come nearest, 0 to 1; -1 of parallel ones."""
    u, v, w = q - p, s - r, p - r
    uu, uv, vv = np.sum(u * u, axis=1), np.sum(u * v, axis=1), np.sum(v * v, axis=1)
    uw, vw = np.sum(u * w, axis=1), np.sum(v * w, axis=1)
    across = uu * vv - uv * uv
    parallel = across <= 1e-12 * uu * vv
    across[parallel] = 1.0
    share = np.where(parallel, -1.0, (uv * vw - vv * uw) / across)
    return share, np.where(parallel, -1.0, (uu * vw - uv * uw) / across)


def _with(points: Array, more: Array, near: float) -> Array:
    """Points and more of them, those near an earlier one left out."""
    every = np.concatenate([points, more])
    pairs = cKDTree(every).query_pairs(near, output_type="ndarray")
    n = len(every)
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    _, group = connected_components(links, directed=False)
    _, first = np.unique(group, return_index=True)
    return every[np.union1d(first, np.arange(len(points)))]


class _Lines:
    """Which points lie on which triangles, and the lines in which triangles meet."""

    def __init__(self, points: Array, triangles: Ints, pairs: Ints, near: float) -> None:
        self.points, self.triangles, self.near = points, triangles, near
        self.edge: dict[Side, list[int]] = {}
        """Points on an edge, in order from its lower vertex."""
        self.on: dict[int, dict[int, None]] = {}
        """Points on a triangle."""
        tree = cKDTree(points)
        some = np.unique(pairs)
        corners = points[triangles[some]]
        centre = corners.mean(axis=1)
        radius = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1) + near
        for t, beside in zip(some.tolist(), tree.query_ball_point(centre, radius), strict=True):
            self._place(t, np.array(sorted(beside)))
        self._place_beside()
        self.sides: dict[int, set[Side]] = defaultdict(set)
        for i, j in pairs.tolist():
            self._meet(i, j)

    def _place(self, t: int, beside: Ints) -> None:
        """Find the points on a triangle and on its edges."""
        corner = self.triangles[t]
        a, b, c = self.points[corner]
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal)
        away = self.points[beside]
        within = np.abs((away - a) @ normal) <= self.near
        for k in range(3):
            start, end = sorted((int(corner[k]), int(corner[(k + 1) % 3])))
            p, q = self.points[corner[k]], self.points[corner[(k + 1) % 3]]
            inward = np.cross(normal, q - p)
            within &= (away - p) @ inward / np.linalg.norm(inward) > self.near
            if (start, end) not in self.edge:
                self.edge[start, end] = self._on_line(beside, start, end)
        on = [n for k in range(3) for n in self.side(int(corner[k]), int(corner[(k + 1) % 3]))]
        inside = [n for n in beside[within].tolist() if n not in on]
        self.on[t] = dict.fromkeys([*on, *inside])

    def _place_beside(self) -> None:
        """Take up triangles that meet no others but whose edges have points."""
        ends = np.stack([self.triangles, np.roll(self.triangles, -1, axis=1)], axis=2)
        ends = np.sort(ends.reshape(-1, 2), axis=1)
        n = len(self.points)
        parted = [a * n + b for (a, b), line in self.edge.items() if len(line) > 2]
        of = np.flatnonzero(np.isin(ends[:, 0] * n + ends[:, 1], parted)) // 3
        nothing = np.empty(0, dtype=np.int64)
        for t in np.unique(of).tolist():
            if t not in self.on:
                self._place(t, nothing)

    def side(self, start: int, end: int) -> list[int]:
        """Points on an edge, both ends included, in order from its start."""
        return self.edge[start, end] if start < end else self.edge[end, start][::-1]

    def _on_line(self, beside: Ints, start: int, end: int) -> list[int]:
        """Of some points those on a segment, in order, its ends first and last."""
        p, q = self.points[start], self.points[end]
        length = float(np.linalg.norm(q - p))
        along = (self.points[beside] - p) @ (q - p) / length
        off = np.linalg.norm(self.points[beside] - p - np.outer(along / length, q - p), axis=1)
        on = (off <= self.near) & (along > 0.0) & (along < length)
        inner = [n for n in beside[on][np.argsort(along[on])].tolist() if n not in (start, end)]
        return [start, *inner, end]

    def _meet(self, i: int, j: int) -> None:
        """Take down the line in which two triangles meet."""
        common = [n for n in self.on[i] if n in self.on[j]]
        if len(common) < 2:
            return
        place = self.points[common]
        spread = np.linalg.svd(place - place.mean(axis=0), full_matrices=False)
        if len(common) == 2 or spread[1][1] <= 2.0 * self.near:
            line = [common[k] for k in np.argsort(place @ spread[2][0])]
            sides = set(pairwise(line))
            self.sides[i] |= sides
            self.sides[j] |= sides
            return
        # in one plane: the edges of each run across the other
        for t, other in ((i, j), (j, i)):
            corner = self.triangles[other].tolist()
            for k in range(3):
                line = [n for n in self.side(corner[k], corner[(k + 1) % 3]) if n in self.on[t]]
                self.sides[t] |= set(pairwise(line))

    def crossings(self) -> Array:
        """Points in which lines of a triangle cross, (k, 3) float64."""
        found = []
        for t, sides in self.sides.items():
            inner = list({tuple(sorted(s)) for s in sides} - self._rim(t))
            if len(inner) < 2:
                continue
            first, second = np.array(list(combinations(range(len(inner)), 2))).T
            ends = self.points[np.array(inner)]
            ids = np.array(inner)
            apart = (ids[first][:, :, None] != ids[second][:, None, :]).all(axis=(1, 2))
            first, second = first[apart], second[apart]
            p, q = ends[first].transpose(1, 0, 2)
            r, s = ends[second].transpose(1, 0, 2)
            share, other = _nearest_shares(p, q, r, s)
            end = self.near / np.linalg.norm(q - p, axis=1)
            crossing = (share > end) & (share < 1.0 - end)
            end = self.near / np.linalg.norm(s - r, axis=1)
            crossing &= (other > end) & (other < 1.0 - end)
            found.append((p + share[:, None] * (q - p))[crossing])
        return np.concatenate(found) if found else np.empty((0, 3))

    def _rim(self, t: int) -> set[Side]:
        corner = self.triangles[t].tolist()
        lines = [self.side(corner[k], corner[(k + 1) % 3]) for k in range(3)]
        return {(min(s), max(s)) for line in lines for s in pairwise(line)}

    def pieces(self, shell: Ints) -> CutShells:
        """Cut every triangle at the points and lines on it."""
        cut_up = {t: self._cut(t) for t, on in self.on.items() if len(on) > 3}
        left = np.setdiff1d(np.arange(len(self.triangles)), np.array(list(cut_up), dtype=np.int64))
        of = [t for t, parts in cut_up.items() for _ in parts]
        new = [part for parts in cut_up.values() for part in parts]
        return CutShells(
            self.points,
            np.concatenate([self.triangles[left], np.array(new, dtype=np.int64).reshape(-1, 3)]),
            np.concatenate([shell[left], shell[np.array(of, dtype=np.int64)]]),
        )

    def _cut(self, t: int) -> list[tuple[int, int, int]]:
        """Parts of a triangle."""
        on = list(self.on[t])
        number = {n: k for k, n in enumerate(on)}
        a, b, c = self.points[self.triangles[t]]
        normal = np.cross(b - a, c - a)
        first = (b - a) / np.linalg.norm(b - a)
        second = np.cross(normal, first) / np.linalg.norm(normal)
        flat = (self.points[on] - a) @ np.stack([first, second]).T / np.linalg.norm(b - a)
        corner = self.triangles[t].tolist()
        lines = [self.side(corner[k], corner[(k + 1) % 3]) for k in range(3)]
        rims = [{number[n] for n in line} for line in lines]
        sides = {(number[i], number[j]) for i, j in self._rim(t)}
        sides |= {(number[i], number[j]) for i, j in self.sides[t] if i in number and j in number}
        # what lies between the points of one edge has no area
        return [
            (on[i], on[j], on[k])
            for i, j, k in triangulated(flat, sorted({(min(s), max(s)) for s in sides}))
            if not any({i, j, k} <= rim for rim in rims)
        ]
