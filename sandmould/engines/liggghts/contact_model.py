"""The contact model of LIGGGHTS: coefficients for each pair of atom types, and what it lacks."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from sandmould.engines.deck_lines import Lines
from sandmould.engines.session import RefusedError
from sandmould.scenario.contact import Contact, ContactLaw

SizeClass = dict[str, Any]


@dataclass(frozen=True)
class PairTable:
    """One symmetric table: a row a size class, then one for the walls, then one for a gate."""

    name: str
    property: str
    """LIGGGHTS's name."""
    unit: str
    meaning: str
    source: str
    rows: list[list[float]]

    def without_gate(self) -> list[list[float]]:
        """Rows with the last type, the gate's, at zero."""
        last = len(self.rows) - 1
        return [[0.0 if last in (i, j) else x for j, x in enumerate(row)]
                for i, row in enumerate(self.rows)]  # fmt: skip


def damping_per_s(law: ContactLaw, mass_kg: float, lag_s: float) -> float:
    """LIGGGHTS's ``gamman``: it makes the dashpot c = m_eff gamman, and c = 2 zeta sqrt(k m_eff).

    ``mass_kg``: effective mass m1 m2/(m1 + m2) of a pair, m1 at a wall. ``lag_s``: that the dashpot
    makes up for.
    """
    ratio = law.dashpot_ratio(mass_kg, lag_s)
    return 2 * ratio * math.sqrt(law.normal_stiffness_n_m / mass_kg)


def rolling_friction(law: ContactLaw, first: SizeClass, second: SizeClass) -> float:
    """Give f = r_min tan(alpha) of eq. (32) over the effective radius r1 r2/(r1 + r2)."""
    low, high = sorted([first["diameter_m"], second["diameter_m"]])
    return float(law.rolling_arm_fraction * (1 + low / high))


def pair_tables(
    contact: Contact,
    classes: list[SizeClass],
    lines: Lines,
    step_s: float,
    has_gate: bool = False,
) -> list[PairTable]:
    """All tables of a scenario.

    ``classes``: as ``sandmould.engines.deck_lines.size_classes`` gives them. ``has_gate``: whether
    a plate has a type of its own, alike to that of the walls until it is taken away.
    """
    flat = 2 if has_gate else 1
    grain, wall = contact.grain_grain, contact.grain_wall
    lag_s = contact.lag_s(step_s)
    ratio = "zeta/(1 + zeta omega dt/2)" if lag_s else "zeta"

    def table(
        name: str,
        liggghts: str,
        unit: str,
        meaning: str,
        key: str,
        of_pair: Callable[[SizeClass, SizeClass], float],
        of_wall: Callable[[SizeClass], float],
    ) -> PairTable:
        rows = [[of_pair(i, j) for j in classes] + flat * [of_wall(i)] for i in classes]
        # Walls never meet walls; LIGGGHTS wants a number all the same.
        rows += flat * [[of_wall(j) for j in classes] + flat * [of_wall(classes[0])]]
        keys = [f"contact.{law}.{key}" for law in ("grain_grain", "grain_wall")]
        sources = [lines.source(k) + lines.in_use(k)[1] for k in keys]
        source = " and ".join(dict.fromkeys(sources))
        return PairTable(name, liggghts, unit, meaning, source, rows)

    def constant(key: str) -> dict[str, Any]:
        pair, at_wall = getattr(grain, key), getattr(wall, key)
        return {"key": key, "of_pair": lambda i, j: pair, "of_wall": lambda i: at_wall}

    def damping(i: SizeClass, j: SizeClass) -> float:
        mass = i["mass_kg"] * j["mass_kg"] / (i["mass_kg"] + j["mass_kg"])
        return damping_per_s(grain, mass, lag_s)

    tables = [
        table("k_n", "kn", "N/m", "normal spring", **constant("normal_stiffness_n_m")),
        table("k_t", "kt", "N/m", "tangential spring", **constant("tangential_stiffness_n_m")),
        table(
            "damping_n", "gamman", "1/s", f"2 omega {ratio}, omega^2 = k_n/m_eff", "damping_ratio",
            damping, lambda i: damping_per_s(wall, i["mass_kg"], lag_s),
        ),
        table(
            "damping_t", "gammat", "1/s", "no tangential dashpot", "damping_ratio",
            lambda i, j: 0.0, lambda i: 0.0,
        ),
        table("friction", "coefficientFriction", "-", "Coulomb mu", **constant("friction")),
    ]  # fmt: skip
    if rolling_model(contact) is not None:
        tables.append(
            table(
                "rolling", "coefficientRollingFriction", "-",
                "f over the effective radius, tan(alpha) (1 + r_min/r_max), tan(alpha) at walls",
                "rolling_arm_fraction", lambda i, j: rolling_friction(grain, i, j),
                lambda i: wall.rolling_arm_fraction,
            )
        )  # fmt: skip
    return tables


@dataclass(frozen=True)
class RollingModel:
    """How LIGGGHTS says the rolling moment."""

    name: str
    """After ``rolling_friction``."""
    twists: bool
    """Whether twist about the normal is resisted too, its switch ``torsionTorque``."""


def rolling_model(contact: Contact) -> RollingModel | None:
    """Give the rolling model of all contacts; None where no contact has a rolling moment."""
    if contact.grain_grain.rolling_arm_fraction + contact.grain_wall.rolling_arm_fraction > 0:
        return RollingModel("epsd2", contact.rolling_axes == "all")
    return None


def refuse_law(contact: Contact) -> None:
    """Refuse a law that the contact model cannot say (RefusedError)."""
    if contact.slip_normal == "half_step":
        raise RefusedError("contact.slip_normal", "half_step", "full_step on engine liggghts")
    for name in ("grain_grain", "grain_wall"):
        law = getattr(contact, name)
        spring = law.tangential_stiffness_n_m
        if law.rolling_arm_fraction > 0 and law.rolling_stiffness_n_m != spring:
            raise RefusedError(
                f"contact.{name}.rolling_stiffness_n_m",
                law.rolling_stiffness_n_m,
                f"{spring:g}, the tangential stiffness, on engine liggghts",
            )
