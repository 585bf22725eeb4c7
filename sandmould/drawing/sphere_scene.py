"""What stands round the spheres of a 3D view: box, solids, bores of tubes, cavities."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import to_hex
from numpy.typing import NDArray

from sandmould.analysis.plots import LAYER_COLOURS
from sandmould.drawing.figures import cut_m
from sandmould.geometry.geometry import Array, Block, Bore, Solid
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.revolved import Revolved
from sandmould.scenario.casting.shapes import Body
from sandmould.scenario.scenario import Scenario

SIDES = 48
"""Of the polygon that a round solid is drawn as."""
MOST_TRIANGLES = 40_000
"""A solid of more is drawn coarser, which eyes do not see."""
_SHARP_RAD = np.deg2rad(25.0)
"""An edge is drawn where faces turn by more than this."""
SHADES = tuple(to_hex(colour) for colour in colormaps["viridis"](np.arange(255) / 254))
UNKNOWN = 255
"""Shade of a vertex at which a field is not known."""


@dataclass(frozen=True)
class SurfaceField:
    """What the surfaces of solids are coloured by: each vertex by the nearest place."""

    title: str
    place_m: Array
    """(n, 3) float64, m, in the box's coordinates."""
    value: Array
    """(n,) float64."""
    low: float
    high: float
    """Values at the ends of the colours."""
    ends: tuple[str, str]
    """The same in words."""
    spacing_m: float
    """Distance of neighbouring places: triangles are cut to it, and farther from all places than
    twice of it the field is not known."""

    def shades(self, vertices_m: Array) -> NDArray[np.uint8]:
        """Shade of each vertex."""
        from scipy.spatial import cKDTree  # slow to import, as what else is imported late here

        known = np.isfinite(self.value)
        tree = cKDTree(self.place_m[known])
        apart_m, at = tree.query(vertices_m, distance_upper_bound=2.0 * self.spacing_m)
        value = np.append(self.value[known], np.nan)[at]
        share = np.clip((value - self.low) / max(self.high - self.low, 1e-300), 0.0, 1.0)
        whole = np.rint(254 * np.nan_to_num(share)).astype(np.uint8)
        return np.where(np.isfinite(apart_m), whole, np.uint8(UNKNOWN))


def sphere_scene(
    scenario: Scenario, top_m: float, fields: Sequence[SurfaceField] = ()
) -> dict[str, object]:
    """The scene for the page's 3D view, in m; its solids can be coloured by fields."""
    box, pattern = scenario.box, scenario.pattern
    gate = scenario.gate.name if scenario.gate else None
    bends = "" if pattern is None else pattern.name
    solids = [
        {
            "name": solid.name,
            "opens": solid.name == gate,
            "bends": solid.name == bends,
            **_packed(*_triangles(solid), () if solid.name == bends else fields),
        }
        for solid in scenario.scene.solids
    ]
    lines = [_bore_lines(bore) for bore in scenario.scene.bores]
    for cavity in scenario.scene.cavities:
        vertices_m, triangles = _triangles(cavity.space)
        lines.append(vertices_m[sharp_edges(vertices_m, triangles)])
    bores = [np.round(lines_m, 6).ravel().tolist() for lines_m in lines]
    return _scene((box.width_m, box.depth_m, top_m), cut_m(scenario), solids, bores, fields)


def solid_scene(
    solids: Iterable[Body], low_m: Array, high_m: Array, fields: Sequence[SurfaceField] = ()
) -> dict[str, object]:
    """Blocks and meshes in a box without sand, which need not be at the origin; the same view."""
    moved = [replace(field, place_m=field.place_m - low_m) for field in fields]
    packed = []
    for solid in solids:
        if not isinstance(solid, Block | TriangleMesh):
            continue
        vertices_m, triangles = _triangles(solid)
        shape = _packed(vertices_m - low_m, triangles, moved)
        packed.append({"name": solid.name, "opens": False, "bends": False, **shape})
    size_m = (high_m - low_m).tolist()
    scene = _scene(size_m, None, packed, [], fields)
    return scene | {"from_m": low_m.tolist(), "is_bare": True, "solid_tint": [0.5, 0.55, 0.6, 0.9]}


