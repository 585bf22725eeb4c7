"""Static equilibrium of a pattern that bends far: Newton's method in steps of the load."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pattern_fe.elasticity import displacement_gradient, element_stiffness_n_m, internal_force_n
from pattern_fe.factor import factorised
from pattern_fe.material import Foam
from pattern_fe.space import Space
from pattern_fe.supports import Mask

Array = NDArray[np.float64]
_HALVINGS = 8
"""Of a step of Newton's method, before the load is halved instead."""


class LoadNotReachedError(RuntimeError):
    """No equilibrium was found under the whole load."""

    def __init__(self, fraction: float) -> None:
        self.fraction = fraction
        """Share of the load that the last equilibrium carries."""
        super().__init__(
            f"the pattern finds no equilibrium beyond {100 * fraction:.1f} % of its load: it "
            "buckles, folds or is loaded too far for its elastic law; valid is a smaller load"
        )


@dataclass(frozen=True)
class NewtonSettings:
    """How the load is applied and when a state counts as equilibrium."""

    load_steps: int = 1
    """Equal steps at first; a step that fails is halved, one that succeeds doubles the next."""
    smallest_step: float = 1.0 / 256.0
    """Share of the load below which halving stops."""
    tolerance: float = 1e-9
    """Largest residual force over the largest force at a node, loads and reactions."""
    iterations: int = 25
    """In one step."""

    def __post_init__(self) -> None:
        if self.load_steps < 1:
            raise ValueError(f"number of load steps is {self.load_steps}, valid is 1 or more")


class _Equilibrium:
    """One pattern under growing dead loads."""

    def __init__(self, space: Space, foam: Foam, bedding: Array, fixed: Mask) -> None:
        self.space = space
        self.foam = foam
        self.bedding = bedding
        self.free = np.flatnonzero(~fixed.ravel())

    def force_n(self, displacement_m: Array) -> Array:
        spring = self.bedding[:, None] * displacement_m
        return internal_force_n(self.space, self.foam, displacement_m) + spring

    def newton_step_m(self, displacement_m: Array, residual_n: Array) -> Array:
        matrices = element_stiffness_n_m(self.space, self.foam, displacement_m)
        tangent = self.space.assembled(matrices)
        tangent.setdiag(tangent.diagonal() + np.repeat(self.bedding, self.space.dimension))
        step = np.zeros(displacement_m.size)
        part = tangent[self.free][:, self.free]
        step[self.free] = factorised(part).solve(residual_n.ravel()[self.free])
        return step.reshape(displacement_m.shape)

    def residual_n(self, displacement_m: Array, load_n: Array) -> tuple[Array, float]:
        """Load that is not in balance at free components, and the largest force of all."""
        force = self.force_n(displacement_m)
        residual = np.zeros(force.size)
        residual[self.free] = (load_n - force).ravel()[self.free]
        largest = max(float(np.abs(force).max()), float(np.abs(load_n).max()))
        return residual.reshape(force.shape), largest

    def solve(self, displacement_m: Array, load_n: Array, settings: NewtonSettings) -> Array | None:
        """State under a load, found from one nearby, or None."""
        residual, largest = self.residual_n(displacement_m, load_n)
        for _ in range(settings.iterations):
            if np.abs(residual).max() <= settings.tolerance * largest:
                return displacement_m
            try:
                step = self.newton_step_m(displacement_m, residual)
            except RuntimeError:
                # the tangent is singular: a limit point
                return None
            searched = self._searched(displacement_m, step)
            if searched is None:
                return None
            displacement_m = searched
            residual, largest = self.residual_n(displacement_m, load_n)
        return None

    def _searched(self, displacement_m: Array, step_m: Array) -> Array | None:
        """Halve a step until it turns no element inside out, where the law has false equilibria.

        Nothing more is asked of it. Bending stretches elements at first and takes that back in
        the next step: a search for less residual work along the step took three to eight times
        as many steps to the elastica, and went no farther.
        """
        for halvings in range(_HALVINGS):
            tried = displacement_m + step_m / 2**halvings
            slope = displacement_gradient(self.space, tried)
            volume = np.linalg.det(np.eye(self.space.dimension) + slope)
            if (volume > 0.0).all():
                return tried
        return None


def solve_large(
    space: Space,
    foam: Foam,
    bedding: Array,
    fixed: Mask,
    load_n: Array,
    settings: NewtonSettings,
) -> Array:
    """Displacements under dead loads in the total Lagrangian form.

    Parameters
    ----------
    space : Space
    foam : Foam
    bedding : (n,) float64, N/m
        Springs at the nodes.
    fixed : (n, d) bool
    load_n : (n, d) float64, N
    settings : NewtonSettings

    Returns
    -------
    (n, d) float64, m

    Raises
    ------
    LoadNotReachedError
        When the iteration fails in the smallest load step.
    """
    equilibrium = _Equilibrium(space, foam, bedding, fixed)
    displacement, reached, step = np.zeros_like(space.node_m), 0.0, 1.0 / settings.load_steps
    while reached < 1.0:
        target = min(1.0, reached + step)
        # a last sliver from round-off joins the step
        target = 1.0 if target > 1.0 - 1e-9 else target
        equilibrium_m = equilibrium.solve(displacement, target * load_n, settings)
        if equilibrium_m is None:
            step /= 2.0
            if step < settings.smallest_step:
                raise LoadNotReachedError(reached)
        else:
            displacement, reached = equilibrium_m, target
            step = min(2.0 * step, 1.0 / settings.load_steps)
    return displacement
