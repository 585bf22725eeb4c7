"""Meshes that tests share: a cube, and the shipped bracket as its script makes it."""

from __future__ import annotations

import numpy as np

from sandmould.geometry.geometry import Block
from sandmould.geometry.mesh import TriangleMesh
from tests.bracket import bracket

CUBE = Block("cube", np.array([0.5, 0.5, 0.5]), np.array([0.5, 0.5, 0.5]), np.eye(3))
CORNERS, FACETS = CUBE.corners(), CUBE.facets()
SHIPPED = TriangleMesh("bracket", *bracket())
