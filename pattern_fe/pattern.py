"""The foam pattern as an elastic body: statics, modes and explicit motion."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, diags_array, kron
from scipy.sparse.linalg import SuperLU

from sandmould.geometry.geometry import Scene
from sandmould.pattern_fe import dynamics
from sandmould.pattern_fe.condensation import CondensedSurface, condensed_surface
from sandmould.pattern_fe.elasticity import (
    displacement_gradient,
    green_strain,
    small_strain,
    von_mises_pa,
)
from sandmould.pattern_fe.large_displacement import NewtonSettings, solve_large
from sandmould.pattern_fe.material import Foam
from sandmould.pattern_fe.motion import CentralDifferences
from sandmould.pattern_fe.perimeter import perimeter_of
from sandmould.pattern_fe.space import factorised, space_of
from sandmould.pattern_fe.supports import Supports, check_held, fixed_components, loose_motions
from sandmould.pattern_fe.surroundings import Surroundings
from sandmould.pattern_fe.weak_forms import element_stiffness_n_m

Array = NDArray[np.float64]
_NEWTON = NewtonSettings()


class Pattern:
    """Mesh, foam and supports of one pattern.

    Displacements and loads are arrays of one row a node, ``(n, d)``, or of one row a vertex of
    the surface, ``(nv, d)``. ``on_nodes`` for loads and ``on_surface`` for displacements lead from
    one to the other; each is the transpose of the other, see ``perimeter``.

    ``mesh``: from ``shapes`` or ``mesh_file``. ``order``: of the elements: 2, or 1 as in the paper,
    which is too stiff in bending. ``thickness_m``: out of the plane; in 2D it must be given, in 3D
    it must not.

    Raises
    ------
    ValueError
        When the mesh is no pattern or the supports do not fit it.
    """

    def __init__(
        self,
        mesh: Any,
        supports: Supports,
        foam: Foam | None = None,
        order: int = 2,
        thickness_m: float | None = None,
    ) -> None:
        self.foam = foam or Foam()
        self.supports = supports
        self.space = space_of(mesh, order, thickness_m)
        self.fixed = fixed_components(self.space, supports)
        """(n, d) bool: components that do not move."""
        self.surface = perimeter_of(self.space)
        """As drawn."""

    @cached_property
    def _bedding_n_m(self) -> csc_array:
        """Springs of the bedding at the vertices, (n d, n d) sparse float64, N/m."""
        motion, area = self.surface.motion, diags_array(self.surface.vertex_area_m2)
        of_nodes = self.supports.bedding_n_m3 * (motion.T @ area @ motion)
        return csc_array(kron(of_nodes, np.eye(self.space.dimension)))

    @cached_property
    def stiffness(self) -> csc_array:
        """Of small displacements, bedding included, (n d, n d) sparse float64, N/m."""
        matrix = self.space.assembled(element_stiffness_n_m(self.space, self.foam))
        return matrix + self._bedding_n_m

    @cached_property
    def mass_kg(self) -> Array:
        """Lumped, of each node, (n,) float64."""
        return dynamics.lumped_mass_kg(self.space, self.foam)

    @cached_property
    def _free(self) -> NDArray[np.int64]:
        return np.flatnonzero(~self.fixed.ravel())

    @cached_property
    def _factor(self) -> SuperLU:
        check_held(self.space, self.fixed, self.supports)
        return factorised(self.stiffness[self._free][:, self._free])

    @property
    def factor_numbers(self) -> int:
        """Numbers that the factorised stiffness holds; none of a free pattern."""
        return 0 if self.is_free else int(self._factor.nnz)

    @cached_property
    def _loose_motions(self) -> int:
        bedded = self.supports.bedding_n_m3 > 0.0
        return 0 if bedded else len(loose_motions(self.space, self.fixed))

    @property
    def is_free(self) -> bool:
        """Whether it can move without deforming."""
        return self._loose_motions > 0

    def on_nodes(self, values: Array) -> Array:
        """Loads on vertices as those on all nodes, 0 inside."""
        return np.asarray(self.surface.motion.T @ values)

    def on_surface(self, values: Array) -> Array:
        """Displacements of all nodes as those of the vertices of the surface."""
        return np.asarray(self.surface.motion @ values)

    def solve_linear(self, load_n: Array) -> Array:
        """Small displacements under loads; the first call factorises, the others reuse it.

        Gives (n, d) float64, m. ``load_n``: (n, d) float64, N.

        Raises
        ------
        ValueError
            When the pattern is not held, or the loads are not finite.
        """
        self._check_load(load_n)
        displacement = np.zeros(load_n.size)
        displacement[self._free] = self._factor.solve(load_n.ravel()[self._free])
        return displacement.reshape(load_n.shape)

    def solve_large(
        self,
        load_n: Array,
        surroundings: Surroundings | None = None,
        settings: NewtonSettings = _NEWTON,
    ) -> tuple[Array, Array]:
        """Large displacements under dead loads, and reactions of obstacles; see ``solve_large``."""
        self._check_load(load_n)
        check_held(self.space, self.fixed, self.supports)
        return solve_large(
            self.space,
            self.foam,
            self._bedding_n_m,
            self.fixed,
            load_n,
            settings,
            self.surface.outer.motion,
            surroundings,
        )

    def spread(self, outer_m: Array) -> Array:
        """Displacement of all nodes at rest for a given one of the outer surface; small ones.

        Gives (n, d) float64, m. ``outer_m``, (nv, d) float64, m: of the vertices of the outer
        surface.
        """
        d = self.space.dimension
        whole = np.zeros_like(self.space.node_m)
        outer = self.surface.outer
        nodes, there = outer.nodes, outer.motion[:, outer.nodes]
        whole[nodes] = factorised(csc_array(there.T @ there)).solve(there.T @ outer_m)
        inner = np.setdiff1d(self._free, (d * nodes[:, None] + np.arange(d)).ravel())
        if len(inner):
            pull_n = -(self.stiffness @ whole.ravel())[inner]
            whole.ravel()[inner] = factorised(self.stiffness[inner][:, inner]).solve(pull_n)
        return whole

    def surrounded(self, scene: Scene, own_name: str = "", reach_m: float = np.inf) -> Surroundings:
        """What the pattern can touch of a scene; see ``Surroundings``."""
        outer = self.surface.outer
        return Surroundings(scene, outer, outer.held(self.fixed), own_name, reach_m)

    def _check_load(self, load_n: Array) -> None:
        valid = self.space.node_m.shape
        if load_n.shape != valid:
            raise ValueError(
                f"loads on the pattern have the shape {load_n.shape}, valid is {valid}"
            )
        if not np.isfinite(load_n).all():
            raise ValueError("loads on the pattern have a component that is not finite")

    def stress_pa(self, displacement_m: Array, large: bool = False) -> Array:
        """Stress at the integration points: Cauchy's where displacements are large.

        Gives (ne, q, d, d) float64, Pa. ``displacement_m``: (n, d) float64, m.
        """
        slope = displacement_gradient(self.space, displacement_m)
        if not large:
            return self.foam.stress_pa(small_strain(slope))
        second = self.foam.stress_pa(green_strain(slope))
        deformation = np.eye(self.space.dimension) + slope
        pushed = deformation @ second @ np.swapaxes(deformation, -1, -2)
        return np.asarray(pushed / np.linalg.det(deformation)[..., None, None])

    def energy_j(self, displacement_m: Array, large: bool = False) -> float:
        """Elastic energy, that of a bedding among it; arguments as ``stress_pa``."""
        slope = displacement_gradient(self.space, displacement_m)
        strain = green_strain(slope) if large else small_strain(slope)
        density = np.sum(strain * self.foam.stress_pa(strain), axis=(-2, -1))
        bedding = -np.vdot(self.bedding_force_n(displacement_m), displacement_m)
        return float(0.5 * (np.sum(density * self.space.weight) + bedding))

    def bedding_force_n(self, displacement_m: Array) -> Array:
        """Force of the bedding on the nodes, (n, d) float64, N."""
        return -(self._bedding_n_m @ displacement_m.ravel()).reshape(displacement_m.shape)

    def von_mises_pa(self, displacement_m: Array, large: bool = False) -> Array:
        """Mean equivalent stress of each element, (ne,) float64, Pa; arguments as ``stress_pa``."""
        equivalent = von_mises_pa(self.foam, self.stress_pa(displacement_m, large))
        return np.asarray(np.average(equivalent, axis=1, weights=self.space.weight))

    def compression_pa(self, displacement_m: Array, large: bool = False) -> Array:
        """Greatest mean compression of each element, whatever its direction, (ne,) float64, Pa."""
        weight = self.space.weight[..., None, None]
        mean = (weight * self.stress_pa(displacement_m, large)).sum(axis=1) / weight.sum(axis=1)
        return np.asarray(-np.linalg.eigvalsh(mean)[:, 0])

    def natural_frequencies_hz(self, count: int = 1) -> Array:
        """Lowest natural frequencies, ascending, (count,) float64; rigid motions are near 0."""
        mass = dynamics.as_diagonal(self.mass_kg, self.space.dimension)
        return dynamics.natural_frequencies_hz(
            self.space, self.foam, self.stiffness, mass, self.fixed, count
        )

    @cached_property
    def condensed(self) -> CondensedSurface:
        """Stiffness and mass on the vertices of the surface, for an engine's own steps.

        The whole mass is shared by area. Shares that follow the inner motion would bring the
        first frequency from 7 % low to 1 % low in an L, but leave single vertices very light.
        """
        area = self.surface.vertex_area_m2
        mass = self.mass_kg.sum() * area / area.sum()
        return condensed_surface(
            self.stiffness, mass, self.surface.motion, self.fixed, self._loose_motions
        )

    def critical_step_s(self) -> float:
        """Largest stable step of ``central_differences``, of the stiffest element and bedding."""
        elements2 = (2.0 / dynamics.critical_step_s(self.space, self.foam)) ** 2
        springs = abs(self._bedding_n_m).sum(axis=1).reshape(self.fixed.shape)
        bedding2 = float((springs / self.mass_kg[:, None]).max())
        return 2.0 * math.sqrt(1.0 / (elements2 + bedding2))

    def central_differences(
        self, step_s: float, damping_1_s: float = 0.0, mass_scale: float = 1.0
    ) -> CentralDifferences:
        """Explicit motion in small displacements, at rest on the drawing."""
        mass = mass_scale * self.mass_kg
        return CentralDifferences(self.stiffness.tocsr(), mass, self.fixed, step_s, damping_1_s)
