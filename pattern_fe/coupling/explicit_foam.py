"""The foam pattern in motion, stepped with the grains by central differences."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array, kron

from sandmould.pattern_fe.contact import touch
from sandmould.pattern_fe.pattern import Pattern
from sandmould.pattern_fe.surroundings import Surroundings
from sandmould.scenario.scenario import Scenario

Array = NDArray[np.float64]
STABLE_SHARE = 0.8
"""Of what central differences bear: several grains may lean on one vertex at a slant."""


@dataclass(frozen=True)
class ContactBound:
    """The stiffest spring and dashpot that the sand can put on one vertex."""

    stiffness_n_m: float
    damping_n_s_m: float

    @classmethod
    def of_grain(cls, scenario: Scenario, diameter_m: float) -> ContactBound:
        """One contact of a grain, eq. (19)."""
        law = scenario.laws.grain_wall
        mass_kg = scenario.sand.grain_mass_kg(diameter_m, scenario.dimension)
        dashpot = law.dashpot_n_s_m(mass_kg, scenario.laws.lag_s(scenario.step_s))
        return cls(max(law.normal_stiffness_n_m, law.tangential_stiffness_n_m), dashpot)

    @classmethod
    def of(cls, scenario: Scenario, pattern: Pattern) -> ContactBound:
        """Contacts of the largest grains, as many as find room on a facet."""
        classes = scenario.sand.classes(scenario.dimension)
        largest = cls.of_grain(scenario, classes[-1].diameter_m)
        corner = pattern.surface.vertices_m[pattern.surface.facets]
        longest_m = float(np.linalg.norm(corner[:, 1] - corner[:, 0], axis=1).max())
        contacts = 1 + math.floor(longest_m / classes[0].diameter_m)
        return cls(contacts * largest.stiffness_n_m, contacts * largest.damping_n_s_m)

    def mass_kg(self, step_s: float) -> float:
        """Least mass of a vertex that such contacts do not throw.

        Dashpots take the velocity half a step ago, as the grains' do (section 3.5): M must be above
        dt C / 2 + dt^2 K / 4.
        """
        return 0.5 * step_s * self.damping_n_s_m + 0.25 * step_s**2 * self.stiffness_n_m


class ExplicitFoam:
    """A pattern with lumped, scaled masses under loads on its outer line; small displacements.

    Its energies obey the discrete balance of central differences to round-off: velocities live
    half a step from the displacements, and so does the elastic energy u_n K u_n+1 / 2.
    """

    def __init__(
        self,
        pattern: Pattern,
        step_s: float,
        contact: ContactBound,
        mass_scale: float | None = None,
        damping_ratio: float = 0.0,
        surroundings: Surroundings | None = None,
    ) -> None:
        """Stand at rest as drawn.

        ``mass_scale``: factor of all masses; just large enough for one step a step of the grains,
        and not below 1, unless given. With a smaller one the pattern goes in shorter steps.
        ``damping_ratio``: of the slowest mode, by mass damping. ``surroundings``: what it can
        touch; nothing unless given.

        Raises
        ------
        ValueError
            When the masses are too small for the contacts: no step of the pattern's own helps.
        """
        outer = pattern.surface.outer
        self._surface = outer.motion
        self.vertices_m = outer.vertices_m
        """Of the outer line as drawn, (nv, d) float64, m."""
        # 1/kg: how far an impulse on a vertex moves it
        mobile = (outer.motion**2) @ (~pattern.fixed / pattern.mass_kg[:, None])
        pressed = contact.mass_kg(step_s) * float(mobile.max())
        inner = (step_s / pattern.critical_step_s()) ** 2
        least = pressed / STABLE_SHARE
        if mass_scale is None:
            mass_scale = max(1.0, (inner + pressed) / STABLE_SHARE)
        elif mass_scale <= least:
            raise ValueError(
                f"mass scale of the pattern is {mass_scale:g}, valid is above {least:.3g} or a "
                f"shorter time step than {step_s:.3g} s: contacts would throw its lightest vertex"
            )
        self.mass_scale = mass_scale
        self.sub_steps = math.ceil(math.sqrt(inner / (STABLE_SHARE * mass_scale - pressed)) - 1e-9)
        """Steps of the pattern in one of the grains, under a load that stays."""
        self.first_hz = float(pattern.natural_frequencies_hz()[0]) / math.sqrt(mass_scale)
        """Lowest natural frequency with the masses scaled."""
        self._mass_kg = mass_scale * pattern.mass_kg[:, None]
        self._damping_1_s = 4.0 * math.pi * self.first_hz * damping_ratio
        self._motion = pattern.central_differences(
            step_s / self.sub_steps, self._damping_1_s, mass_scale
        )
        self._before = self._motion.displacement_m
        self.work_j = self.damped_j = self.contact_j = 0.0
        """Work of the loads, what damping took of it and what contact, since the start."""
        self.contact_n = np.zeros_like(self.vertices_m)
        """(nv, d) float64, N: of what it touches, in the last step."""
        self._surroundings = surroundings
        self._clearance = None if surroundings is None else surroundings.as_drawn
        of_components = csr_array(kron(outer.motion, np.eye(self.vertices_m.shape[1])))
        mobility = diags_array(self._motion.mobility_m_n.ravel())
        self._mobility_m_n = csr_array(of_components @ mobility @ of_components.T)

    @property
    def displacement_m(self) -> Array:
        """Of the vertices of the outer line, (nv, d) float64, m."""
        return np.asarray(self._surface @ self._motion.displacement_m)

    def advance(self, load_n: Array) -> None:
        """Go on by one step of the grains.

        ``load_n``, (nv, d) float64, N: on the outer line, at the start of the step.
        """
        motion = self._motion
        load = self._surface.T @ load_n
        for _ in range(self.sub_steps):
            self._before, velocity = motion.displacement_m, motion.velocity_m_s
            motion.advance(load)
            touched = self._kept_out()
            mean = 0.5 * (velocity + motion.velocity_m_s)
            self.work_j += motion.step_s * float(np.vdot(load, mean))
            lost = self._damping_1_s * float(np.vdot(self._mass_kg * mean, mean))
            self.damped_j += motion.step_s * lost
            self.contact_j -= motion.step_s * float(np.vdot(touched, self._surface @ mean))

    def _kept_out(self) -> Array:
        """Take the step anew with the forces of what the pattern would enter, and give them."""
        # Forward increment Lagrange multipliers, as in ``contact_step``: no rebound.
        around, free_m = self._surroundings, self.displacement_m
        self.contact_n = np.zeros_like(self.vertices_m)
        if around is None or around.is_clear(free_m, self._clearance):
            return self.contact_n
        before_m = self._surface @ self._before
        if not around.is_clear_of_solids(free_m, self._clearance):
            self._clearance = around.clearance(before_m)
        found = touch(around, before_m, free_m, lambda load_n: self._mobility_m_n @ load_n)
        if found is not None:
            self.contact_n = found.load_n
            self._motion.push(self._surface.T @ self.contact_n)
        return self.contact_n

    @property
    def kinetic_j(self) -> float:
        """Kinetic energy of the scaled masses, half a step ago."""
        velocity = self._motion.velocity_m_s
        return 0.5 * float(np.vdot(self._mass_kg * velocity, velocity))

    @property
    def elastic_j(self) -> float:
        """Elastic energy half a step ago, that of a bedding included."""
        return 0.5 * float(self._before.ravel() @ self._motion.internal_force_n.ravel())

    def state(self) -> dict[str, Array]:
        """All that moves, by name."""
        motion = self._motion
        return {
            "displacement": motion.displacement_m,
            "velocity": motion.velocity_m_s,
            "before": self._before,
            "energies": np.array([self.work_j, self.damped_j, self.contact_j]),
        }

    def restore(self, arrays: dict[str, Array]) -> None:
        """Go on from what ``state`` gave."""
        self._motion.displacement_m = arrays["displacement"]
        self._motion.velocity_m_s = arrays["velocity"]
        self._before = arrays["before"]
        self.work_j, self.damped_j, self.contact_j = (float(x) for x in arrays["energies"])
