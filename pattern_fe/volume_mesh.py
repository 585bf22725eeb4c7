"""Tetrahedra in a drawn solid."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from skfem import MeshTet

from sandmould.geometry.drawing_file import is_step
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.mesher import step_tetrahedra, surface_tetrahedra
from sandmould.limits import SOLID_ELEMENTS
from sandmould.pattern_fe.shapes import with_sides
from sandmould.scenario.pattern import PatternDrawing

Array = NDArray[np.float64]
_FILL = 5.0
"""Tetrahedra of an edge that fill its cube: 5.2 to 5.8 measured where parts are thick; thin ones
take more."""
_LARGEST_CHANGE = 0.1
"""Share of the drawing's volume that the mesh may lack or add: beyond it is another part."""


def drawing_mesh(shape: PatternDrawing, drawn: TriangleMesh, size_m: float) -> Any:
    """Fill a drawing with tetrahedra, the extreme sides named.

    ``drawn``: its surface, about the drawing's origin, turned. ``size_m``: longest side of an
    element, about.

    Raises
    ------
    BadInputError
        When the mesh would have too many elements.
    ValueError
        When it cannot be meshed, or the mesh is another part than the drawing.
    """
    SOLID_ELEMENTS.check("pattern.element_m", _FILL * drawn.measure / size_m**3, size_m)
    if is_step(shape.path):
        nodes_m, tetrahedra = step_tetrahedra(shape.path, size_m)
    else:
        nodes_m, tetrahedra = surface_tetrahedra(drawn.vertices_m, drawn.triangles, size_m)
    SOLID_ELEMENTS.check("pattern.element_m", len(tetrahedra), size_m)
    mesh = MeshTet(np.ascontiguousarray(nodes_m.T), np.ascontiguousarray(tetrahedra.T))
    edges = nodes_m[tetrahedra[:, 1:]] - nodes_m[tetrahedra[:, :1]]
    held = float(np.abs(np.linalg.det(edges)).sum()) / 6.0
    if abs(held / drawn.measure - 1.0) > _LARGEST_CHANGE:
        raise ValueError(
            f"its tetrahedra hold {held / drawn.measure:.0%} of the drawing's volume, valid is "
            f"90 to 110 %: a smaller pattern.element_m than {size_m:g} m follows round parts closer"
        )
    return with_sides(mesh)
