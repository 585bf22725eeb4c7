"""Contact laws of grains with grains and with walls, their springs, and the background damping."""

from __future__ import annotations

import math
from typing import Any, Literal

from pydantic import Field

from sandmould.scenario.quantity import Section, quantity
from sandmould.scenario.sand import ARGUED, PAPER, Sand


class ContactLaw(Section):
    """Linear springs, damping as a share of critical, Coulomb friction, rolling moment."""

    normal_stiffness_n_m: float = quantity(
        7e4, "Normal spring k_n of a contact, eq. (16).", unit="N/m", source=PAPER, gt=0, le=1e12
    )
    tangential_stiffness_n_m: float = quantity(
        7e4,
        "Tangential spring k_T of a contact, eq. (25).",
        unit="N/m",
        source=PAPER,
        gt=0,
        le=1e12,
    )
    friction: float = quantity(0.8, "Coulomb coefficient mu, eq. (26).", source=PAPER, ge=0, le=10)
    damping_ratio: float = quantity(
        1.0, "Normal damping over its critical value, eq. (21).", source=PAPER, ge=0, le=1
    )
    rolling_arm_fraction: float = quantity(
        0.1,
        "Eccentricity f of the normal force over the smaller radius, tan(alpha) of eq. (32).",
        source=PAPER,
        ge=0,
        le=1,
    )
    rolling_stiffness_n_m: float = quantity(
        7e4,
        "Spring that regularises the rolling moment, acting at the effective radius "
        "r1 r2/(r1 + r2).",
        unit="N/m",
        source=ARGUED,
        gt=0,
        le=1e12,
    )

    def stiffer(self, factor: float) -> ContactLaw:
        """The law with all of its springs multiplied."""
        springs = (key for key in type(self).model_fields if key.endswith("_stiffness_n_m"))
        return self.model_copy(update={key: factor * getattr(self, key) for key in springs})

    def dashpot_ratio(self, mass_kg: float, lag_s: float) -> float:
        """Damping ratio that a dashpot is given, c'/C_cr with c' = c/(1 + c lag/(4 m)).

        ``mass_kg``: m of eq. (21): m1 m2/(m1 + m2) of two grains, m1 at a wall.
        """
        omega = math.sqrt(self.normal_stiffness_n_m / mass_kg)
        return self.damping_ratio / (1 + 0.5 * self.damping_ratio * omega * lag_s)

    def dashpot_n_s_m(self, mass_kg: float, lag_s: float) -> float:
        """Coefficient of the dashpot, eqs. (19)-(21); the parameters of ``dashpot_ratio``."""
        critical = 2.0 * math.sqrt(mass_kg * self.normal_stiffness_n_m)
        return self.dashpot_ratio(mass_kg, lag_s) * critical


def restitution(damping_ratio: float) -> float:
    """Restitution of the undamped-tension reading, e = exp(-pi zeta / sqrt(1 - zeta^2)).

    Critical damping gives 0, for which LAMMPS takes a number too small to matter.
    """
    z = damping_ratio
    return 1e-100 if z == 1.0 else max(math.exp(-math.pi * z / math.sqrt(1 - z * z)), 1e-100)


SYMBOLS = {
    "k_n": "normal_stiffness_n_m",
    "k_t": "tangential_stiffness_n_m",
    "friction": "friction",
    "damping_ratio": "damping_ratio",
    "rolling_arm": "rolling_arm_fraction",
    "k_roll": "rolling_stiffness_n_m",
}
"""Key of a contact law for each of its numbers, by the short names of decks and solvers."""
WALL_LAW = ContactLaw(
    normal_stiffness_n_m=2e4,
    tangential_stiffness_n_m=2e4,
    friction=0.35,
    damping_ratio=0.95,
    rolling_stiffness_n_m=2e4,
)


