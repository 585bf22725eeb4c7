"""Meshes that Gmsh makes: surfaces of STEP files, and tetrahedra inside surfaces.

Gmsh runs in a process of its own: a drawing that it cannot bear ends that process with a sentence
and never ours, and its memory goes with it. One thread and a fixed seed make its meshes the same
from call to call, so that a run finds the vertices that its plan has written down.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sandmould import ROOT
from sandmould.geometry.drawing_file import MeshFileError
from sandmould.geometry.mesh import TriangleMesh, signed_volumes_m3
from sandmould.geometry.mesh_coarser import without_slivers
from sandmould.geometry.mesh_shells import joined_sides, shells_of

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
LONGEST_S = 600.0
"""A mesh that takes longer is given up."""
POOR = 0.01
"""Quality of an element, 1 where regular, below which its surface is meshed without slivers."""
_JOB = "sandmould.geometry.mesher_job"


def step_surface(path: Path) -> tuple[Array, Ints]:
    """Triangles of the solids of a STEP file; several solids are one where they meet.

    Returns
    -------
    vertices_m : (nv, 3) float64, m
    triangles : (nt, 3) int64

    Raises
    ------
    MeshFileError
        When Gmsh is missing or cannot read the file, or it has no solid.
    """
    return _made("step", path, 0.0)[:2]


def step_tetrahedra(path: Path, size_m: float) -> tuple[Array, Ints]:
    """Tetrahedra in the solid of a STEP file.

    Parameters
    ----------
    size_m : float, m
        Longest side of an element, about.

    Returns
    -------
    nodes_m : (n, 3) float64, m
    tetrahedra : (ne, 4) int64

    Raises
    ------
    MeshFileError
        As :func:`step_surface`.
    """
    return _made("step", path, size_m)[:2]


def surface_tetrahedra(vertices_m: Array, triangles: Ints, size_m: float) -> tuple[Array, Ints]:
    """Tetrahedra inside a closed surface of triangles, whose faces are meshed anew.

    Where slivers of the surface leave poor elements it is meshed again without them.

    Parameters
    ----------
    vertices_m : (nv, 3) float64, m
    triangles : (nt, 3) int64
    size_m : float, m
        Longest side of an element, about.

    Returns
    -------
    nodes_m : (n, 3) float64, m
    tetrahedra : (ne, 4) int64

    Raises
    ------
    MeshFileError
        When Gmsh is missing or cannot fill the surface, or it bounds several bodies.
    """
    _check_one_body(vertices_m, triangles)
    nodes_m, tetrahedra, worst = _filled(vertices_m, triangles, size_m)
    if worst < POOR:
        plain = without_slivers(TriangleMesh("surface", vertices_m, triangles))
        again = _filled(plain.vertices_m, plain.triangles, size_m)
        if again[2] > worst:
            return again[:2]
    return nodes_m, tetrahedra


def _check_one_body(vertices_m: Array, triangles: Ints) -> None:
    """Refuse solids that share no face: foam would fall apart there."""
    shell = shells_of(joined_sides(vertices_m, triangles), len(triangles))
    volume = np.bincount(shell, weights=signed_volumes_m3(vertices_m, triangles))
    bodies = np.flatnonzero(volume > 0.0)
    if len(bodies) > 1:
        places = [set(map(tuple, vertices_m[triangles[shell == n].ravel()])) for n in bodies]
        touch = sum(map(len, places)) > len(set().union(*places))
        how = "touch along edges or in points only" if touch else "do not touch"
        raise MeshFileError(f"one body; these are {len(bodies)} that {how}")


def _filled(vertices_m: Array, triangles: Ints, size_m: float) -> tuple[Array, Ints, float]:
    with tempfile.TemporaryDirectory(prefix="surface_") as folder:
        path = Path(folder) / "surface.npz"
        np.savez(path, vertices_m=vertices_m, triangles=triangles)
        return _made("surface", path, size_m)


def _made(kind: str, path: Path, size_m: float) -> tuple[Array, Ints, float]:
    """Points and cells that a job makes, and their worst quality; triangles where the size is 0."""
    with tempfile.TemporaryDirectory(prefix="mesh_") as folder:
        result = Path(folder) / "mesh.npz"
        command = [sys.executable, "-m", _JOB, kind, str(path.resolve()), repr(size_m), str(result)]
        try:
            done = subprocess.run(
                command, capture_output=True, text=True, timeout=LONGEST_S, cwd=ROOT, check=False
            )
        except subprocess.TimeoutExpired as error:
            valid = f"one that Gmsh meshes within {LONGEST_S:g} s: a larger element, a simpler part"
            raise MeshFileError(valid) from error
        if done.returncode != 0 or not result.is_file():
            said = done.stdout.strip().splitlines()
            reason = said[-1] if said else f"Gmsh ended with status {done.returncode}"
            raise MeshFileError(f"one that Gmsh can mesh; {reason}")
        with np.load(result, allow_pickle=False) as mesh:
            return mesh["points_m"], mesh["cells"], float(mesh["worst"])
