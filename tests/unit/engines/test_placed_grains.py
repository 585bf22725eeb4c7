"""Grains placed by hand with velocities, on every engine."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandmould.bad_input import BadInputError
from sandmould.engines.program import build_program
from sandmould.engines.registry import engine_of
from sandmould.scenario.checks.scene import problems
from sandmould.scenario.reading import Origin, validated
from sandmould.scenario.scenario import Scenario
from tests.scenes import tube_scene
from tests.verification.cases.bench import LARGE_M, SMALL_M, Bench, scene

GRAVITY = 9.80665
AT = ((0.05, 0.06), (0.11, 0.07), (0.16, 0.05))
FLIES = ((0.4, 0.5), (0.0, 0.0), (-0.3, 0.9))
RADII_M = (SMALL_M, LARGE_M, SMALL_M)


def placed(engine: str, dimension: int, layers: int = 0) -> Scenario:
    """Three grains in a wide box, two of them thrown."""

    def in_space(flat: tuple[float, float], y: float) -> list[float]:
        return [*flat] if dimension == 2 else [flat[0], y, flat[1]]

    grains = [
        {"position_m": in_space(at, 0.1), "velocity_m_s": in_space(flies, 0.2),
         "diameter_m": 2 * radius_m}
        for at, flies, radius_m in zip(AT, FLIES, RADII_M, strict=True)
    ]  # fmt: skip
    given = scene(engine, dimension, radii_m=(SMALL_M, LARGE_M), step_s=2e-5,
                  gravity_m_s2=GRAVITY)  # fmt: skip
    fill = {"grains": grains, "layers": [{"count": 5}] * layers}
    return Scenario.model_validate(given.model_dump() | {"fill": given.fill.model_dump() | fill})


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("engine", ["reference", "lammps", "liggghts"])
def test_they_fly_as_they_are_thrown(engine: str, dimension: int) -> None:
    given = placed(engine, dimension)
    assert problems(given) == []
    grains = given.fill.grains
    start = np.array([grain.position_m for grain in grains])
    speed = np.array([grain.velocity_m_s for grain in grains])
    with Bench(given) as bench:
        bench.session.start_stage(bench.program.stages[0])
        assert bench.program.counts == (3,)
        np.testing.assert_allclose(bench.radius_m, RADII_M, rtol=1e-9)
        for _ in range(4):
            now = bench.advance(0.021)
            t = now.time_s
            expected = start + speed * t
            expected[:, -1] -= GRAVITY * t**2 / 2
            np.testing.assert_allclose(now.position_m, expected, rtol=0, atol=1e-11)


def test_layers_fall_on_them(tmp_path: Path) -> None:
    given = placed("reference", 2, layers=2)
    program = build_program(given)
    assert program.counts == (3, 5, 5)
    assert [stage.name for stage in program.stages] == ["settle_1", "settle_2", "settle_3"]
    engine_of(given).write_deck(program, {}, tmp_path, "test", "test")
    rows = (tmp_path / "layers" / "layer_1.tsv").read_text().splitlines()
    assert rows[0] == "class\tradius_m\tx_m\ty_m\tvx_m_s\tvy_m_s"
    assert rows[3].split("\t")[2:] == ["0.16", "0.05", "-0.3", "0.9"]
    assert (tmp_path / "layers" / "layer_2.tsv").read_text().startswith("class\tradius_m\tx_m\ty_m")


@pytest.mark.parametrize(
    ("grains", "key", "valid"),
    [
        ([{"position_m": [0.0005, 0.05]}], "0.position_m", "from walls and obstacles, its radius"),
        ([{"position_m": [0.09, 0.05]}], "0.position_m", "from walls and obstacles"),
        ([{"position_m": [0.03, 0.2]}], "0.position_m", "a place in the box, 0.08 x 0.08 m"),
        ([{"position_m": [0.065, 0.0365]}], "0.position_m", "from walls and obstacles"),
        ([{"position_m": [0.02, 0.05, 0.05]}], "0.position_m", "2 numbers"),
        ([{"position_m": [0.02, 0.05], "velocity_m_s": [1.0]}], "0.velocity_m_s", "2 numbers"),
        ([{"position_m": [0.02, 0.05], "diameter_m": 0.5}], "0.diameter_m", "of a size class"),
        (
            [{"position_m": [0.02, 0.05]}, {"position_m": [0.021, 0.05]}],
            "1.position_m", "or more from fill.grains.0, so that they only touch",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_is_said(grains: list[dict[str, Any]], key: str, valid: str) -> None:
    largest_m = tube_scene().largest_diameter_m
    fill = {"grains": [{"diameter_m": largest_m} | grain for grain in grains]}
    found = problems(tube_scene(fill=fill))
    assert [problem.key for problem in found] == [f"fill.grains.{key}"]
    assert valid in found[0].valid


def test_a_fill_without_sand_is_refused() -> None:
    with pytest.raises(BadInputError, match="at least one layer in layers, or grains"):
        validated(Scenario, {"fill": {"layers": []}}, Origin(), "trial.yaml")