def _scene(
    size_m: Sequence[float],
    at_m: float | None,
    solids: list[dict[str, object]],
    bores: list[list[float]],
    fields: Sequence[SurfaceField],
) -> dict[str, object]:
    return {
        "size_m": list(size_m),
        "from_m": [0.0, 0.0, 0.0],
        "cut_m": at_m,
        "solids": solids,
        "bores": bores,
        "fields": [{"title": field.title, "ends": field.ends} for field in fields],
        "layer_colours": list(LAYER_COLOURS),
        "shades": list(SHADES),
        "solid_tint": [0.55, 0.6, 0.66, 0.4],
    }


def _triangles(solid: Solid) -> tuple[Array, NDArray[np.int64]]:
    """Vertices and triangles of a solid of 3D."""
    if isinstance(solid, Block):
        return solid.corners(), solid.facets()
    mesh = solid.mesh(SIDES) if isinstance(solid, Revolved) else solid
    assert isinstance(mesh, TriangleMesh)
    vertices_m, triangles = mesh.vertices_m, mesh.triangles
    if len(triangles) > MOST_TRIANGLES:
        import fast_simplification

        vertices_m, triangles = fast_simplification.simplify(
            vertices_m, triangles, target_count=MOST_TRIANGLES
        )
    return vertices_m, triangles.astype(np.int64)


def _cut_small(
    vertices_m: Array, triangles: NDArray[np.int64], side_m: float
) -> tuple[Array, NDArray[np.int64]]:
    """Triangles halved until no side is longer, or until they are many; the vertices stay first."""
    corners_m = vertices_m[triangles]
    while 2 * len(corners_m) <= MOST_TRIANGLES:
        sides_m = np.linalg.norm(np.roll(corners_m, -1, axis=1) - corners_m, axis=2)
        is_long = sides_m.max(axis=1) > side_m
        if not is_long.any():
            break
        # the longest side comes first
        order = (np.argmax(sides_m[is_long], axis=1)[:, None] + np.arange(3)) % 3
        turned_m = np.take_along_axis(corners_m[is_long], order[:, :, None], axis=1)
        a, b, c = turned_m.transpose(1, 0, 2)
        half = 0.5 * (a + b)
        halves_m = np.concatenate([np.stack([a, half, c], 1), np.stack([half, b, c], 1)])
        corners_m = np.concatenate([corners_m[~is_long], halves_m])
    small_m, at = np.unique(corners_m.reshape(-1, 3), axis=0, return_inverse=True)
    return np.concatenate([vertices_m, small_m]), at.reshape(-1, 3) + len(vertices_m)


def _packed(
    vertices_m: Array, triangles: NDArray[np.int64], fields: Sequence[SurfaceField] = ()
) -> dict[str, object]:
    """Base64 of deflated vertices (float32), triangles and sharp edges (uint32), and shades.

    Shades (uint8) follow by field and vertex.
    """
    edges = sharp_edges(vertices_m, triangles)
    if fields:
        side_m = min(field.spacing_m for field in fields)
        vertices_m, triangles = _cut_small(vertices_m, triangles, side_m)
    raw = b"".join(
        part.tobytes()
        for part in (
            vertices_m.astype("<f4"),
            triangles.astype("<u4"),
            edges.astype("<u4"),
            *(field.shades(vertices_m) for field in fields),
        )
    )
    return {
        "vertices": len(vertices_m),
        "triangles": len(triangles),
        "edges": len(edges),
        "fields": len(fields),
        "data": base64.b64encode(zlib.compress(raw, 9)).decode("ascii"),
    }


def sharp_edges(vertices_m: Array, triangles: NDArray[np.int64]) -> NDArray[np.int64]:
    """Edges at which a surface turns, or ends: their vertices, (k, 2) int64."""
    import trimesh

    mesh = trimesh.Trimesh(vertices_m, triangles, process=False)
    flat = mesh.face_adjacency_edges[mesh.face_adjacency_angles < _SHARP_RAD]
    edges = trimesh.grouping.boolean_rows(mesh.edges_unique, flat, np.setdiff1d)
    return np.asarray(edges, dtype=np.int64)


def _bore_lines(bore: Bore) -> Array:
    """Ends of the lines along the rims of a bore, (k, 2, 3) float64, m."""
    mouth_m = bore.mouth_m + bore.section_m @ bore.basis
    foot_m = mouth_m + bore.length_m * bore.axis
    rims = [np.stack([rim, np.roll(rim, -1, axis=0)], axis=1) for rim in (mouth_m, foot_m)]
    few = np.arange(0, len(mouth_m), max(1, len(mouth_m) // 8))
    return np.concatenate([*rims, np.stack([mouth_m[few], foot_m[few]], axis=1)])
