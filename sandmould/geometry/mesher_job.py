"""What Gmsh does in a process of its own; the calls are those of ``mesher``."""

from __future__ import annotations

import contextlib
import math
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from sandmould.module_main import run_main

_SHARP_RAD = math.radians(40.0)
"""Triangles that meet at more than this are of two faces."""
_ROUND = 72
"""Sides of a full circle in the triangles of a STEP file: within 0.1 % of its radius."""
_TRIANGLE, _TETRAHEDRON = 2, 4
"""Gmsh's numbers of these elements."""
LACKS_GMSH = (
    "it is not installed here: pip install 'sandmould[cad]', and Debian's libglu1-mesa, libxft2, "
    "libxcursor1, libxinerama1"
)


def main(kind: str, path: str, size_m: str, result: str) -> int:
    """Mesh a STEP file, or a surface in arrays; print one sentence where that fails."""
    try:
        import gmsh
    except (ImportError, OSError):
        print(LACKS_GMSH)
        return 1
    try:
        with _opened(gmsh, float(size_m)):
            if kind == "step":
                _read_step(gmsh, path)
            else:
                _take_surface(gmsh, Path(path))
            _mesh(gmsh, float(size_m), Path(result))
    except Exception as fault:  # Gmsh raises nothing finer
        print(" ".join(str(fault).split()) or "it gave no reason")
        return 1
    return 0


@contextlib.contextmanager
def _opened(gmsh: Any, size_m: float) -> Iterator[None]:
    gmsh.initialize(interruptible=False)
    options: dict[str, float] = {
        "General.Terminal": 0,
        "General.NumThreads": 1,
        "Mesh.MeshSizeExtendFromBoundary": 0,
        "Mesh.MeshSizeFromPoints": 0,
        "Mesh.OptimizeNetgen": 1,
        # Only what is told in words of its own; the rest is warnings
        "General.Verbosity": 1,
    }
    if size_m > 0.0:
        options["Mesh.MeshSizeMax"] = size_m
    else:
        options["Mesh.MeshSizeFromCurvature"] = _ROUND
    for name, value in options.items():
        gmsh.option.setNumber(name, value)
    gmsh.option.setString("Geometry.OCCTargetUnit", "M")
    try:
        yield
    finally:
        gmsh.finalize()


def _read_step(gmsh: Any, path: str) -> None:
    """Take the solids of a file, as one where they meet; faces that bound one are closed to it."""
    kernel = gmsh.model.occ
    shapes = kernel.importShapes(path)
    solids = [tag for tag in shapes if tag[0] == 3]
    if not solids:
        healed = kernel.healShapes(shapes, sewFaces=True, makeSolids=True)
        solids = [tag for tag in healed if tag[0] == 3]
    if not solids:
        raise ValueError("the file has no solid: faces and lines bound no sand and hold no foam")
    if len(solids) > 1:
        kernel.fuse(solids[:1], solids[1:])
    kernel.synchronize()


def _take_surface(gmsh: Any, path: Path) -> None:
    """Make a geometry of triangles, its faces between sharp edges, and the volume in it."""
    with np.load(path, allow_pickle=False) as surface:
        points, triangles = surface["vertices_m"], surface["triangles"]
    model = gmsh.model
    face = model.addDiscreteEntity(2)
    model.mesh.addNodes(2, face, np.arange(1, len(points) + 1), points.ravel())
    model.mesh.addElementsByType(face, _TRIANGLE, [], (triangles + 1).ravel())
    model.mesh.classifySurfaces(_SHARP_RAD, True, True, math.pi)
    model.mesh.createGeometry()
    loops = [model.geo.addSurfaceLoop(shell) for shell in _shells(model)]
    model.geo.addVolume(loops)
    model.geo.synchronize()


def _shells(model: Any) -> list[list[int]]:
    """Faces that hang together, the outermost shell first: those after it are cavities."""
    beside = defaultdict(set)
    faces = [tag for _, tag in model.getEntities(2)]
    for face in faces:
        for _, curve in model.getBoundary([(2, face)], oriented=False):
            beside[curve].add(face)
    left, shells = set(faces), []
    while left:
        shell, ahead = [], [min(left)]
        while ahead:
            face = ahead.pop()
            if face in left:
                left.remove(face)
                shell.append(face)
                for _, curve in model.getBoundary([(2, face)], oriented=False):
                    ahead.extend(beside[curve])
        shells.append(sorted(shell))

    def extent(shell: list[int]) -> float:
        boxes = np.array([model.getBoundingBox(2, face) for face in shell])
        return float((boxes[:, 3:].max(axis=0) - boxes[:, :3].min(axis=0)).max())

    return sorted(shells, key=extent, reverse=True)


def _mesh(gmsh: Any, size_m: float, result: Path) -> None:
    solid = size_m > 0.0
    mesh = gmsh.model.mesh
    mesh.generate(3 if solid else 2)
    tags, points, _ = mesh.getNodes()
    elements, corners = mesh.getElementsByType(_TETRAHEDRON if solid else _TRIANGLE)
    if not len(corners):
        raise ValueError("it found no volume in the surface")
    used, cells = np.unique(corners, return_inverse=True)
    place = np.zeros(int(tags.max()) + 1, dtype=np.int64)
    place[tags.astype(np.int64)] = np.arange(len(tags))
    points_m = points.reshape(-1, 3)[place[used.astype(np.int64)]]
    cells = cells.reshape(-1, 4 if solid else 3).astype(np.int64)
    worst = np.min(mesh.getElementQualities(elements, "gamma"))
    np.savez(result, points_m=points_m, cells=cells, worst=worst)


if __name__ == "__main__":
    run_main(main, "python -m sandmould.geometry.mesher_job KIND PATH SIZE_M RESULT", (4,))
