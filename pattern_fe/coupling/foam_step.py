"""One step of a condensed pattern by central differences, as the step of an engine calls it."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

from numba import carray

from sandmould.compiled import cfunc, njit
from sandmould.dem.addresses import Floats, Ints, int_line_at, line_at, rows_at, to_ints
from sandmould.dem.vectors import OPTIONS
from sandmould.pattern_fe.coupling.contact_step import hold_out

STEP, KEEPS, GAINS, OMEGA2, DAMPING, LIMIT = range(6)
"""Places in ``FoamArrays.numbers``."""
WORK, DAMPED, STOPPED, STEPS, CONTACT = range(5)
"""Places in ``FoamArrays.sums``."""


class FoamArrays(NamedTuple):
    """A pattern in motion: M a + alpha M v + S u = f with M = s M0 + S / omega^2.

    What is integrated is the momentum M v and its sum M u; the displacement follows by one product
    with the inverse of M, and the elastic force S u = omega^2 (M u - s M0 u) by none. Components
    run vertex by vertex, held ones at the end until n is a multiple of four.
    """

    inverse: Floats
    """(n, n) float64, 1/kg: of M, symmetric, 0 in rows of held components."""
    mass: Floats
    """(n,) float64, kg: s M0, 0 where held."""
    free: Floats
    """(n,) float64: 1, or 0 where held."""
    numbers: Floats
    """(6,) float64: step (s); what damping leaves of a momentum in a step, and the time (s) that a
    force acts on it; omega^2 (1/s2); alpha (1/s); displacement (m) beyond which it stops."""
    pressed: Ints
    """(n_line,) int64: components of the vertices that grains touch."""
    load: Floats
    """(nv, d) float64, N: of the grains on these vertices, at the last step."""
    speed: Floats
    """(nv, d) float64, m/s: of these vertices until the next step."""
    load_sum: Floats
    """(nv, d) float64, N: of all loads since the last record."""
    momentum: Floats
    """(n,) float64, kg m/s: M v, half a step behind the displacement."""
    moved_mass: Floats
    """(n,) float64, kg m: M u."""
    displacement: Floats
    before: Floats
    """(n,) float64, m: now and a step ago."""
    velocity: Floats
    """(n,) float64, m/s, half a step ago."""
    force: Floats
    """(n,) float64, N: the loads among all components."""
    mean_momentum: Floats
    """(n,) float64, kg m/s: scratch."""
    sums: Floats
    """(5,) float64: work of the loads and what damping took of it (J), whether the pattern has
    stopped because it ran away, steps since the last record, what contact took of the work (J)."""
    impulse: Floats
    """(n,) float64, kg m: scratch."""
    low: Floats
    """From here on as in ``ContactArrays``."""
    high: Floats
    segments: Floats
    starts: Ints
    corners: Floats
    drawn: Floats
    clear: Floats
    clear_at: Floats
    wall: Floats
    push: Floats
    push_sum: Floats


_FIELDS = len(FoamArrays._fields)


@njit(**OPTIONS | {"fastmath": {"contract", "nsz", "reassoc"}})
def _product(matrix: Floats, vector: Floats, result: Floats) -> None:
    """Product of a symmetric matrix and a vector, their rows a multiple of four."""
    # Memory is what it waits for: entries below the diagonal are not read.
    result[:] = 0.0
    for j in range(0, len(vector), 4):
        a, b, c, d = vector[j], vector[j + 1], vector[j + 2], vector[j + 3]
        for k in range(4):
            row = matrix[j + k]
            for i in range(4):
                result[j + k] += row[j + i] * vector[j + i]
        row_a, row_b, row_c, row_d = matrix[j], matrix[j + 1], matrix[j + 2], matrix[j + 3]
        row_a, row_b, row_c, row_d = row_a[j + 4 :], row_b[j + 4 :], row_c[j + 4 :], row_d[j + 4 :]
        beyond, below = vector[j + 4 :], result[j + 4 :]
        sum_a = sum_b = sum_c = sum_d = 0.0
        for i in range(len(beyond)):
            below[i] += (row_a[i] * a + row_b[i] * b) + (row_c[i] * c + row_d[i] * d)
            sum_a += row_a[i] * beyond[i]
            sum_b += row_b[i] * beyond[i]
            sum_c += row_c[i] * beyond[i]
            sum_d += row_d[i] * beyond[i]
        result[j] += sum_a
        result[j + 1] += sum_b
        result[j + 2] += sum_c
        result[j + 3] += sum_d


@njit(**OPTIONS)
def _push(foam: FoamArrays) -> None:
    """Add the impulse of a step to the momenta, and these to the momenta's sums."""
    # Names of their own: taking an array out of a tuple inside the loop counts references.
    force, mass, free, displacement = foam.force, foam.mass, foam.free, foam.displacement
    momentum, mean_momentum, moved_mass = foam.momentum, foam.mean_momentum, foam.moved_mass
    numbers = foam.numbers
    dt, keeps, gains, omega2 = numbers[STEP], numbers[KEEPS], numbers[GAINS], numbers[OMEGA2]
    for i in range(len(force)):
        elastic = omega2 * (moved_mass[i] - mass[i] * displacement[i])
        old = momentum[i]
        new = free[i] * (keeps * old + gains * (force[i] - elastic))
        momentum[i] = new
        mean_momentum[i] = 0.5 * (old + new)
        moved_mass[i] += dt * new


