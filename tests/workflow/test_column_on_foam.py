"""Sand on a block of foam that floor and walls hold: its sag is exact, in every scheme."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sandmould.bad_input import BadInputError
from sandmould.engines.driver import Driver
from sandmould.engines.program import build_program
from sandmould.engines.registry import engine_of, engine_problem
from sandmould.kinds.sand.kind import SAND
from sandmould.pattern_fe.coupling.interface import with_surface
from sandmould.pattern_fe.coupling.opening import open_coupled
from sandmould.runs.outcome import Outcome
from sandmould.scenario.scenario import Scenario
from tests.patterns import _one_thread  # noqa: F401
from tests.workflow.runs import last_snapshot

WIDTH_M = HEIGHT_M = 0.06
YOUNG_PA, POISSON = 1e5, 0.35
SCHEMES = (
    "one_way", "per_layer", "fixed", "measured", "aitken", "quasi_newton", "in_step", "monolithic",
)  # fmt: skip

SAND_OF_DISCS = {"size_scale": 8.0, "size_classes": 3, "disc_thickness_m": 0.1}
LIGGGHTS_SAND = {
    "sand": SAND_OF_DISCS | {"disc_inertia": "sphere"},
    "background_damping": {"form": "none"},
}
"""What LIGGGHTS asks for."""


def column(scheme: str, engine: str = "reference") -> Scenario:
    """All by default but the scene."""
    loop = {"scheme": scheme} | ({"repeats": 0} if engine == "liggghts" else {})
    scene = Scenario.model_validate(
        {
            "box": {"width_m": WIDTH_M, "height_m": 0.25},
            "pattern": {
                "shape": {"kind": "bar", "width_m": WIDTH_M, "height_m": HEIGHT_M},
                "position_m": [0.0, 0.0],
                "element_m": 0.015,
                "young_modulus_pa": YOUNG_PA,
                "poisson_ratio": POISSON,
                "supports": {"clamped": [], "resting": ["bottom", "left", "right"]},
                "loop": loop,
            },
            # walls that carry nothing
            "contact": {"grain_wall": {"friction": 0.0}},
            "sand": SAND_OF_DISCS,
            "fill": {"layers": [{"count": 60}]},
            "engine": {"name": engine},
            **(LIGGGHTS_SAND if engine == "liggghts" else {}),
        }
    )
    return with_surface(scene)


def sag_m(scene: Scenario, pattern_m: np.ndarray) -> float:
    """Mean sag of the top: its vertices bound the volume that its elements lose."""
    drawn_m = scene.scene.outlines[0].vertices_m
    top = np.flatnonzero(drawn_m[:, 1] > HEIGHT_M - 1e-9)
    top = top[np.argsort(drawn_m[top, 0])]
    sunk_m = drawn_m[top, 1] - pattern_m[top, 1]
    return float(np.trapezoid(sunk_m, x=drawn_m[top, 0])) / WIDTH_M


@pytest.mark.parametrize("scheme", SCHEMES)
def test_foam_sags_as_the_closed_form_says(scheme: str, tmp_path: Path) -> None:
    """Weight over the confined block: W H/(M A), with M the constrained modulus."""
    assert_sags_exactly(column(scheme), tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["lammps", "liggghts"])
def test_foam_sags_so_on_every_engine(engine: str, tmp_path: Path) -> None:
    problem = engine_problem(column("aitken", engine))
    if problem is not None:
        pytest.skip(str(problem))
    assert_sags_exactly(column("aitken", engine), tmp_path)


def test_a_foam_that_creeps_in_every_step_is_waited_for(tmp_path: Path) -> None:
    """Strong damping: sand is slow and carried long before the block has sunk (2.5 % before)."""
    tree = column("monolithic").model_dump(mode="json", exclude_unset=True)
    del tree["obstacles"]
    tree["pattern"]["loop"]["damping_ratio"] = 10.0
    tree["fill"]["layers"] = [{"count": 30}]
    assert_sags_exactly(with_surface(Scenario.model_validate(tree)), tmp_path)


def assert_sags_exactly(scene: Scenario, tmp_path: Path) -> None:
    program = build_program(scene)
    engine_of(scene).write_deck(program, {}, tmp_path, "test", "test")
    outcome = Driver(program, tmp_path, "test", "hash", open_coupled).run()
    assert outcome.outcome is Outcome.FINISHED, outcome.detail
    last = last_snapshot(tmp_path / "work")
    weight_n = program.mass_kg(1) * scene.gravity_m_s2
    constrained_pa = YOUNG_PA * (1 - POISSON) / ((1 + POISSON) * (1 - 2 * POISSON))
    area_m2 = WIDTH_M * scene.sand.thickness_m
    assert last.pattern_m is not None
    # The tolerance of rest, 1 % of the weight.
    assert sag_m(scene, last.pattern_m) == pytest.approx(
        weight_n * HEIGHT_M / (constrained_pa * area_m2), rel=0.01
    )


@pytest.mark.parametrize(
    ("engine", "says"),
    [
        ("reference", r"pattern\.loop\.repeats = 0 .* at least 1 in the scheme quasi_newton"),
        ("lammps", r"pattern\.loop\.repeats = 0 .* at least 1 in the scheme quasi_newton"),
        ("liggghts", r"scheme = 'quasi_newton' .* one_way, per_layer, fixed, aitken on engine"),
    ],
)
def test_secants_of_the_sands_noise_are_refused(engine: str, says: str) -> None:
    """Windows that are computed once differ by what the sand does, not by the foam's answer."""
    tree = column("aitken").model_dump(mode="json", exclude_unset=True)
    del tree["obstacles"]
    tree["pattern"]["loop"] |= {"scheme": "quasi_newton", "repeats": 0}
    tree["engine"]["name"] = engine
    if engine == "liggghts":
        tree |= {"background_damping": {"form": "none"}}
        tree["sand"]["disc_inertia"] = "sphere"
    with pytest.raises(BadInputError, match=says):
        SAND.planning.resolved(Scenario.model_validate(tree))


def test_layers_are_refused_on_a_foam_too_soft_for_their_share() -> None:
    scene = column("per_layer")
    assert scene.pattern is not None
    pattern = scene.pattern.model_copy(update={"young_modulus_pa": 1e3})
    with pytest.raises(BadInputError, match=r"scheme = 'per_layer' .* for so soft a foam"):
        SAND.planning.resolved(scene.model_copy(update={"pattern": pattern, "obstacles": ()}))
