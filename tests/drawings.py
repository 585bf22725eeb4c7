"""Drawings as programs write them, and as they are damaged, of two bodies of known volume."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Body = tuple[Array, Ints]
_SIDES = 24


def _box() -> Body:
    corners = np.array([[x, y, z] for x in (0, 40) for y in (0, 30) for z in (0, 20)], dtype=float)
    mesh = trimesh.Trimesh(corners).convex_hull
    return np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int64)


def _ring() -> Body:
    """A prism of a ring of 24 sides, radii 12 and 20, 25 high."""
    angle = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
    around = np.column_stack([np.cos(angle), np.sin(angle)])
    rims = [np.column_stack([r * around, np.full(_SIDES, z)]) for r in (20, 12) for z in (0, 25)]
    k, after = np.arange(_SIDES), (np.arange(_SIDES) + 1) % _SIDES
    outer, top, inner, inner_top = 0, _SIDES, 2 * _SIDES, 3 * _SIDES

    def strip(a: int, b: int) -> Ints:
        """Quadrilaterals between two rims, each as two triangles."""
        one = np.column_stack([a + k, a + after, b + after])
        return np.concatenate([one, np.column_stack([a + k, b + after, b + k])])

    parts = [strip(outer, top), strip(top, inner_top), strip(inner_top, inner), strip(inner, outer)]
    return np.concatenate(rims), np.concatenate(parts).astype(np.int64)


BODIES: dict[str, tuple[Body, float]] = {
    "box": (_box(), 24_000.0),
    "ring": (_ring(), 0.5 * _SIDES * np.sin(2.0 * np.pi / _SIDES) * (20**2 - 12**2) * 25.0),
}
"""Vertices and triangles in mm, and the volume, mm3."""


def text(
    body: Body,
    facet: str = "facet normal 0 0 0",
    end: str = "endfacet",
    sep: str = "\n",
    number: str = "%.9g",
    close: str = "endsolid part\n",
    head: str = "solid part",
) -> str:
    """An ASCII STL file in one of its spellings."""
    lines = [head]
    for corners in body[0][body[1]]:
        places = ["vertex " + " ".join(number % x for x in corner) for corner in corners]
        lines += [facet, "outer loop", *places, "endloop", end]
    return sep.join([*lines, close])


def binary(body: Body, head: bytes = b"", color: int = 0, tail: bytes = b"") -> bytes:
    """A binary STL file."""
    corners = body[0][body[1]].astype("<f4")
    facets = (struct.pack("<3f", 0, 0, 0) + t.tobytes() + struct.pack("<H", color) for t in corners)
    return head.ljust(80, b"\0") + struct.pack("<I", len(corners)) + b"".join(facets) + tail


def _by_trimesh(kind: str, **options: object) -> Callable[[Body], bytes]:
    def write(body: Body) -> bytes:
        made = trimesh.Trimesh(*body, process=False).export(file_type=kind, **options)
        return made.encode() if isinstance(made, str) else made

    return write


def _quads(body: Body) -> bytes:
    """OBJ with a normal and a texture at each corner, counted from the end."""
    vertices = "".join(f"v {x} {y} {z}\n" for x, y, z in body[0])
    corner = "{0}/-1/-1"
    faces = ("f " + " ".join(corner.format(n - len(body[0])) for n in t) for t in body[1])
    return ("# a program\n" + vertices + "vt 0 0\nvn 0 0 1\n" + "\n".join(faces)).encode()


PROGRAMS: dict[str, tuple[str, Callable[[Body], bytes]]] = {
    "library": (".stl", _by_trimesh("stl_ascii")),
    "openscad": (".stl", lambda body: text(body, head="solid OpenSCAD_Model").encode()),
    "binary_solid": (".stl", lambda body: binary(body, b"solid of a program")),
    "windows": (".STL", lambda body: text(body, sep="\r\n", number="%.8E").encode()),
    "colours": (".stl", lambda body: binary(body, b"COLOR=abcd", 0x7FFF, b"tail")),
    "capitals": (".stl", lambda body: text(body, sep="\n\t").upper().encode("utf-8-sig")),
    "script": (
        ".stl",
        lambda body: text(body, "facet", "end facet", " ", close="end solid").encode(),
    ),
    "quads": (".obj", _quads),
    "scanner": (".ply", _by_trimesh("ply")),
    "printer": (".3mf", _by_trimesh("3mf")),
}
"""Ending of the name and writer of each program."""


def _near(body: Body, shift: float) -> Body:
    """One triangle's corners of their own, moved a little."""
    vertices, triangles = body
    loose = vertices[triangles[0]] + shift
    return np.concatenate([vertices, loose]), np.concatenate(
        [[len(vertices) + np.arange(3)], triangles[1:]]
    )


def _split(body: Body) -> Body:
    """A point on an edge of one triangle that its neighbour does not have."""
    vertices, triangles = body
    a, b, c = triangles[0]
    n = len(vertices)
    point = 0.5 * (vertices[a] + vertices[b])
    return np.concatenate([vertices, [point]]), np.concatenate(
        [[[a, n, c], [n, b, c]], triangles[1:]]
    )


def _with(body: Body, *more: list[int], points: Array | None = None) -> Body:
    vertices = body[0] if points is None else np.concatenate([body[0], points])
    return vertices, np.concatenate([body[1], np.array(more, dtype=np.int64)])


def _beside(body: Body) -> Body:
    """A sheet of two triangles back to back at an edge."""
    a, b, _ = body[1][0].tolist()
    n = len(body[0])
    return _with(body, [a, b, n], [b, a, n], points=body[0][:1] - 5.0)


DAMAGES: dict[str, Callable[[Body], Body]] = {
    "one_missing": lambda body: (body[0], body[1][1:]),
    "one_turned": lambda body: (body[0], np.concatenate([body[1][:1, ::-1], body[1][1:]])),
    "inside_out": lambda body: (body[0], body[1][:, ::-1]),
    "drawn_twice": lambda body: _with(body, body[1][3].tolist()),
    "no_area": lambda body: _with(body, [0, 1, 1], [2, 2, 2]),
    "point_on_an_edge": _split,
    "crack": lambda body: _near(body, 5e-4),
    "sheet": _beside,
}
"""What can be mended; what cannot is in ``REFUSED``."""

REFUSED: dict[str, tuple[Callable[[Body], bytes], str]] = {
    "cut": (
        lambda body: binary(body)[:-200],
        r"is cut .* its head tells \d+ triangles, and \d+ are",
    ),
    "cut_text": (
        lambda body: text(body)[:-60].encode(),
        r"facets of three corners; that of line \d+ has [12], and the file ends there",
    ),
    "commas": (
        lambda body: text(body, number="%.1f").replace(".", ",").encode(),
        r"decimal points; the facet of line 2 has '\d+,\d'",
    ),
    "nowhere": (
        lambda body: text(body).replace("vertex ", "vertex nan ", 1).encode(),
        r"finite numbers below 1e\+30; triangle \d+ of \d+ has another",
    ),
}


def written(path: Path, content: bytes) -> Path:
    """The file, with its content."""
    path.write_bytes(content)
    return path
