"""Exchange between elements of several sizes: consistency, conservation and stable steps."""

from __future__ import annotations

import numpy as np
import pytest

from sandmould.casting.arpm.elements import Elements, placed
from sandmould.casting.arpm.exchange import Exchange, face_exchange
from sandmould.casting.arpm.filling import Filling
from sandmould.casting.arpm.kernel import kernel_exchange
from sandmould.casting.arpm.local_steps import LocalSteps
from sandmould.casting.arpm.marching import ExplicitSteps, Substance, SuperSteps
from sandmould.casting.arpm.material import ThermalMaterial
from sandmould.casting.arpm.method import power_exchange
from sandmould.casting.arpm.raster import Raster
from tests.verification.castings.growth import grows_beyond_s

CONDUCTIVITY = np.array([1.255, 29.3])
STEEL = ThermalMaterial("steel", 7200.0, 711.0, 29.3, 272e3, 1713.0, 1773.0)
SAND = ThermalMaterial("sand", 1600.0, 1130.0, 1.255)
FILLING = Filling((SAND, STEEL), (293.0, 1823.0), 1 / 837.0)


def graded(dimensions: int = 2, layers: tuple[int, ...] = (2, 2)) -> Elements:
    """A block of casting in a box, of three sizes; nothing about it is symmetric."""
    material = np.zeros([48] * dimensions if dimensions == 2 else [16] * 3, dtype=np.int64)
    material[tuple(slice(n // 4, n // 2 + 2) for n in material.shape)] = 1
    return placed(Raster(material, 0.002, np.zeros(dimensions)), layers)


def uptake(exchange: Exchange, temperature: np.ndarray) -> np.ndarray:
    """Heat that each element takes up, W/m3."""
    row = np.repeat(np.arange(len(temperature)), np.diff(exchange.start))
    flow = exchange.rate_w_m3_k * (temperature[exchange.neighbour] - temperature[row])
    return np.bincount(row, flow, len(temperature))


def inner(elements: Elements, margin: float = 0.017) -> np.ndarray:
    """Elements away from the walls, which are insulated and bear no slope."""
    place = elements.position_m
    return ((place > elements.low_m + margin) & (place < elements.high_m - margin)).all(axis=1)


def residual(elements: Elements, exchange: Exchange, slope: np.ndarray) -> float:
    """Largest heating that a linear temperature causes, over that of a kink of the same slope."""
    found = np.abs(uptake(exchange, elements.position_m @ slope))[inner(elements)]
    kink = 29.3 * np.linalg.norm(slope) / elements.size_m[inner(elements)]
    return float((found / kink).max())


@pytest.mark.parametrize("slope", [(100.0, 0.0), (0.0, 100.0), (60.0, -80.0)])
def test_faces_reproduce_a_linear_temperature_at_jumps_of_size(slope: tuple[float, float]) -> None:
    elements = graded()
    assert len(elements.counts()) == 3
    alike = np.array([29.3, 29.3])
    at = np.array(slope)
    # a linear temperature conducts the same everywhere: no element may heat up, to round-off
    assert residual(elements, face_exchange(elements, alike, 0.0), at) < 1e-10
    # A small face on its own sees its large neighbour's centre beside it: 0.33 to 0.47 measured.
    plain = face_exchange(elements, alike, 0.0, consistent=False)
    assert 0.3 < residual(elements, plain, at) < 0.5
    error = {
        form: residual(elements, kernel_exchange(elements, alike, 0.0, 2.1, form, False), at)
        for form in ("printed", "corrected", "symmetric")
    }
    # The kernel forms heat elements at a jump as a kink of this share of the slope would; what
    # conserves (symmetric) is no more consistent. Measured 0.60 to 0.67, 0.34 to 0.45, 0.30 to
    # 0.41.
    assert 0.55 < error["printed"] < 0.7
    assert 0.3 < error["corrected"] < 0.5
    assert 0.25 < error["symmetric"] < 0.45


def test_faces_of_cubes_reproduce_a_linear_temperature() -> None:
    material = np.zeros((24, 24, 24), dtype=np.int64)
    material[10:14, 10:14, 10:14] = 1
    elements = placed(Raster(material, 0.002, np.zeros(3)), (1,))
    assert len(elements.counts()) == 2
    exchange = face_exchange(elements, np.array([29.3, 29.3]), 0.0)
    slope = np.array([30.0, -50.0, 80.0])
    found = np.abs(uptake(exchange, elements.position_m @ slope))[inner(elements, 0.005)]
    # one flux through a face of 2 mm heats an element by 29.3 x 100 / 0.002 W/m3
    assert found.max() < 1e-10 * 29.3 * 100.0 / 0.002


@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize("steps", [ExplicitSteps, SuperSteps, LocalSteps])
def test_faces_conserve_enthalpy_to_round_off(dimensions: int, steps: type) -> None:
    elements = graded(dimensions, (1,) if dimensions == 3 else (2, 2))
    exchange = face_exchange(elements, CONDUCTIVITY, FILLING.resistance_m2k_w)
    marching = steps(exchange, Substance(elements.material, FILLING.table))
    heat = FILLING.heat(elements)
    before = heat.enthalpy_j_m3 @ exchange.volume_m3
    marching.advance(heat, 40.0)
    after = heat.enthalpy_j_m3 @ exchange.volume_m3
    # a few hundred steps, each with round-off of 1e-16 in every sum
    assert abs(after / before - 1.0) < 1e-12
    assert heat.temperature_k.min() >= 293.0 - 1e-9
    assert heat.temperature_k.max() <= 1823.0 + 1e-9


def test_kernel_forms_lose_enthalpy_unless_symmetric() -> None:
    elements = graded()
    drift = {}
    for form in ("printed", "corrected", "symmetric"):
        exchange = kernel_exchange(
            elements, CONDUCTIVITY, FILLING.resistance_m2k_w, 2.1, form, refuse_ratio=False
        )
        heat = FILLING.heat(elements)
        before = heat.enthalpy_j_m3 @ exchange.volume_m3
        ExplicitSteps(exchange, Substance(elements.material, FILLING.table)).advance(heat, 40.0)
        drift[form] = abs(heat.enthalpy_j_m3 @ exchange.volume_m3 / before - 1.0)
    # 0.8 % corrected with so abrupt sizes in so small a box; the symmetric form loses round-off
    assert drift["printed"] > 2 * drift["corrected"]
    assert 1e-4 < drift["corrected"] < 0.01
    assert drift["symmetric"] < 1e-12


@pytest.mark.parametrize("exchange", ["faces", "corrected"])
def test_steps_just_below_the_limit_are_stable_and_just_above_not(exchange: str) -> None:
    elements = graded()
    alike = Filling((STEEL, STEEL), (300.0, 310.0))
    rates = (
        face_exchange(elements, alike.conductivity_w_m_k, 0.0)
        if exchange == "faces"
        else kernel_exchange(elements, alike.conductivity_w_m_k, 0.0, refuse_ratio=False)
    )
    substance = Substance(elements.material, alike.table)
    limit_s = grows_beyond_s(rates, substance.capacity_j_m3_k)
    assert rates.limit_s(substance.capacity_j_m3_k).min() <= limit_s
    largest = []
    for share in (0.99, 1.01):
        marching = ExplicitSteps(rates, substance)
        marching.step_s = share * limit_s
        heat = alike.heat(elements)
        # noise holds the fastest mode; in 1000 steps it grows by 1.02^1000 or dies out
        noise = np.random.default_rng(1).standard_normal(len(elements.size_m))
        heat.enthalpy_j_m3 = alike.table.enthalpy_j_m3(305.0 + noise, elements.material)
        heat.temperature_k = alike.table.temperature_k(heat.enthalpy_j_m3, elements.material)
        marching.advance(heat, 1000 * share * limit_s)
        largest.append(float(np.abs(heat.temperature_k - 305.0).max()))
    assert largest[0] < 5.0
    assert not largest[1] < 1e3


def test_other_steppings_agree_with_short_explicit_steps() -> None:
    elements = graded()
    exchange = face_exchange(elements, CONDUCTIVITY, FILLING.resistance_m2k_w)
    substance = Substance(elements.material, FILLING.table)
    found = {}
    for name, marching in {
        "short": ExplicitSteps(exchange, substance, share=0.1),
        "explicit": ExplicitSteps(exchange, substance),
        "local": LocalSteps(exchange, substance),
        "local, half as long": LocalSteps(exchange, substance, share=0.475),
        "super": SuperSteps(exchange, substance),
    }.items():
        heat = FILLING.heat(elements)
        for _ in range(8):
            marching.advance(heat, 5.0)
        found[name] = heat
    off = {
        name: float(np.abs(heat.temperature_k - found["short"].temperature_k).max())
        for name, heat in found.items()
    }
    # Measured 0.65, 0.42 and 9.6 K of 1530 K: local steps are up to 128 times as long in the
    # sand, which heats up by hundreds of kelvin in these 40 s. All are of first order in time.
    assert 0.0 < off["explicit"] < 1.0
    assert 0.0 < off["super"] < 1.0
    assert off["local"] < 15.0
    assert off["local"] / off["local, half as long"] == pytest.approx(2.0, rel=0.3)
    assert found["local"].element_steps < 0.5 * found["explicit"].element_steps


def test_super_steps_are_of_second_order_in_time() -> None:
    # without latent heat, whose kink leaves first order, from a smooth start
    elements = graded()
    filling = Filling((SAND, SAND), (300.0, 400.0))
    exchange = face_exchange(elements, filling.conductivity_w_m_k, 0.0)
    substance = Substance(elements.material, filling.table)
    start = 350.0 + 50.0 * np.cos(np.pi * elements.position_m / 0.096).prod(axis=1)
    found = []
    for steps in (2, 4, 64):
        heat, marching = substance.heat_at(start), SuperSteps(exchange, substance)
        for _ in range(steps):
            marching.advance(heat, 40.0 / steps)
        found.append(heat.temperature_k)
    off = [float(np.abs(t - found[2]).max()) for t in found[:2]]
    # 3.6 measured: the two lengths take different numbers of stages
    assert off[0] / off[1] == pytest.approx(4.0, rel=0.25)


def test_threads_change_no_bit() -> None:
    elements = graded()
    exchange = face_exchange(elements, CONDUCTIVITY, FILLING.resistance_m2k_w)
    substance = Substance(elements.material, FILLING.table)
    for steps in (ExplicitSteps, LocalSteps):
        found = []
        for threads in (1, 2):
            heat = FILLING.heat(elements)
            marching = steps(exchange, substance, threads=threads)
            marching.advance(heat, marching.step_s * 4)
            found.append(heat.temperature_k)
        np.testing.assert_array_equal(found[0], found[1])


def scattered(seed: int = 3) -> Elements:
    """Elements at random places, small ones on the left."""
    rng = np.random.default_rng(seed)
    nodes = np.stack(np.meshgrid(np.arange(24), np.arange(24), indexing="ij"), axis=-1)
    place = (nodes.reshape(-1, 2) + 0.5 + rng.uniform(-0.3, 0.3, (576, 2))) * 0.004
    fine = place[:, 0] < 0.03
    extra = place[fine] + rng.uniform(0.001, 0.0015, (fine.sum(), 2))
    size = np.concatenate([np.where(fine, 0.003, 0.004), np.full(len(extra), 0.003)])
    place = np.concatenate([place, extra])
    low, high = np.zeros(2), np.full(2, 0.097)
    return Elements(place, size, (place[:, 0] > 0.06).astype(np.int64), low, high)


def test_power_diagrams_are_consistent_and_conserve() -> None:
    elements = scattered()
    exchange = power_exchange(elements, np.array([29.3, 29.3]), 0.0)
    # the cells fill the box
    assert exchange.volume_m3.sum() == pytest.approx(0.097**2, rel=1e-9)
    slope = np.array([60.0, -80.0])
    found = np.abs(uptake(exchange, elements.position_m @ slope))[inner(elements)]
    # relative to one face's flux; the hull's planes hold about ten digits
    assert found.max() < 1e-6 * 29.3 * 100.0 / 0.003
    heat = FILLING.heat(elements)
    exchange = power_exchange(elements, CONDUCTIVITY, FILLING.resistance_m2k_w)
    before = heat.enthalpy_j_m3 @ exchange.volume_m3
    ExplicitSteps(exchange, Substance(elements.material, FILLING.table)).advance(heat, 20.0)
    assert abs(heat.enthalpy_j_m3 @ exchange.volume_m3 / before - 1.0) < 1e-12
