"""Where ways to solidify fail: long steps, small kernels, jumps of size, elements out of line."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sandmould.casting.arpm.elements import Elements
from sandmould.casting.arpm.filling import Filling
from sandmould.casting.arpm.marching import Substance
from sandmould.casting.arpm.method import HeatMethod
from tests.verification.castings.contact import (
    COLD_K,
    DURATION_S,
    HOT_K,
    compare_contact,
    contact_elements,
)
from tests.verification.castings.exact import contact_temperature_k
from tests.verification.castings.growth import grows_beyond_s
from tests.verification.castings.plates import read_aluminium

Array = NDArray[np.float64]
FORMS = ("printed", "corrected", "symmetric", "faces")
STEP_SHARES = (0.5, 0.95, 1.1, 1.2, 1.3, 1.4, 1.6, 2.0)
KERNEL_SIZES = (1.2, 1.4, 1.8, 2.1, 3.1, 4.2)
RATIOS = (1, 2, 3, 4)
SCATTERS = (0.0, 0.1, 0.2, 0.3, 0.4)
SMALL_M, HALF_M, WIDE_M, FINE_M = 0.005, 0.5, 0.06, 0.02
"""Smallest element, half the length, the width, and how far small elements reach from x = 0: all
multiples of two, three and four small elements where such follow."""
NOISE_K = 0.01
LOST_K = 1e3
"""Off the exact temperature by more than ten times the initial difference."""


def _filling() -> Filling:
    aluminium = read_aluminium()
    return Filling((aluminium, aluminium), (COLD_K, HOT_K))


def _method(form: str, kernel_size: float = 2.1, share: float = 0.95) -> HeatMethod:
    return HeatMethod(form, "explicit", kernel_size, False, share)  # type: ignore[arg-type]


def _largest_k(elements: Elements, method: HeatMethod) -> float | None:
    """Largest difference from the exact contact after 100 s; None where it has no bounds."""
    with np.errstate(all="ignore"):
        largest_k = compare_contact(elements, _filling(), method).largest_k
    return largest_k if largest_k < LOST_K else None


def _disturbed_k(elements: Elements, method: HeatMethod) -> float | None:
    """As ``_largest_k``, from a start that has something of every mode: noise of 0.01 K."""
    filling = _filling()
    heat, marching = filling.heat(elements), method.stepping_of(elements, filling)
    noise_k = np.random.default_rng(1).normal(scale=NOISE_K, size=len(elements.size_m))
    substance = Substance(elements.material, filling.table)
    heat = substance.heat_at(heat.temperature_k + noise_k)
    with np.errstate(all="ignore"):
        marching.advance(heat, DURATION_S)
        exact = contact_temperature_k(
            elements.position_m[:, 0],
            DURATION_S,
            (filling.materials[1], filling.materials[0]),
            (HOT_K, COLD_K),
            0.0,
        )
        largest_k = float(np.abs(heat.temperature_k - exact).max())
    return largest_k if largest_k < LOST_K else None


def step_rows() -> list[dict[str, Any]]:
    """Largest error over the step, and the step beyond which a mode grows, in case 1-2."""
    elements, filling = contact_elements("1-2"), _filling()
    capacity = Substance(elements.material, filling.table).capacity_j_m3_k
    rows = []
    for form in FORMS:
        exchange = _method(form).exchange_of(elements, filling)
        planned_s = float(exchange.limit_s(capacity).min())
        rows.append({
            "exchange": form, "planned_s": planned_s,
            "grows_beyond": grows_beyond_s(exchange, capacity) / planned_s,
            "largest_k": {str(share): _disturbed_k(elements, _method(form, share=share))
                          for share in STEP_SHARES},
        })  # fmt: skip
        print(f"steps, {form}: grows beyond {rows[-1]['grows_beyond']:.3f}", flush=True)
    return rows


def graded(ratio: int) -> Elements:
    """Small elements within 20 mm of x = 0, and ``ratio`` times as large ones right beside them."""
    large_m = ratio * SMALL_M
    place, size = [], []
    for low, high, side in (
        (-HALF_M, -FINE_M, large_m), (-FINE_M, FINE_M, SMALL_M), (FINE_M, HALF_M, large_m),
    ):  # fmt: skip
        x = low + (np.arange(round((high - low) / side)) + 0.5) * side
        y = (np.arange(round(WIDE_M / side)) + 0.5) * side
        grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
        place.append(grid)
        size.append(np.full(len(grid), side))
    position = np.concatenate(place)
    return Elements(
        position, np.concatenate(size), (position[:, 0] < 0.0).astype(np.int64),
        np.array([-HALF_M, 0.0]), np.array([HALF_M, WIDE_M]),
    )  # fmt: skip


def jump_rows() -> list[dict[str, Any]]:
    """Largest error over the ratio of sizes that meet, and the size of the kernel."""
    rows = []
    for ratio in RATIOS:
        elements = graded(ratio)
        ways = [(form, size) for form in FORMS[:3] for size in KERNEL_SIZES] + [("faces", 2.1)]
        for form, size in ways:
            rows.append({
                "exchange": form, "ratio": ratio, "kernel_size": None if form == "faces" else size,
                "largest_k": _largest_k(elements, _method(form, size)),
            })  # fmt: skip
        print(f"jumps of 1 to {ratio}", flush=True)
    return rows


def scattered(scatter: float) -> Elements:
    """Elements moved at random by up to a share of their size, mirrored across x = 0."""
    rng, cell = np.random.default_rng(5), 2 * SMALL_M
    nodes = np.indices((round(HALF_M / cell), round(WIDE_M / cell))).reshape(2, -1).T
    right = (nodes + 0.5 + rng.uniform(-scatter, scatter, nodes.shape)) * cell
    place = np.concatenate([right, right * np.array([-1.0, 1.0])])
    material = np.repeat([0, 1], len(right))
    low, high = np.array([-HALF_M, 0.0]), np.array([HALF_M, WIDE_M])
    return Elements(place, np.full(len(place), cell), material, low, high)


def scatter_rows() -> list[dict[str, Any]]:
    """Largest error over how far elements are out of line."""
    return [
        {"exchange": form, "scatter": scatter,
         "largest_k": _largest_k(scattered(scatter), _method(form))}
        for form in (*FORMS[:3], "power")
        for scatter in SCATTERS
    ]  # fmt: skip
