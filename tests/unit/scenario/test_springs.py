"""The springs that a scene is computed with, by the size of its grains or by a wave speed."""

from __future__ import annotations

import math
from typing import Any

import pytest

from sandmould.engines.deck_lines import Lines
from sandmould.engines.lammps.render import render_deck
from sandmould.engines.program import build_program
from sandmould.scenario.checks.scene import problems
from sandmould.scenario.contact import Contact, wave_speed_m_s
from sandmould.scenario.sand import Sand
from sandmould.scenario.scenario import Scenario
from tests.scenes import tube_scene

PAPER_N_M, PAPER_WALL_N_M = 7e4, 2e4


def scene(**changes: Any) -> Scenario:
    return Scenario.model_validate(changes)


def speed_of(scenario: Scenario) -> float:
    return wave_speed_m_s(scenario.sand, scenario.laws, scenario.dimension)


def test_a_disc_is_as_thick_as_the_mass_median_grain_is_wide() -> None:
    # A third of the way from the sieve of 0.5 mm (38 %) to that of 0.71 mm (74 %), four times.
    assert Sand().thickness_m == pytest.approx(4 * (0.5e-3 + 0.21e-3 / 3))
    assert Sand(size_scale=12).thickness_m == pytest.approx(3 * Sand().thickness_m)
    assert Sand(disc_thickness_m=0.1).thickness_m == 0.1


@pytest.mark.parametrize(
    ("dimension", "by_hand_m_s"),
    [
        (2, math.sqrt(4 * PAPER_N_M / (math.pi * 2400 * 2.28e-3))),
        (3, math.sqrt(6 * PAPER_N_M / (math.pi * 2400 * 2.28e-3))),
    ],
)
@pytest.mark.parametrize("size_scale", [3, 4, 6, 12])
def test_coarser_grains_have_the_same_wave_speed(
    dimension: int, by_hand_m_s: float, size_scale: float
) -> None:
    coarse = scene(dimension=dimension, sand={"size_scale": size_scale})
    assert speed_of(coarse) == pytest.approx(by_hand_m_s)
    # kappa = k_n/(P b) or k_n/(P d) at the same pressure
    for law, paper in (("grain_grain", PAPER_N_M), ("grain_wall", PAPER_WALL_N_M)):
        springs = getattr(coarse.laws, law)
        assert springs.normal_stiffness_n_m / coarse.sand.mass_median_diameter_m == pytest.approx(
            paper / 2.28e-3
        )
        assert springs.tangential_stiffness_n_m == springs.normal_stiffness_n_m
        assert springs.rolling_stiffness_n_m == springs.normal_stiffness_n_m


@pytest.mark.parametrize("dimension", [2, 3])
def test_another_sieve_curve_changes_no_wave_speed(dimension: int) -> None:
    passing = {0.1e-3: 0.0, 0.2e-3: 0.3, 0.4e-3: 0.8, 0.8e-3: 1.0}
    sieve = [{"opening_m": m, "passing_fraction": p} for m, p in passing.items()]
    finer = scene(dimension=dimension, sand={"sieve": sieve})
    assert finer.sand.real_median_m == pytest.approx(0.28e-3)
    assert speed_of(finer) == pytest.approx(speed_of(scene(dimension=dimension)))
    lines = Lines(finer, {}).in_use("contact.grain_grain.normal_stiffness_n_m")
    assert lines[0] == pytest.approx(PAPER_N_M * 0.28 / 0.57)
    assert lines[1] == ", 70000 at size_scale 4, times 4/4 and 0.4912 of the sieve curve"


@pytest.mark.parametrize(
    "changes",
    [
        {"sand": {"size_scale": 12, "disc_thickness_m": 0.1}},
        {"sand": {"size_scale": 12}, "contact": {"springs_at_size_scale": None}},
        {"dimension": 3, "sand": {"size_scale": 12}, "contact": {"springs_at_size_scale": 12}},
        {"sand": {"size_scale": 4}},
    ],
)
def test_springs_stay_as_they_are_given(changes: dict[str, Any]) -> None:
    given = scene(**changes)
    assert given.laws is given.contact


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("size_scale", [4, 9])
def test_a_wave_speed_settles_all_springs(dimension: int, size_scale: float) -> None:
    fast = scene(
        dimension=dimension, sand={"size_scale": size_scale}, contact={"wave_speed_m_s": 150.0}
    )
    assert speed_of(fast) == pytest.approx(150.0)
    springs = fast.laws
    ratio = springs.grain_wall.normal_stiffness_n_m / springs.grain_grain.normal_stiffness_n_m
    assert ratio == pytest.approx(PAPER_WALL_N_M / PAPER_N_M)


def test_four_times_the_springs_are_twice_the_speed() -> None:
    by_speed = scene(contact={"wave_speed_m_s": 100.0})
    for given in (by_speed, scene(), scene(sand={"size_scale": 6})):
        stiffer = given.model_copy(update={"contact": given.contact.stiffer(4.0)})
        assert speed_of(stiffer) == pytest.approx(2 * speed_of(given))
    assert Contact().stiffer(4.0).grain_wall.rolling_stiffness_n_m == 4 * PAPER_WALL_N_M


def test_a_deck_prints_the_springs_of_both_sizes() -> None:
    hard = tube_scene(sand={"disc_thickness_m": "grain"}, contact={"springs_at_size_scale": 4.0})
    text = render_deck(build_program(hard), {}).text
    (line,) = [x for x in text.splitlines() if x.startswith("variable grain_k_n ")]
    assert line.startswith("variable grain_k_n index 140000  # N/m, ")
    assert ", 70000 at size_scale 4, times 8/4; " in line
    (line,) = [x for x in text.splitlines() if x.startswith("variable disc_thickness ")]
    assert line.startswith("variable disc_thickness index 0.00456  # m, ")
    told = Lines(scene(contact={"wave_speed_m_s": 150.0}), {}).in_use(
        "contact.grain_wall.tangential_stiffness_n_m"
    )[1]
    assert told == ", 20000 multiplied for a wave speed of 150 m/s"


@pytest.mark.parametrize(
    ("changes", "key", "valid"),
    [
        (
            {"contact": {"wave_speed_m_s": 150.0}, "sand": {"disc_thickness_m": 0.1}},
            "contact.wave_speed_m_s",
            "null with sand.disc_thickness_m in m",
        ),
        (
            {
                "contact": {"grain_grain": {"normal_stiffness_n_m": 1e12}},
                "sand": {"size_scale": 0.01},
            },
            "contact.grain_grain.normal_stiffness_n_m",
            "critical time step is 1e-09 s or longer",
        ),
        (
            {"contact": {"wave_speed_m_s": 1e4}, "sand": {"size_scale": 0.01}},
            "contact.wave_speed_m_s",
            "critical time step is 1e-09 s or longer",
        ),
    ],
)
def test_springs_that_cannot_be_used(changes: dict[str, Any], key: str, valid: str) -> None:
    first = problems(scene(**changes))[0]
    assert first.key == key
    assert valid in first.valid
