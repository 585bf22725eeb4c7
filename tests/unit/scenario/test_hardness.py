"""How hard a bed is: kappa, wave speed and first mode of beds worked out by hand."""

from __future__ import annotations

import math

import pytest

from sandmould.scenario.box import Box, Plate
from sandmould.scenario.contact import Contact
from sandmould.scenario.fill import Discharge, Fill, Layer
from sandmould.scenario.hardness import bed_hardness, column_mode_hz, column_speed_m_s
from sandmould.scenario.sand import Sand, SievePoint
from sandmould.scenario.scenario import Scenario

PI, G = math.pi, 9.80665


def bed(dimension: int, **changes: object) -> Scenario:
    """1000 grains of 2 mm on a floor of 0.1 m (by 0.02 m), springs of 7e4 and 2e4 N/m."""
    # A sieve curve so narrow that all grains are 2 mm to six digits.
    curve = (SievePoint(opening_m=2e-3 * (1 - 1e-7), passing_fraction=0.0),
             SievePoint(opening_m=2e-3 * (1 + 1e-7), passing_fraction=1.0))  # fmt: skip
    scene = Scenario(
        dimension=dimension,
        box=Box(width_m=0.1, height_m=0.5, depth_m=0.02),
        sand=Sand(sieve=curve, size_scale=1.0, size_classes=1, density_kg_m3=2500.0,
                  disc_thickness_m=0.01),
        contact=Contact(springs_at_size_scale=None),
        fill=Fill(layers=(Layer(count=1000),)),
    )  # fmt: skip
    return scene.model_copy(update=changes)


def test_kappa_of_discs_is_spring_over_pressure_and_thickness() -> None:
    """The weight of 1000 discs on 0.1 m by 0.01 m of floor, worked out here."""
    found = bed_hardness(bed(2))
    assert found is not None
    weight_n = 1000 * 2500 * PI / 4 * 0.002**2 * 0.01 * G
    pressure_pa = weight_n / (0.1 * 0.01)
    assert found.pressure_pa == pytest.approx(pressure_pa, rel=1e-6)
    # 0.8 of the bed is sand.
    assert found.depth_m == pytest.approx(1000 * PI / 4 * 0.002**2 / 0.1 / 0.8, rel=1e-6)
    assert found.kappa_bed == pytest.approx(7e4 / (pressure_pa * 0.01), rel=1e-6)
    assert found.kappa_walls == pytest.approx(2e4 / (pressure_pa * 0.01), rel=1e-6)
    # sqrt(4 k/(pi rho b)) = sqrt(2.8e5/78.54) = 59.71 m/s, and a quarter of a wave
    assert found.wave_speed_m_s == pytest.approx(math.sqrt(4 * 7e4 / (PI * 2500 * 0.01)), rel=1e-6)
    assert found.wave_speed_m_s == pytest.approx(59.71, abs=0.005)
    assert found.column_hz == pytest.approx(found.wave_speed_m_s / (4 * found.depth_m))


def test_kappa_of_spheres_is_spring_over_pressure_and_diameter() -> None:
    found = bed_hardness(bed(3))
    assert found is not None
    weight_n = 1000 * 2500 * PI / 6 * 0.002**3 * G
    pressure_pa = weight_n / (0.1 * 0.02)
    assert found.pressure_pa == pytest.approx(pressure_pa, rel=1e-6)
    assert found.depth_m == pytest.approx(1000 * PI / 6 * 0.002**3 / 0.002 / 0.58, rel=1e-6)
    assert found.kappa_bed == pytest.approx(7e4 / (pressure_pa * 0.002), rel=1e-6)
    assert found.kappa_walls == pytest.approx(2e4 / (pressure_pa * 0.002), rel=1e-6)
    # sqrt(6 k/(pi rho d)) = sqrt(4.2e5/15.708) = 163.5 m/s
    assert found.wave_speed_m_s == pytest.approx(math.sqrt(6 * 7e4 / (PI * 2500 * 0.002)), rel=1e-6)
    assert found.wave_speed_m_s == pytest.approx(163.5, abs=0.05)


def test_a_grain_over_its_overlap_is_kappa() -> None:
    """A column of discs d wide: the lowest contact bears P b d, its overlap is d over kappa."""
    scene = bed(2)
    found = bed_hardness(scene)
    assert found is not None
    force_n = found.pressure_pa * 0.01 * 0.002
    overlap_m = force_n / scene.laws.grain_grain.normal_stiffness_n_m
    assert 0.002 / overlap_m == pytest.approx(found.kappa_bed)


def test_springs_in_use_count_not_those_that_are_written() -> None:
    """Scale 8 of springs that belong to scale 4: twice as stiff, on grains twice as large."""
    given, coarse = (
        bed(3, sand=bed(3).sand.model_copy(update={"size_scale": scale}),
            contact=Contact(springs_at_size_scale=1.0), fill=Fill(layers=(Layer(height_m=0.1),)))
        for scale in (1.0, 2.0)
    )  # fmt: skip
    first, second = bed_hardness(given), bed_hardness(coarse)
    assert first is not None
    assert second is not None
    assert second.kappa_bed == pytest.approx(first.kappa_bed, rel=0.01)
    assert second.wave_speed_m_s == pytest.approx(first.wave_speed_m_s, rel=1e-6)


def test_sand_on_a_gate_is_as_deep_as_it_stands_over_it() -> None:
    gate = Plate(kind="plate", name="gate", centre_m=(0.05, 0.2), size_m=(0.1, 0.01))
    held = bed(2, obstacles=(gate,), discharge=Discharge(gate="gate"))
    on_floor, on_gate = bed_hardness(bed(2)), bed_hardness(held)
    assert on_floor is not None
    assert on_gate is not None
    assert on_gate.depth_m == pytest.approx(on_floor.depth_m)


def test_without_gravity_nothing_presses() -> None:
    assert bed_hardness(bed(2, gravity_m_s2=0.0)) is None


def test_a_column_of_springs_has_the_frequency_of_its_wave() -> None:
    # The design notes: 157 m/s in 0.3 m of bed.
    assert column_mode_hz(157.0, 0.3) == pytest.approx(130.8, abs=0.05)
    assert column_speed_m_s(130.8, 0.3) == pytest.approx(157.0, abs=0.05)


@pytest.mark.parametrize("dimension", [2, 3])
def test_coarser_grains_of_a_bed_as_deep_are_as_hard(dimension: int) -> None:
    layers = Fill(layers=(Layer(height_m=0.08),))
    box = Box(width_m=0.12, height_m=0.2, depth_m=0.12)
    hard = [
        bed_hardness(
            Scenario(dimension=dimension, box=box, fill=layers, sand=Sand(size_scale=scale))
        )
        for scale in (3.0, 4.0, 6.0, 12.0)
    ]
    beds = [found for found in hard if found is not None]
    assert len(beds) == 4
    # Whole grains leave the depth of a bed of some hundred uncertain by less than a percent.
    assert max(b.kappa_bed for b in beds) < 1.01 * min(b.kappa_bed for b in beds)
    assert max(b.kappa_walls for b in beds) < 1.01 * min(b.kappa_walls for b in beds)
    speeds_m_s = [b.wave_speed_m_s for b in beds]
    assert speeds_m_s == pytest.approx([speeds_m_s[0]] * 4)