@njit(**OPTIONS)
def _press(foam: FoamArrays) -> None:
    """Add what floor, walls and obstacles do in this step."""
    impulse, push, numbers = foam.impulse, foam.push, foam.numbers
    momentum, mean_momentum, moved_mass = foam.momentum, foam.mean_momentum, foam.moved_mass
    dt, gains = numbers[STEP], numbers[GAINS]
    push[:] = 0.0
    if hold_out(foam, foam.pressed, foam.inverse, foam.before, foam.displacement, impulse):
        for i in range(len(impulse)):
            moved_mass[i] += impulse[i]
            momentum[i] += impulse[i] / dt
            mean_momentum[i] += 0.5 * impulse[i] / dt
            push[i] = impulse[i] / (dt * gains)


@njit(**OPTIONS)
def _move(foam: FoamArrays) -> bool:
    """Find displacements and velocities from the momenta; gives whether all are within bounds."""
    force, mean_momentum, velocity = foam.force, foam.mean_momentum, foam.velocity
    displacement, before, sums = foam.displacement, foam.before, foam.sums
    numbers = foam.numbers
    dt, alpha, limit = numbers[STEP], numbers[DAMPING], numbers[LIMIT]
    before[:] = displacement
    _product(foam.inverse, foam.moved_mass, displacement)
    _press(foam)
    push, push_sum = foam.push, foam.push_sum
    work = damped = taken = 0.0
    bounded = True
    for i in range(len(velocity)):
        new = (displacement[i] - before[i]) / dt
        mean = 0.5 * (velocity[i] + new)
        velocity[i] = new
        work += force[i] * mean
        damped += mean_momentum[i] * mean
        taken -= push[i] * mean
        push_sum[i] += push[i]
        bounded = bounded and abs(displacement[i]) <= limit
    sums[WORK] += dt * work
    sums[DAMPED] += dt * alpha * damped
    sums[CONTACT] += dt * taken
    return bounded


@njit(**OPTIONS)
def step_foam(foam: FoamArrays) -> None:
    """Go on by one step under the loads of the last one; stand still after having run away."""
    sums, pressed, force, velocity = foam.sums, foam.pressed, foam.force, foam.velocity
    load, speed, load_sum = foam.load.ravel(), foam.speed.ravel(), foam.load_sum.ravel()
    if sums[STOPPED] == 0.0:
        for k in range(len(pressed)):
            force[pressed[k]] = load[k]
            load_sum[k] += load[k]
        _push(foam)
        sums[STEPS] += 1.0
        if not _move(foam):
            sums[STOPPED] = 1.0
    for k in range(len(pressed)):
        speed[k] = velocity[pressed[k]] if sums[STOPPED] == 0.0 else 0.0


@njit(**OPTIONS)
def _open(address: Any) -> FoamArrays:
    """Make the arrays out of the table at an address, in the order of the fields."""
    table = carray(to_ints(address), (_FIELDS, 3))
    return FoamArrays(
        rows_at(table, 0),
        line_at(table, 1),
        line_at(table, 2),
        line_at(table, 3),
        int_line_at(table, 4),
        rows_at(table, 5),
        rows_at(table, 6),
        rows_at(table, 7),
        line_at(table, 8),
        line_at(table, 9),
        line_at(table, 10),
        line_at(table, 11),
        line_at(table, 12),
        line_at(table, 13),
        line_at(table, 14),
        line_at(table, 15),
        line_at(table, 16),
        line_at(table, 17),
        line_at(table, 18),
        rows_at(table, 19),
        int_line_at(table, 20),
        rows_at(table, 21),
        rows_at(table, 22),
        line_at(table, 23),
        rows_at(table, 24),
        line_at(table, 25),
        line_at(table, 26),
        line_at(table, 27),
    )


def _step_at(table: int, step: int) -> int:
    step_foam(_open(table))
    return 0


@lru_cache
def _compiled() -> Any:
    return cfunc("int64(int64, int64)")(_step_at)


def address_of_step() -> int:
    """Address of the function that steps the arrays of a table; see ``StepMover``."""
    address: int = _compiled().address
    return address
