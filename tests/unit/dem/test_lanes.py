"""Lanes: one text of the law at any width, and slices of any width that compute the same digits."""

from __future__ import annotations

import re
from typing import Any

import numba
import numpy as np
import pytest
from llvmlite import binding
from numba import njit, typeof
from numba.np.unsafe.ndarray import to_fixed_tuple

from sandmould.dem.contact_law import Law, PairCoefficients, contact
from sandmould.dem.lanes import columns_at, every, lanes_of_processor, put_columns
from sandmould.dem.near_pairs import contacts_of, lanes_of, new_near_pairs
from sandmould.dem.pairs import pass_pairs
from sandmould.dem.solver import Solver
from sandmould.dem.vectors import INLINED, OPTIONS, dim_of
from tests.unit.dem.test_solver import solver

LAWS = (
    Law(7e4, 6e4, 0.8, 0.3, 0.1, 7e4, True, False, 1e-6, 5e-7),
    Law(7e4, 6e4, 0.2, 0.9, 0.3, 5e4, False, True),
)
WIDTHS = (2, 4, 8, 16)
SPINS = {2: (0.0,), 3: (0.0,) * 3}


@njit(**INLINED)
def _of_law(columns: Any, law: Law, dim: Any) -> Any:
    """Results of the law one after the other, from columns in the order of its arguments."""
    c = columns
    sizes = PairCoefficients(c[-3], c[-2], c[-1])
    if len(dim) == 3:
        force, turn_1, turn_2, slide, roll, normal = contact(
            (c[0], c[1], c[2]), c[3], (c[4], c[5], c[6]), (c[7], c[8], c[9]),
            (c[10], c[11], c[12]), c[13], c[14], c[15], sizes, law, 1e-6,
            (c[16], c[17], c[18]), (c[19], c[20], c[21]),
        )  # fmt: skip
        return (*force, *turn_1, *turn_2, *slide, *roll, normal)
    force, turn_1, turn_2, slide, roll, normal = contact(
        (c[0], c[1]), c[3], (c[4], c[5]), (c[7],), (c[10],), c[13], c[14], c[15], sizes, law,
        1e-6, (c[16],), (c[19],),
    )  # fmt: skip
    return (*force, *turn_1, *turn_2, *slide, *roll, normal)


@njit(**OPTIONS)
def _one_by_one(dim: Any, given: Any, law: Law, found: Any) -> None:
    for i in range(len(given)):
        results = _of_law(to_fixed_tuple(given[i], 25), law, dim)
        for k in range(len(results)):
            found[i, k] = results[k]


@njit(**OPTIONS)
def _in_lanes(dim: Any, lanes: Any, given: Any, law: Law, found: Any) -> None:
    for i in range(len(given)):
        one = every(lanes, 0.0)
        five = (one, one, one, one, one)
        columns = five + five + five + five + five
        results = _of_law(columns_at(columns, given, i * 25 * len(lanes)), law, dim)
        put_columns(results, found, i * len(results) * len(lanes))


def _contacts() -> np.ndarray:
    """Sticking, slipping and parting contacts, one a row."""
    rng = np.random.default_rng(1)
    given = rng.normal(0.0, 1.0, (640, 25)) * np.repeat(
        [1.0, 1e-5, 0.3, 40.0, 40.0, 1e-3, 2e-4, 1.0, 1.0, 1e-4, 1.0],
        [3, 1, 3, 3, 3, 2, 1, 3, 3, 1, 2],
    )
    given[:, :3] /= np.linalg.norm(given[:, :3], axis=1)[:, None]
    given[:, 3] = abs(given[:, 3])
    given[:, 22:] = abs(given[:, 22:])
    return given


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("law", LAWS)
def test_the_law_finds_the_same_digits_in_lanes(dimension: int, law: Law) -> None:
    dim, given = dim_of(dimension), _contacts()
    plain = np.zeros((len(given), dimension + 4 * len(SPINS[dimension]) + 1))
    _one_by_one(dim, given, law, plain)
    assert np.isfinite(plain).all()
    for width in WIDTHS:
        blocks = np.ascontiguousarray(given.reshape(-1, width, 25).transpose(0, 2, 1))
        found = np.zeros((len(blocks), plain.shape[1], width))
        _in_lanes(dim, (0.0,) * width, blocks, law, found)
        np.testing.assert_array_equal(found.transpose(0, 2, 1).reshape(plain.shape), plain)


