"""How a pattern is held: clamped, resting on rollers, hung, bedded on sand or free."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sandmould.pattern_fe.checks import place
from sandmould.pattern_fe.space import Space

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
AXES = "xyz"


@dataclass(frozen=True)
class Supports:
    """Named boundaries and what holds them; without any the pattern is free.

    A free pattern has no static equilibrium of its own: only its motion can be computed, unless a
    bedding holds it.
    """

    clamped: tuple[str, ...] = ()
    """Boundaries that do not move."""
    resting: tuple[str, ...] = ()
    """Flat boundaries that slide in their plane without friction but neither sink nor lift."""
    bedding_n_m3: float = 0.0
    """Springs all over the surface, N/m per m2 of it: a plain model of sand that holds a pattern
    (Winkler), and what makes the equations of a free one regular. 0 for none."""
    hung: tuple[tuple[tuple[float, ...], tuple[float, ...]], ...] = ()
    """Least and greatest corner (m) of boxes, as the mesh lies; what is in one does not move."""


def fixed_components(space: Space, supports: Supports) -> Mask:
    """Components of the displacement that supports keep at zero, (n, d) bool.

    Raises
    ------
    ValueError
        When a boundary is not there, a resting one is not across an axis, a box holds no node, or
        the bedding is negative.
    """
    if not 0.0 <= supports.bedding_n_m3 < np.inf:
        raise ValueError(f"bedding is {supports.bedding_n_m3:g} N/m3, valid is 0 or above")
    boundaries = sorted(space.mesh.boundaries or {})
    for name in (*supports.clamped, *supports.resting):
        if name not in boundaries:
            valid = ", ".join(boundaries) or "none, for the mesh names no boundary"
            raise ValueError(f"support on the boundary '{name}', which is not there: valid {valid}")
    fixed = np.zeros(space.node_m.shape, dtype=bool)
    for name in supports.clamped:
        fixed[space.nodes_of(name)] = True
    for name in supports.resting:
        nodes = space.nodes_of(name)
        fixed[nodes, _flat_axis(name, space.node_m[nodes])] = True
    for box in supports.hung:
        fixed[_nodes_in(space, *box)] = True
    return fixed


def _nodes_in(space: Space, low_m: tuple[float, ...], high_m: tuple[float, ...]) -> Mask:
    """Nodes in a box, its sides among it, (n,) bool."""
    place_m, d = space.node_m, space.dimension
    if not len(low_m) == len(high_m) == d:
        raise ValueError(f"a box that hangs the pattern has corners of {d} numbers each")
    near_m = 1e-9 * float(np.ptp(place_m, axis=0).max())
    inside = (place_m >= np.array(low_m) - near_m) & (place_m <= np.array(high_m) + near_m)
    found = inside.all(axis=1)
    if not found.any():
        reach = " to ".join(place(corner) for corner in (low_m, high_m))
        own = " to ".join(place(end(place_m, axis=0)) for end in (np.min, np.max))
        raise ValueError(
            f"the box that hangs the pattern, {reach} m, holds no node of it; the pattern reaches "
            f"from {own} m, and a box thinner than an element may miss its nodes"
        )
    return np.asarray(found)


def _flat_axis(name: str, place_m: Array) -> int:
    """Axis across which a boundary lies."""
    extent = np.ptp(place_m, axis=0)
    axis = int(extent.argmin())
    if extent[axis] > 1e-9 * extent.max():
        across = f"{extent[axis]:.3g} m across its flattest axis"
        raise ValueError(f"resting boundary '{name}' extends {across}, valid is a flat one")
    return axis


def rigid_motions(node_m: Array) -> Array:
    """Translations along the axes and small rotations about the middle, all of a size.

    Gives (n d, 3 or 6) float64. ``node_m``: (n, d) float64, m.
    """
    n, d = node_m.shape
    arm = (node_m - node_m.mean(axis=0)) / np.ptp(node_m, axis=0).max()
    motions = [np.tile(np.eye(d)[axis], (n, 1)) for axis in range(d)]
    for i, j in ((0, 1),) if d == 2 else ((1, 2), (2, 0), (0, 1)):
        turn = np.zeros((n, d))
        turn[:, i], turn[:, j] = -arm[:, j], arm[:, i]
        motions.append(turn)
    return np.stack([m.ravel() for m in motions], axis=1)


def loose_motions(space: Space, fixed: Mask) -> list[str]:
    """Rigid motions that supports leave its bodies, each named by its largest part.

    ``fixed``: (n, d) bool.
    """
    bodies = space.body_of_node
    each = [bodies == number for number in range(bodies.max() + 1)]
    return [loose for body in each for loose in _loose_of_body(space.node_m[body], fixed[body])]


def _loose_of_body(node_m: Array, fixed: Mask) -> list[str]:
    """The null space of what the supports of a body see of all its rigid motions."""
    d = node_m.shape[1]
    names = [f"shift along {AXES[i]}" for i in range(d)]
    names += ["turn"] if d == 2 else [f"turn about {axis}" for axis in AXES]
    seen = rigid_motions(node_m)[fixed.ravel()]
    _, size, rows = np.linalg.svd(
        np.vstack([seen, np.zeros((len(names), len(names)))]), full_matrices=False
    )
    loose = rows[size <= 1e-8 * max(1.0, float(size[0]))]
    return [names[int(np.abs(row).argmax())] for row in loose]


def check_held(space: Space, fixed: Mask, supports: Supports) -> None:
    """Refuse statics of a pattern that can move without deforming (ValueError)."""
    if supports.bedding_n_m3 > 0.0:
        return
    loose = loose_motions(space, fixed)
    if not loose:
        return
    held = (
        "has supports that leave it free to" if fixed.any() else "has no support, so it is free to"
    )
    valid = "enough clamped or resting boundaries, or a bedding (its motion can be computed free)"
    raise ValueError(f"pattern {held} {', '.join(loose)}; valid for a static solution: {valid}")
