"""What LAMMPS cannot do, said before it starts."""

from __future__ import annotations

from sandmould.engines.lammps.render import needs_callback
from sandmould.engines.session import RefusedError
from sandmould.scenario.scenario import Scenario


def refuse(scenario: Scenario) -> None:
    """Refuse what this engine lacks.

    Raises
    ------
    RefusedError
        With one sentence.
    """
    if scenario.dimension == 3 and scenario.contact.rolling_axes == "all":
        raise RefusedError("contact.rolling_axes", "all", "tangent on engine lammps in 3D")
    if scenario.time_step.rotational_inertia == "scaled":
        raise RefusedError("time_step.rotational_inertia", "scaled", "physical on engine lammps")
    if scenario.record.orientation:
        raise RefusedError("record.orientation", True, "false on engine lammps")
    if scenario.engine.ranks > 1 and needs_callback(scenario):
        # The force callback lives in one process.
        valid = "1 on engine lammps with polygons, round solids, meshes or isotropic damping"
        raise RefusedError("engine.ranks", scenario.engine.ranks, valid)