@pytest.mark.parametrize("dimension", [2, 3])
def test_the_law_compiles_for_graphics_processors(dimension: int) -> None:
    alone = njit(**OPTIONS)(_of_law.py_func)
    alone.compile((typeof((0.0,) * 25), typeof(LAWS[0]), typeof(dim_of(dimension))))
    (text,), (compiled,) = alone.inspect_llvm().values(), alone.overloads.values()
    functions = {f.name: str(f) for f in binding.parse_assembly(text).functions}
    law = functions.pop(compiled.fndesc.llvm_func_name)
    called = [declared for name, declared in functions.items() if f"@{name}(" in law]
    # What is left out tells of the processor here.
    bare = re.sub(r"#\d+|, ![\w.]+ !\d+", "", "\n".join([*called, law]))
    target = "nvptx64-nvidia-cuda"
    binding.initialize_all_targets()
    binding.initialize_all_asmprinters()
    machine = binding.Target.from_triple(target).create_target_machine(cpu="sm_90")
    module = binding.parse_assembly(
        f'target triple = "{target}"\n' + bare.replace(compiled.fndesc.llvm_func_name, "law")
    )
    found = machine.emit_assembly(module)
    assert "fma.rn.f64" in found
    assert ("sqrt.rn.f64" in found) == ("div.rn.f64" in found) == (dimension == 3)


@pytest.fixture(scope="module", params=[2, 3])
def settling(request: pytest.FixtureRequest) -> Solver:
    made = solver(request.param, 400)
    made.advance(np.zeros(3002))
    assert len(made.contacts.first) > 10
    return made


def test_both_grains_keep_opposite_histories(settling: Solver) -> None:
    moving, dimension = settling.moving, settling.dimension
    near, spins = moving.near, len(SPINS[dimension])
    place, width = lanes_of(moving.bound, near), near.grain.shape[1]
    kept = {}
    for i, (s, lane) in enumerate(zip(place // width, place % width, strict=True)):
        for row in range(near.first_row[s], near.last_row[s]):
            kept[i, int(near.other[row, lane])] = near.history[row, :, lane]
    signs = np.repeat([1.0 if dimension == 2 else -1.0, -1.0], spins)
    held = [(i, j) for (i, j), history in kept.items() if i < j and history.any()]
    assert len(held) > 10
    for i, j in held:
        np.testing.assert_array_equal(kept[j, i], signs * kept[i, j])


def test_slices_of_any_width_compute_the_same_digits(settling: Solver) -> None:
    moving, scene, dim = settling.moving, settling.scene, settling._dim
    # Chunks of two grains: all lanes behind the second repeat it.
    grains, bound = moving.grains, np.arange(0, 401, 2)
    found = []
    for width in WIDTHS:
        near = new_near_pairs(dim, width, bound, grains, moving.pairs, settling.contacts, 1e-5)
        own = grains._replace(
            force=np.zeros_like(grains.force), moment=np.zeros_like(grains.moment)
        )
        ahead = np.zeros_like(grains.position)
        given = own, ahead, moving.coefficients, near, scene.grain_law, scene.damping, scene.gravity
        speeds2 = [
            pass_pairs(dim, (0.0,) * width, c, *given, scene.dt, True)
            for c in range(len(bound) - 1)
        ]
        after = contacts_of(dim, bound, grains, near)
        found.append([own.force, own.moment, ahead, np.array(speeds2), *after])
    for others in found[1:]:
        for one, other in zip(found[0], others, strict=True):
            np.testing.assert_array_equal(one, other)


def test_the_widest_vectors_of_the_processor_are_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    for features, width in (("+avx2,+avx512f", 8), ("+avx2,-avx512f", 4), ("", 2)):
        monkeypatch.setattr(numba.config, "CPU_FEATURES", features)
        assert len(lanes_of_processor()) == width
