"""Contact laws of grains with grains and with walls, and the background damping."""

from __future__ import annotations

import math
from typing import Any, Literal

from pydantic import Field

from sandmould.scenario.quantity import Section, quantity
from sandmould.scenario.sand import ARGUED, PAPER


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

    @property
    def restitution(self) -> float:
        """Restitution of the undamped-tension reading, e = exp(-pi zeta / sqrt(1 - zeta^2)).

        Critical damping gives 0, for which LAMMPS takes a number too small to matter.
        """
        z = self.damping_ratio
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
    no_tension: Literal["total", "elastic"] = quantity(
        "total",
        "What eq. (18) keeps from pulling: the total normal force, or its elastic part alone.",
        source=ARGUED,
    )
    rolling_axes: Literal["tangent", "all"] = quantity(
        "tangent",
        "Relative spins that the rolling moment resists in 3D: those that roll, or, as eq. (31) "
        "reads, twist about the normal too.",
        source=ARGUED,
    )

    def parameters(self, law: ContactLaw, dimension: int) -> dict[str, Any]:
        """Give all that one law computes with, by the short names of decks and solvers.

        Parameters
        ----------
        law : ContactLaw
            One of the two.
        dimension : int
        """
        return {
            **{symbol: getattr(law, key) for symbol, key in SYMBOLS.items()},
            "clip_total": self.no_tension == "total",
            "torsion": dimension == 3 and self.rolling_axes == "all",
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
