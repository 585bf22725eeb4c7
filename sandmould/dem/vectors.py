"""Vectors as tuples in compiled code: two or three components, the same names for both.

A spin has one component in 2D and three in 3D. What lies in the tangent plane of a contact is one
number in 2D, along t = (-n_y, n_x), and a vector in 3D; the functions on tangents hide that.
Compiled code picks the version by the length of its first tuple, so neither pays for the other.
These functions exist in compiled code alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numba.extending import overload, register_jitable

from sandmould.dem.lanes import fused, where

OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
"""How every kernel is compiled: each operation rounds by itself but for ``fused``, so that digits
depend neither on the processor nor on how many lanes it has."""
INLINED = OPTIONS | {"forceinline": True}
"""For functions called for every contact: their many arguments stay in registers."""
index = np.uint64
"""Turns a row number into an index that never counts from the end, which need not be asked then."""
PLANE = (0.0, 0.0)
"""Pass as ``dim`` for 2D."""
SPACE = (0.0, 0.0, 0.0)
"""Pass as ``dim`` for 3D."""


def dim_of(dimension: int) -> tuple[float, ...]:
    """Tuple whose length tells compiled code the dimension."""
    return PLANE if dimension == 2 else SPACE


def _by_length(name: str, doc: str, **versions: Callable[..., Any]) -> Any:
    """Make a function of compiled code out of its versions for one, two or three components."""

    def declared(*args: Any) -> Any:
        raise TypeError(f"{name} works in compiled code alone")

    declared.__name__, declared.__doc__ = name, doc

    @overload(declared, strict=False)
    def choose(first: Any, *others: Any) -> Callable[..., Any] | None:
        return versions.get(("one", "two", "three")[len(first) - 1])

    return declared


dot = _by_length(
    "dot",
    "Scalar product.",
    one=lambda a, b: a[0] * b[0],
    two=lambda a, b: fused(a[1], b[1], a[0] * b[0]),
    three=lambda a, b: fused(a[2], b[2], fused(a[1], b[1], a[0] * b[0])),
)
plus = _by_length(
    "plus",
    "a + s b, called as plus(a, s, b).",
    one=lambda a, s, b: (fused(s, b[0], a[0]),),
    two=lambda a, s, b: (fused(s, b[0], a[0]), fused(s, b[1], a[1])),
    three=lambda a, s, b: (fused(s, b[0], a[0]), fused(s, b[1], a[1]), fused(s, b[2], a[2])),
)
times = _by_length(
    "times",
    "s a, called as times(a, s).",
    one=lambda a, s: (s * a[0],),
    two=lambda a, s: (s * a[0], s * a[1]),
    three=lambda a, s: (s * a[0], s * a[1], s * a[2]),
)
kept_where = _by_length(
    "kept_where",
    "v where a condition holds, zeros elsewhere: kept_where(v, condition).",
    one=lambda v, c: (where(c, v[0], 0.0),),
    two=lambda v, c: (where(c, v[0], 0.0), where(c, v[1], 0.0)),
    three=lambda v, c: (where(c, v[0], 0.0), where(c, v[1], 0.0), where(c, v[2], 0.0)),
)
load = _by_length(
    "load",
    "Row i of an array of vectors: load(dim, array, i).",
    two=lambda dim, a, i: (a[index(i), 0], a[index(i), 1]),
    three=lambda dim, a, i: (a[index(i), 0], a[index(i), 1], a[index(i), 2]),
)
load_spin = _by_length(
    "load_spin",
    "Row i of an array of spins, moments or tangents: load_spin(dim, array, i).\n\n"
    "In 2D the last component, so that arrays of three serve too.",
    two=lambda dim, a, i: (a[index(i), index(a.shape[1] - 1)],),
    three=lambda dim, a, i: (a[index(i), 0], a[index(i), 1], a[index(i), 2]),
)
no_vector = _by_length(
    "no_vector",
    "Vector of zeros: no_vector(dim).",
    two=lambda dim: (0.0, 0.0),
    three=lambda dim: (0.0, 0.0, 0.0),
)
no_spin = _by_length(
    "no_spin",
    "Spin, moment or tangent of zeros: no_spin(dim).",
    two=lambda dim: (0.0,),
    three=lambda dim: (0.0, 0.0, 0.0),
)


def _store_1(v: Any, a: Any, i: Any) -> None:
    a[index(i), index(a.shape[1] - 1)] = v[0]


def _store_2(v: Any, a: Any, i: Any) -> None:
    a[index(i), 0] = v[0]
    a[index(i), 1] = v[1]


def _store_3(v: Any, a: Any, i: Any) -> None:
    a[index(i), 0] = v[0]
    a[index(i), 1] = v[1]
    a[index(i), 2] = v[2]


store = _by_length(
    "store",
    "Write a vector to row i, a spin in 2D to the last component: store(v, array, i).",
    one=_store_1,
    two=_store_2,
    three=_store_3,
)


def _add_1(v: Any, s: Any, a: Any, i: Any) -> None:
    a[index(i), index(a.shape[1] - 1)] += s * v[0]


def _add_2(v: Any, s: Any, a: Any, i: Any) -> None:
    a[index(i), 0] += s * v[0]
    a[index(i), 1] += s * v[1]


def _add_3(v: Any, s: Any, a: Any, i: Any) -> None:
    a[index(i), 0] += s * v[0]
    a[index(i), 1] += s * v[1]
    a[index(i), 2] += s * v[2]


add_to = _by_length(
    "add_to",
    "Add s v to row i, a spin in 2D to the last component: add_to(v, s, array, i).",
    one=_add_1,
    two=_add_2,
    three=_add_3,
)
without = _by_length(
    "without",
    "Part of v in the plane of n in 3D: without(n, v).",
    three=lambda n, v: plus(v, -dot(n, v), n),
)
in_space = _by_length(
    "in_space",
    "A tangent as a vector: in_space(n, t).",
    two=lambda n, t: (-n[1] * t[0], n[0] * t[0]),
    three=lambda n, t: t,
)
cross = _by_length(
    "cross",
    "Vector product in 3D, its only component in 2D: cross(a, b).",
    two=lambda a, b: fused(a[0], b[1], -(a[1] * b[0])),
    three=lambda a, b: (
        fused(a[1], b[2], -(a[2] * b[1])),
        fused(a[2], b[0], -(a[0] * b[2])),
        fused(a[0], b[1], -(a[1] * b[0])),
    ),
)
of_other = _by_length(
    "of_other",
    "A tangent as the other body has it, whose normal is opposite: of_other(dim, t).\n\n"
    "In 2D the tangent t turns round with the normal.",
    two=lambda dim, t: t,
    three=lambda dim, t: times(t, -1.0),
)
spin_slip = _by_length(
    "spin_slip",
    "Tangent w x n, the velocity at the end of a unit arm along n: spin_slip(n, w).",
    two=lambda n, w: (w[0],),
    three=lambda n, w: cross(w, n),
)
turned_spin = _by_length(
    "turned_spin",
    "w and s v times the part of w along n in 3D: turned_spin(n, w, s, v).\n\n"
    "With the slip w x n it makes w x (n - s v), but for what lies along n.",
    two=lambda n, w, s, v: w,
    three=lambda n, w, s, v: plus(w, s * dot(w, n), v),
)
tangent_moment = _by_length(
    "tangent_moment",
    "Moment n x t of a tangent force at the end of a unit arm along n: tangent_moment(n, t).",
    two=lambda n, t: (t[0],),
    three=lambda n, t: cross(n, t),
)
tangent_after = _by_length(
    "tangent_after",
    "The tangent t of the last step in the plane of n, and s times that of v, eq. (22) with its\n"
    "missing factor n: tangent_after(n, t, s, v).\n\n"
    "The length of t falls by the square of the angle turned in a step, some 1e-9 of it.",
    two=lambda n, t, s, v: (fused(s, cross(n, v), t[0]),),
    three=lambda n, t, s, v: without(n, plus(t, s, v)),
)
rolling_part = _by_length(
    "rolling_part",
    "Part of a relative spin or its moment that rolls: rolling_part(n, w, torsion).\n\n"
    "In 3D the spin about n is left out unless torsion is resisted too.",
    two=lambda n, w, torsion: w,
    three=lambda n, w, torsion: w if torsion else without(n, w),
)


@register_jitable
def _one_component(action: Any, rate: Any, alpha: float) -> Any:
    against = alpha * abs(action)
    return action - where(rate > 0.0, against, where(rate < 0.0, -against, 0.0))


@register_jitable
def _limited_3(action: Any, limit: float) -> Any:
    # Without a branch: which contacts slip cannot be foretold, and a wrong guess costs more.
    return times(action, limit / math.sqrt(max(dot(action, action), limit * limit + 1e-300)))


limited = _by_length(
    "limited",
    "Return mapping, eqs. (26)-(28): an action no larger than the limit stays as it is:\n"
    "limited(action, limit).",
    one=lambda a, limit: (max(-limit, min(limit, a[0])),),
    three=lambda a, limit: _limited_3(a, limit),
)
damped_by_component = _by_length(
    "damped_by_component",
    "(39) and (38) component by component: damped_by_component(action, rate, alpha).",
    one=lambda a, v, alpha: (_one_component(a[0], v[0], alpha),),
    two=lambda a, v, alpha: (
        _one_component(a[0], v[0], alpha),
        _one_component(a[1], v[1], alpha),
    ),
    three=lambda a, v, alpha: (
        _one_component(a[0], v[0], alpha),
        _one_component(a[1], v[1], alpha),
        _one_component(a[2], v[2], alpha),
    ),
)


def _rotate_1(angle: Any, orientation: Any, i: Any) -> None:
    orientation[i, 0] += angle[0]


def _rotate_3(angle: Any, orientation: Any, i: Any) -> None:
    size2 = angle[0] ** 2 + angle[1] ** 2 + angle[2] ** 2
    size = math.sqrt(size2)
    a = math.sin(size) / size if size > 0.0 else 1.0
    b = (1.0 - math.cos(size)) / size2 if size > 1e-6 else 0.5
    c = math.cos(size)
    for column in range(3):
        x, y, z = (
            orientation[i, column],
            orientation[i, 3 + column],
            orientation[i, 6 + column],
        )
        along = b * (angle[0] * x + angle[1] * y + angle[2] * z)
        orientation[i, column] = c * x + a * (angle[1] * z - angle[2] * y) + along * angle[0]
        orientation[i, 3 + column] = c * y + a * (angle[2] * x - angle[0] * z) + along * angle[1]
        orientation[i, 6 + column] = c * z + a * (angle[0] * y - angle[1] * x) + along * angle[2]


rotate = _by_length(
    "rotate",
    "Turn row i of orientations by a small rotation: rotate(angle, orientation, i).\n\n"
    "An angle in 2D, eq. (8); a rotation matrix row by row in 3D, eqs. (10)-(13).",
    one=_rotate_1,
    three=_rotate_3,
)
