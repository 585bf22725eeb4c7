"""The contact law is the same in the scenario, the solver, LAMMPS's callback and each engine."""

from __future__ import annotations

from typing import Any, get_args

import numba
import numpy as np
import pytest
from pydantic.fields import FieldInfo

from sandmould.dem.contact_law import Law
from sandmould.engines.lammps.bridge import law_of
from sandmould.engines.program import build_program
from sandmould.engines.reference.model import scene_of
from sandmould.engines.registry import engine_module
from sandmould.engines.session import RefusedError
from sandmould.scenario.contact import SYMBOLS, Contact, ContactLaw
from sandmould.scenario.engine import ENGINE_NAMES, EngineName
from tests.scenes import tube_scene
from tests.verification.mutations import MUTATIONS

LAWS = ("grain_grain", "grain_wall")


def test_the_scenario_gives_all_that_the_solver_computes_with() -> None:
    contact = Contact()
    assert set(SYMBOLS.values()) == set(ContactLaw.model_fields)
    for dimension in (2, 3):
        parameters = contact.parameters(contact.grain_wall, dimension, 1e-6)
        assert set(parameters) == set(Law._fields)
        assert parameters["k_n"] == contact.grain_wall.normal_stiffness_n_m


@pytest.mark.parametrize("switches", [(True, False), (False, True)])
def test_compiled_code_reads_a_law_out_of_numbers(switches: tuple[bool, bool]) -> None:
    law = Law(1e4, 8e3, 0.4, 0.2, 0.1, 5e3, *switches)

    def read(numbers: Any) -> Any:
        return law_of(numbers)

    assert numba.njit(read)(np.array(law, dtype=float)) == law


def other_value(field: FieldInfo, now: Any) -> Any:
    """Another value that a key can have."""
    kinds = (field.annotation, *get_args(field.annotation))
    words = [each for kind in kinds for each in get_args(kind) if isinstance(each, str)]
    return next(each for each in words if each != now) if words else 0.5 * (now or 8.0)


def told(engine: EngineName, contact: dict[str, Any]) -> str | None:
    """What an engine is told of a scene in 3D; None where it refuses the scene."""
    changes = {"dimension": 3, "frame": "laboratory", "background_damping": {"form": "none"}}
    scene = tube_scene(engine={"name": engine}, contact=contact, **changes)
    module = engine_module(engine)
    try:
        module.refuse(scene)
    except RefusedError:
        return None
    deck = module.render_deck(build_program(scene), {}, "run", "study")
    return deck.commands if module.RUNS_ITS_DECK else deck.text


@pytest.mark.parametrize("engine", ENGINE_NAMES)
@pytest.mark.parametrize("law", [None, *LAWS])
def test_each_engine_is_told_a_key_or_refuses_it(engine: EngineName, law: str | None) -> None:
    usual: dict[str, Any] = {"springs_at_size_scale": None, "slip_normal": "full_step"}
    contact = Contact.model_validate(usual)
    section = contact if law is None else getattr(contact, law)
    silent = []
    for key, field in type(section).model_fields.items():
        if law is None and key in LAWS:
            continue
        other = {key: other_value(field, getattr(section, key))}
        changed = other if law is None else {law: section.model_dump() | other}
        if told(engine, usual | changed) == told(engine, usual):
            silent.append(key)
    assert silent == []


def test_a_mutation_breaks_each_field_of_the_law() -> None:
    program = build_program(tube_scene())
    sound = scene_of(program.scenario, program.stages[0], 1e-6)
    sound = sound._replace(grain_law=Law._make([1.0] * len(Law._fields)))
    changed = [mutation.scene(sound).grain_law for mutation in MUTATIONS if mutation.scene]
    broken = {n for law in changed for n in Law._fields if getattr(law, n) != 1.0}
    # a step of another length breaks those two
    assert broken == set(Law._fields) - {"lag_s", "lead_s"}
