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

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
LONGEST_S = 600.0
"""A mesh that takes longer is given up."""
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
    return _made("step", path, 0.0)


def step_tetrahedra(path: Path, size_m: float) -> tuple[Array, Ints]:
    """Tetrahedra in the solid of a STEP file.

    Parameters
    ----------
    path : Path
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
    return _made("step", path, size_m)


def surface_tetrahedra(vertices_m: Array, triangles: Ints, size_m: float) -> tuple[Array, Ints]:
    """Tetrahedra inside a closed surface of triangles, whose faces are meshed anew.

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
        When Gmsh is missing or cannot fill the surface.
    """
    with tempfile.TemporaryDirectory(prefix="surface_") as folder:
        path = Path(folder) / "surface.npz"
        np.savez(path, vertices_m=vertices_m, triangles=triangles)
        return _made("surface", path, size_m)


def _made(kind: str, path: Path, size_m: float) -> tuple[Array, Ints]:
    """Points and cells that a job makes; cells are triangles where the size is 0."""
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
            return mesh["points_m"], mesh["cells"]
