"""What engines say that their sessions can do, and what a coupling makes of it."""

from __future__ import annotations

import importlib
from typing import Any

import pytest

from sandmould.bad_input import BadInputError
from sandmould.engines.registry import engine_module, engines_that
from sandmould.engines.session import Capabilities
from sandmould.engines.staged_session import StagedSession
from sandmould.pattern_fe.coupling.interface import with_surface
from sandmould.pattern_fe.coupling.schemes import SCHEMES, can_couple
from sandmould.scenario.engine import ENGINE_NAMES, EngineName
from sandmould.scenario.scenario import Scenario

BARE = Capabilities(bends_meshes=(2,), bends_in_frames=("box",))


def test_engines_are_listed_by_what_they_can_do() -> None:
    assert engines_that(lambda _: True) == list(ENGINE_NAMES)
    in_space = engines_that(lambda engine: 3 in engine.bends_meshes)
    assert in_space == [name for name in ENGINE_NAMES if name in in_space]
    assert {"lammps", "reference"} <= set(in_space)
    assert "liggghts" not in in_space
    every_step = engines_that(lambda engine: engine.loads_of_every_step)
    assert "reference" in every_step
    assert not {"lammps", "liggghts"} & set(every_step)


@pytest.mark.parametrize("name", ENGINE_NAMES)
def test_sessions_have_the_methods_that_their_engine_promises(name: EngineName) -> None:
    module = importlib.import_module(f"sandmould.engines.{name}.session")
    session = getattr(module, f"{name.capitalize()}Session")
    promised = engine_module(name).CAPABILITIES
    for method, promise in (
        ("save_checkpoint", promised.repeats_windows),
        ("restore_checkpoint", promised.repeats_windows),
        ("attach_mover", promised.calls_movers),
    ):
        own = getattr(session, method) is not getattr(StagedSession, method)
        assert own == promise, method


def test_schemes_ask_for_what_they_use() -> None:
    windows = {"one_way", "per_layer", "fixed", "aitken"}
    assert {scheme for scheme in SCHEMES if can_couple(scheme, BARE)} == windows
    reference = engine_module("reference").CAPABILITIES
    assert all(can_couple(scheme, reference) for scheme in SCHEMES)


IN_SPACE = {
    "dimension": 3,
    "box": {"width_m": 0.2, "height_m": 0.2, "depth_m": 0.08},
    "engine": {"name": "liggghts"},
}


@pytest.mark.parametrize(
    ("scene", "position_m", "says"),
    [
        (
            {"engine": {"name": "lammps"}},
            [0.06, 0.0],
            "pattern.loop.scheme = 'monolithic' cannot be used: "
            "valid is another scheme on engine lammps, or engine reference.",
        ),
        (
            {"engine": {"name": "liggghts"}},
            [0.06, 0.0],
            "pattern.loop.scheme = 'monolithic' cannot be used: "
            "valid is one_way, per_layer, fixed, aitken on engine liggghts.",
        ),
        (
            IN_SPACE,
            [0.06, 0.02, 0.0],
            "engine.name = 'liggghts' cannot be used: "
            "valid is lammps or reference in a scene in 3D with a pattern.",
        ),
    ],
)
def test_refusals_name_the_engines_and_schemes_that_can(
    scene: dict[str, Any], position_m: list[float], says: str
) -> None:
    pattern = {
        "shape": {"kind": "bar", "width_m": 0.02, "height_m": 0.02},
        "position_m": position_m,
        "element_m": 0.02,
        "loop": {"scheme": "monolithic"},
    }
    with pytest.raises(BadInputError) as refused:
        with_surface(Scenario.model_validate({"pattern": pattern, **scene}))
    assert str(refused.value.problems[0]) == says
