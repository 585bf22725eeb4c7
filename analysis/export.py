"""Snapshots, the solids among the grains, and elements of heat, for ParaView and OVITO."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import meshio
import numpy as np
from numpy.typing import NDArray

from sandmould.engines.snapshot import Snapshot
from sandmould.geometry.geometry import Array, Block, Scene, Solid
from sandmould.geometry.outline import Outline
from sandmould.geometry.revolved import Revolved
from sandmould.runs.files import replaced

_OF_ELEMENTS = (
    "frozen_s",
    "temperature_k",
    "melts",
    "riser",
    "modulus_m",
    "flows_s",
    "cooling_k_s",
    "gradient_k_m",
    "niyama_sqrt_ks_m",
)
_COLUMNS = "id type x y z vx vy vz omegax omegay omegaz radius layer"


def to_vtk(snapshot: Snapshot, path: Path) -> None:
    """Write the grains as points with their data, for ParaView (.vtu).

    Each grain is a vertex cell with ``id``, ``layer``, ``radius_m``, ``velocity_m_s``,
    ``spin_rad_s`` and, the same for all, ``time_s`` and ``vibration_time_s``: meshio writes no
    field data, where a time would belong. Points of 2D lie at z = 0.
    """
    n = len(snapshot.id)
    mesh = meshio.Mesh(
        _in_space(snapshot.position_m),
        [("vertex", np.arange(n)[:, None])],
        point_data={
            "id": snapshot.id,
            "layer": snapshot.layer,
            "radius_m": snapshot.radius_m,
            "velocity_m_s": _in_space(snapshot.velocity_m_s),
            "spin_rad_s": snapshot.spin_rad_s,
            "time_s": np.full(n, snapshot.time_s),
            "vibration_time_s": np.full(n, snapshot.vibration_time_s),
        },
    )
    with replaced(path) as partial:
        mesh.write(partial, file_format="vtu")


def solids_to_vtk(scene: Scene, path: Path) -> None:
    """Write the surfaces of all solids, for ParaView (.vtu): lines in 2D, triangles in 3D.

    Each cell has the number of its ``solid``, from 0, in the order of ``Scene.solids``. A round
    solid has 128 sides. Points of 2D lie at z = 0.
    """
    points_m, cells, numbers = [np.zeros((0, 3))], [], []
    for number, solid in enumerate(scene.solids):
        vertices_m, facets = _surface(solid)
        cells.append(facets + sum(len(p) for p in points_m))
        points_m.append(_in_space(vertices_m))
        numbers.append(np.full(len(facets), number))
    kind = "line" if scene.dimension == 2 else "triangle"
    blocks = [(kind, np.concatenate(cells))] if cells else []
    data = {"solid": [np.concatenate(numbers)]} if cells else {}
    mesh = meshio.Mesh(np.concatenate(points_m), blocks, cell_data=data)
    with replaced(path) as partial:
        mesh.write(partial, file_format="vtu")


_SQUARE = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
_CUBE = np.vstack([np.pad(_SQUARE, ((0, 0), (0, 1)), constant_values=z) for z in (0, 1)])


def elements_to_vtk(fields: Mapping[str, Array], path: Path) -> None:
    """Write elements of heat as squares or cubes with their data, for ParaView (.vtu).

    Elements that touch share corners. Cells have ``frozen_s``, ``temperature_k`` and ``melts`` (1
    in the casting). ``fields``: arrays ``position_m`` (n, d), ``size_m`` (n,) and those of the
    cells, (n,).
    """
    position_m, size_m = fields["position_m"], fields["size_m"]
    dimensions = position_m.shape[1]
    kind, corners = ("quad", _SQUARE) if dimensions == 2 else ("hexahedron", _CUBE)
    low_m = (position_m - 0.5 * size_m[:, None]).min(axis=0)
    # all corners lie on the grid of the smallest element's
    start = np.rint((position_m - 0.5 * size_m[:, None] - low_m) / size_m.min())
    span = np.rint(size_m / size_m.min())
    places = (start[:, None] + corners * span[:, None, None]).astype(np.int64)
    shape = tuple(places.reshape(-1, dimensions).max(axis=0) + 1)
    numbers = np.ravel_multi_index(tuple(np.moveaxis(places, -1, 0)), shape)
    points, cells = np.unique(numbers, return_inverse=True)
    points_m = low_m + size_m.min() * np.column_stack(np.unravel_index(points, shape))
    data = {name: [np.asarray(fields[name], dtype=np.float64)] for name in _OF_ELEMENTS}
    blocks = [(kind, cells.reshape(-1, len(corners)))]
    mesh = meshio.Mesh(_in_space(points_m), blocks, cell_data=data)
    with replaced(path) as partial:
        mesh.write(partial, file_format="vtu")


def _surface(solid: Solid) -> tuple[Array, NDArray[np.int64]]:
    """Vertices of a solid and the facets between them."""
    if isinstance(solid, Outline):
        start = np.arange(len(solid.vertices_m))
        return solid.vertices_m, np.column_stack([start, np.roll(start, -1)])
    if isinstance(solid, Block):
        return solid.corners(), solid.facets()
    mesh = solid.mesh() if isinstance(solid, Revolved) else solid
    return mesh.vertices_m, mesh.triangles


def to_ovito(snapshot: Snapshot, path: Path) -> None:
    """Write the grains as a LAMMPS text dump of one frame, which OVITO opens.

    The type is the layer, so that OVITO colours layers at once. The time step, a whole number, is
    the simulated time in microseconds. The box just holds the grains.
    """
    position_m, radius_m = _in_space(snapshot.position_m), snapshot.radius_m[:, None]
    low_m = (position_m - radius_m).min(axis=0, initial=np.inf)
    high_m = (position_m + radius_m).max(axis=0, initial=-np.inf)
    header = [
        "ITEM: TIMESTEP",
        str(round(snapshot.time_s * 1e6)),
        "ITEM: TIME",
        f"{snapshot.time_s:.16g}",
        "ITEM: NUMBER OF ATOMS",
        str(len(snapshot.id)),
        "ITEM: BOX BOUNDS ff ff ff",
        *(f"{low:.16g} {high:.16g}" for low, high in zip(low_m, high_m, strict=True)),
        f"ITEM: ATOMS {_COLUMNS}",
    ]
    table = np.column_stack(
        [
            snapshot.id,
            snapshot.layer,
            position_m,
            _in_space(snapshot.velocity_m_s),
            snapshot.spin_rad_s,
            radius_m,
            snapshot.layer,
        ]
    )
    # ten digits: less than a nanometre on a metre of box
    formats = ["%d", "%d", *["%.10g"] * 10, "%d"]
    with replaced(path) as partial:
        np.savetxt(partial, table, fmt=formats, header="\n".join(header), comments="")


def _in_space(vector: Array) -> Array:
    """Vectors of 2D with a third component of zero."""
    return np.pad(vector, ((0, 0), (0, 3 - vector.shape[1])))
