"""Static equilibrium of a pattern that bends far: Newton's method in steps of the load."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array, kron

from sandmould.pattern_fe.contact import touch
from sandmould.pattern_fe.elasticity import (
    displacement_gradient,
    element_tangent_n_m,
    internal_force_n,
)
from sandmould.pattern_fe.material import Foam
from sandmould.pattern_fe.space import Space, factorised
from sandmould.pattern_fe.supports import Mask
from sandmould.pattern_fe.surroundings import Surroundings

Array = NDArray[np.float64]
_OVERLAP = 1e-6
"""Share of the pattern's extent by which it may reach into what surrounds it."""
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

    def __init__(
        self,
        space: Space,
        foam: Foam,
        bedding: csc_array,
        fixed: Mask,
        motion: csr_array,
        surroundings: Surroundings | None,
    ) -> None:
        self.space = space
        self.foam = foam
        self.bedding = bedding
        self.free = np.flatnonzero(~fixed.ravel())
        self.motion, self.surroundings = motion, surroundings
        self.contact_n = np.zeros((motion.shape[0], fixed.shape[1]))
        """(nv, d) float64, N: loads of what stands in the way, in the last iteration."""

    def force_n(self, displacement_m: Array) -> Array:
        spring = (self.bedding @ displacement_m.ravel()).reshape(displacement_m.shape)
        return internal_force_n(self.space, self.foam, displacement_m) + spring

    def newton_step_m(self, displacement_m: Array, residual_n: Array) -> Array:
        """Step under a residual without reactions of contact, which it finds too."""
        matrices = element_tangent_n_m(self.space, self.foam, displacement_m)
        tangent = self.space.assembled(matrices) + self.bedding
        factor = factorised(tangent[self.free][:, self.free])

        def solved(load_n: Array) -> Array:
            step = np.zeros_like(load_n)
            step[self.free] = factor.solve(load_n[self.free])
            return step

        step = solved(residual_n.ravel())
        if self.surroundings is not None:
            motion, shape = self.motion, displacement_m.shape
            of_components = csr_array(kron(motion, np.eye(shape[1])))

            def response(load_n: Array) -> Array:
                return np.asarray(of_components @ solved(of_components.T @ load_n))

            at = motion @ displacement_m
            led = at + motion @ step.reshape(shape)
            pressed = np.asarray(self.contact_n.any(axis=1))
            touched = touch(self.surroundings, at, led, response, pressed)
            self.contact_n = np.zeros_like(at) if touched is None else touched.load_n
            if touched is not None:
                step = solved((residual_n + motion.T @ self.contact_n).ravel())
        return step.reshape(displacement_m.shape)

    def residual_n(self, displacement_m: Array, load_n: Array) -> tuple[Array, float]:
        """Load that is not in balance at free components, and the largest force of all."""
        force = self.force_n(displacement_m)
        residual = np.zeros(force.size)
        residual[self.free] = (load_n - force).ravel()[self.free]
        largest = max(float(np.abs(force).max()), float(np.abs(load_n).max()))
        return residual.reshape(force.shape), largest

    def is_open(self, displacement_m: Array) -> bool:
        """Whether the surface is outside what surrounds it, to a millionth of its extent."""
        if self.surroundings is None:
            return True
        around, moved_m = self.surroundings, self.motion @ displacement_m
        if around.is_clear(moved_m):
            return True
        return around.deepest_m(moved_m) <= _OVERLAP * around.extent_m

    def solve(self, displacement_m: Array, load_n: Array, settings: NewtonSettings) -> Array | None:
        """State under a load, found from one nearby, or None."""
        for _ in range(settings.iterations):
            residual, largest = self.residual_n(displacement_m, load_n)
            left = np.abs(residual + self._pressed(residual)).max()
            if left <= settings.tolerance * largest and self.is_open(displacement_m):
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
        return None

    def _pressed(self, residual_n: Array) -> Array:
        """Reactions of contact at free components."""
        pressed = np.zeros(residual_n.size)
        pressed[self.free] = (self.motion.T @ self.contact_n).ravel()[self.free]
        return pressed.reshape(residual_n.shape)

    def _searched(self, displacement_m: Array, step_m: Array) -> Array | None:
        """Halve a step until it turns no element inside out, where the law has false equilibria."""
        # A search for less residual work took three to eight times as many steps to the elastica:
        # bending stretches elements at first and takes that back in the next step.
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
    bedding: csc_array,
    fixed: Mask,
    load_n: Array,
    settings: NewtonSettings,
    motion: csr_array,
    surroundings: Surroundings | None = None,
) -> tuple[Array, Array]:
    """Displacements under dead loads in the total Lagrangian form, and reactions of contact.

    Parameters
    ----------
    bedding : (n d, n d) sparse float64, N/m
        Springs.
    fixed : (n, d) bool
    load_n : (n, d) float64, N
    motion : (nv, n) sparse float64
        Of the surface that the sand meets; see ``Perimeter``.
    surroundings : Surroundings, optional
        What stands in the way; its gaps are linearised anew in every iteration.

    Returns
    -------
    displacement_m : (n, d) float64, m
    contact_n : (nv, d) float64, N
        On the vertices.

    Raises
    ------
    LoadNotReachedError
        When the iteration fails in the smallest load step.
    """
    equilibrium = _Equilibrium(space, foam, bedding, fixed, motion, surroundings)
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
    return displacement, equilibrium.contact_n
