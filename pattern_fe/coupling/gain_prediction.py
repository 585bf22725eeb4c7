"""The gain of the staggered loop predicted from the scenario alone, before any sand has moved.

Grains lie in a full row on all that faces up. Each stands on a contact, spring and dashpot, and
carries a column of sand that is free to move: in a window T a chain of springs k and masses m
answers an even motion by its impedance sqrt(k m), until the wave has run through the whole column
and its mass goes along. Contact and column are in series; what stiffness they have against the
mean displacement of a window, over that of the pattern, is the gain. The fixed share w then holds
while abs(1 - w (1 + g)) < 1. Left out are sand beside and under the pattern, arches, which make
the column a spring, and the friction of grains, which lets contacts go.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.linalg import LinearOperator, eigsh

from sandmould.pattern_fe.coupling.contact_rows import shares_along, shares_on_top
from sandmould.pattern_fe.coupling.explicit_foam import ContactBound
from sandmould.pattern_fe.coupling.gain import Gain
from sandmould.pattern_fe.pattern import Pattern
from sandmould.scenario.placement import plan_counts
from sandmould.scenario.scenario import Scenario

Array = NDArray[np.float64]
_UP = 0.5
"""Share of a vertex's area that must face up for grains to lie on it."""


def predicted_gain(scenario: Scenario, pattern: Pattern, window_s: float) -> Gain:
    """Stiffness of a grain times the largest compliance of the pattern under the whole row.

    Its ``limit`` is the largest fixed factor that holds.
    """
    row = _row(scenario, pattern)
    count, dimension = row.shape[0], scenario.dimension

    def moved_m(forces_n: Array) -> Array:
        load = row.T @ forces_n.reshape(count, dimension)
        moved = pattern.on_surface(pattern.solve_linear(pattern.on_nodes(load)))
        return np.asarray(row @ moved).ravel()

    softest_m_n, size = 0.0, count * dimension
    if count:
        compliance = LinearOperator((size, size), matvec=moved_m, dtype=np.float64)
        # Any start that is symmetric may be blind to the softest shape.
        start = np.random.default_rng(0).standard_normal(size)
        found = eigsh(compliance, 1, v0=start, tol=1e-6, return_eigenvectors=False)
        softest_m_n = float(found[0])
    return Gain(_grain_n_m(scenario, window_s) * softest_m_n)


def _row(scenario: Scenario, pattern: Pattern) -> csr_array:
    """Shape functions under mean grains side by side on what faces up, (grains, nv) float64."""
    diameter_m = scenario.sand.mean_diameter_m(scenario.dimension)
    if scenario.dimension == 3:
        return shares_on_top(pattern, diameter_m, _UP)
    area = pattern.surface.vertex_area_vector_m2
    faces_up = area[:, 1] > _UP * np.linalg.norm(area, axis=1)
    shares = shares_along(pattern, diameter_m)
    return csr_array(shares[shares @ faces_up > 1.0 - 1e-9])


def _grain_n_m(scenario: Scenario, window_s: float) -> float:
    """Stiffness of one contact and the column on it against the mean motion of a window."""
    diameter_m = scenario.sand.mean_diameter_m(scenario.dimension)
    contact = ContactBound.of_grain(scenario, diameter_m)
    contact_n_m = contact.stiffness_n_m + 2.0 * contact.damping_n_s_m / window_s
    mass_kg = scenario.sand.grain_mass_kg(diameter_m, scenario.dimension)
    spring_n_m = scenario.laws.grain_grain.normal_stiffness_n_m
    box = scenario.box
    in_column = sum(plan_counts(scenario)) * diameter_m / box.width_m
    if scenario.dimension == 3:
        in_column *= diameter_m / box.depth_m
    reached = window_s * math.sqrt(spring_n_m / mass_kg)
    column_n_m = 2.0 * mass_kg * max(1.0, min(in_column, reached)) / window_s**2
    return 1.0 / (1.0 / contact_n_m + 1.0 / column_n_m)