class Contact(Section):
    """The two contact laws and how the paper's 'no tension' is read."""

    grain_grain: ContactLaw = Field(ContactLaw(), description="Law between two grains.")
    grain_wall: ContactLaw = Field(WALL_LAW, description="Law between a grain and a rigid wall.")
    springs_at_size_scale: float | None = quantity(
        4.0,
        "sand.size_scale that the springs belong to, with the default sieve curve. All springs are "
        "multiplied by the mass-median diameter over that one's, so that neither a scale nor a "
        "sieve curve makes sand harder. This holds in 3D and for discs as thick as a grain. null: "
        "springs are used as given.",
        source=PAPER,
        gt=0,
        le=100,
    )
    wave_speed_m_s: float | None = quantity(
        None,
        "Speed of a compression wave along a row of mass-median grains in contact. If it is "
        "given, all springs are multiplied by one factor so that it comes out.",
        unit="m/s",
        source="user",
        ge=1.0,
        le=1e4,
    )
    no_tension: Literal["total", "elastic"] = quantity(
        "total",
        "What eq. (18) keeps from pulling: the total normal force, or its elastic part alone.",
        source=ARGUED,
    )
    rolling_axes: Literal["tangent", "all"] = quantity(
        "tangent",
        "Relative spins that the rolling moment resists in 3D. tangent: those that roll. all: the "
        "twist about the normal too, as eq. (31) reads.",
        source=ARGUED,
    )

    dashpot: Literal["corrected", "plain"] = quantity(
        "corrected",
        "A dashpot sees the velocity of half a step ago. corrected: its coefficient is c' = c/(1 "
        "+ c dt/(4 m)), so that the mean restitution does not depend on the time step. plain: c "
        "as given.",
        source=ARGUED,
    )

    slip_normal: Literal["half_step", "full_step"] | None = quantity(
        None,
        "In 3D the slip of two grains is taken in the plane of a normal. half_step: the normal of "
        "half a step ago, as old as the velocities. full_step: that of the whole step; it traps "
        "small grains between large ones. Unless given, half_step on engine reference and "
        "full_step on LAMMPS, where half_step costs 1.16 times as much. LIGGGHTS has full_step "
        "alone.",
        source=ARGUED,
    )

    def stiffer(self, factor: float) -> Contact:
        """Both laws with all of their springs multiplied; a given wave speed goes as the root."""
        speed_m_s = self.wave_speed_m_s
        return self.model_copy(
            update={
                "grain_grain": self.grain_grain.stiffer(factor),
                "grain_wall": self.grain_wall.stiffer(factor),
                "wave_speed_m_s": speed_m_s and math.sqrt(factor) * speed_m_s,
            }
        )

    def lead_s(self, dimension: int, step_s: float) -> float:
        """Half the time step where the slip of two grains is that of half a step ago, else 0."""
        return 0.5 * step_s if dimension == 3 and self.slip_normal != "full_step" else 0.0

    def lag_s(self, step_s: float) -> float:
        """Time step whose lag the dashpots make up for, 0 where they do not."""
        return step_s if self.dashpot == "corrected" else 0.0

    def parameters(self, law: ContactLaw, dimension: int, step_s: float) -> dict[str, Any]:
        """Give all that one law computes with, by the short names of decks and solvers."""
        return {
            **{symbol: getattr(law, key) for symbol, key in SYMBOLS.items()},
            "clip_total": self.no_tension == "total",
            "torsion": dimension == 3 and self.rolling_axes == "all",
            "lag_s": self.lag_s(step_s),
            "lead_s": self.lead_s(dimension, step_s),
        }


class BackgroundDamping(Section):
    """Damping of free grains, eqs. (34)-(39)."""

    form: Literal["none", "viscous", "nonviscous_isotropic", "nonviscous_componentwise"] = quantity(
        "nonviscous_componentwise",
        "Form of the background damping; the paper's (38) is isotropic.",
        source=ARGUED,
    )
    nonviscous_translation: float = quantity(
        0.03, "alpha^nvt of eq. (38).", source=PAPER, ge=0, lt=1
    )
    nonviscous_rotation: float = quantity(0.3, "alpha^nvr of eq. (39).", source=PAPER, ge=0, lt=1)
    viscous_translation_per_s: float = quantity(
        0.0, "alpha^vt of eq. (36).", unit="1/s", source="not used by the paper's examples", ge=0
    )
    viscous_rotation_per_s: float = quantity(
        0.0, "alpha^vr of eq. (37).", unit="1/s", source="not used by the paper's examples", ge=0
    )


def wave_speed_m_s(sand: Sand, contact: Contact, dimension: int) -> float:
    """Speed of a compression wave along a straight row of mass-median grains, m/s.

    c = d sqrt(k_n/m) of equal masses m between springs k_n, a distance d apart and far shorter
    than the wave: sqrt(4 k_n/(pi rho b)) of discs of thickness b, sqrt(6 k_n/(pi rho d)) of
    spheres. A bed has more contacts a grain, in all directions, and its own speed
    (docs/hard_sand.md).

    ``contact``: springs as they are computed with.
    """
    diameter_m = sand.mass_median_diameter_m
    mass_kg = sand.grain_mass_kg(diameter_m, dimension)
    return diameter_m * math.sqrt(contact.grain_grain.normal_stiffness_n_m / mass_kg)


def spring_factor(sand: Sand, contact: Contact, dimension: int) -> float:
    """What the given springs are multiplied by."""
    if contact.wave_speed_m_s is not None:
        return (contact.wave_speed_m_s / wave_speed_m_s(sand, contact, dimension)) ** 2
    own_thickness = dimension == 2 and sand.disc_thickness_m != "grain"
    if contact.springs_at_size_scale is None or own_thickness:
        return 1.0
    return sand.size_scale / contact.springs_at_size_scale * coarser_than_default(sand)


def coarser_than_default(sand: Sand) -> float:
    """Mass-median diameter of the real sand over that of the default sieve curve."""
    return sand.real_median_m / Sand().real_median_m


def springs_in_use(sand: Sand, contact: Contact, dimension: int) -> Contact:
    """Contact laws with the springs that the scene is computed with.

    Pressure over stiffness stays when grains are coarsened, kappa = k_n/(P b) and k_n/(P d), and
    so does the wave speed: springs grow with the grains. A wave speed that is given settles them.
    """
    factor = spring_factor(sand, contact, dimension)
    if factor == 1.0:
        return contact
    return contact.stiffer(factor).model_copy(update={"wave_speed_m_s": contact.wave_speed_m_s})
