"""What LIGGGHTS cannot do, said before it starts."""

from __future__ import annotations

from sandmould.engines.liggghts.contact_model import refuse_law
from sandmould.engines.session import RefusedError
from sandmould.scenario.scenario import Scenario

_HERE = "on engine liggghts"


def refuse(scenario: Scenario) -> None:
    """Refuse what this engine lacks.

    Raises
    ------
    RefusedError
        With one sentence.
    """
    if scenario.engine.ranks > 1:
        raise RefusedError("engine.ranks", scenario.engine.ranks, f"1 {_HERE}")
    if scenario.dimension == 2 and scenario.sand.disc_inertia == "disc":
        # Meshes need three dimensions, where a grain is a sphere.
        raise RefusedError("sand.disc_inertia", "disc", f"sphere {_HERE}")
    if scenario.time_step.rotational_inertia == "scaled":
        raise RefusedError("time_step.rotational_inertia", "scaled", f"physical {_HERE}")
    if scenario.record.orientation:
        raise RefusedError("record.orientation", True, f"false {_HERE}")
    _refuse_round_solids(scenario)
    _refuse_damping(scenario)
    refuse_law(scenario.contact)


def _refuse_round_solids(scenario: Scenario) -> None:
    """Meshes have flat facets; how many would do is for the user to say."""
    for i, obstacle in enumerate(scenario.obstacles):
        if obstacle.kind == "cylinder":
            valid = f"plate, tube, polygon or mesh {_HERE}"
            raise RefusedError(f"obstacles.{i}.kind", obstacle.kind, valid)
        if obstacle.kind == "tube" and scenario.dimension == 3 and obstacle.section == "round":
            raise RefusedError(f"obstacles.{i}.section", obstacle.section, f"facets {_HERE}")


def _refuse_damping(scenario: Scenario) -> None:
    damping = scenario.background_damping
    if damping.form not in ("none", "viscous"):
        raise RefusedError("background_damping.form", damping.form, f"none or viscous {_HERE}")
    if damping.form == "viscous" and damping.viscous_rotation_per_s > 0:
        raise RefusedError(
            "background_damping.viscous_rotation_per_s",
            damping.viscous_rotation_per_s,
            f"0 {_HERE}, which damps translation only",
        )
