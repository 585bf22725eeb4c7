"""The reference solver's bookkeeping: pairs, history, threads, state."""

from __future__ import annotations

import numpy as np
import pytest

from sandmould.dem import moving_state
from sandmould.dem.contact_law import Law
from sandmould.dem.grains import Grains
from sandmould.dem.motion import ISOTROPIC, NONE, Damping
from sandmould.dem.near_pairs import lanes_of, new_near_pairs
from sandmould.dem.neighbours import list_pairs, make_grid, sort_into_cells
from sandmould.dem.solver import NotANumberError, Solver
from sandmould.dem.steps import DemScene
from sandmould.dem.surfaces import Surfaces

LAW = Law(7e4, 7e4, 0.8, 0.3, 0.1, 7e4, True, False)
STEP_S = 5e-6


def scene(dimension: int, **changes: object) -> DemScene:
    down = (0.0,) * (dimension - 1) + (-9.81,)
    up = (0.0,) * (dimension - 1) + (1.0,)
    base = DemScene(LAW, LAW, Damping(NONE, 0.0, 0.0), down, up, True, STEP_S)
    return base._replace(**changes)


def box(dimension: int, width_m: float) -> Surfaces:
    """A floor and side walls."""
    surfaces, unit = Surfaces(dimension), np.eye(dimension)
    surfaces.add_plane("floor", np.zeros(dimension), unit[-1])
    for axis in range(dimension - 1):
        surfaces.add_plane(f"low_{axis}", np.zeros(dimension), unit[axis])
        surfaces.add_plane(f"high_{axis}", width_m * unit[axis], -unit[axis])
    return surfaces


def cloud(dimension: int, n: int, seed: int = 1, fall_m_s: float = 0.5) -> tuple[Grains, float]:
    """Grains of two sizes on a loose grid over the floor, falling; and the width of the box."""
    rng = np.random.default_rng(seed)
    across = int(np.ceil(n ** (1 / dimension)))
    cells = np.stack(np.meshgrid(*[np.arange(across)] * dimension, indexing="ij"), -1)
    position = (cells.reshape(-1, dimension)[:n] + 0.5) * 4.1e-3
    position += rng.uniform(-1e-5, 1e-5, position.shape)
    radius = rng.choice([1.0e-3, 2e-3], n)
    mass = 2400 * 4 / 3 * np.pi * radius**3
    spins = 1 if dimension == 2 else 3
    velocity = np.zeros((n, dimension))
    velocity[:, -1] = -fall_m_s
    velocity += rng.normal(0, 0.05, velocity.shape)
    spin = rng.normal(0, 20, (n, spins))
    return (
        Grains.of(
            np.arange(1, n + 1),
            position,
            velocity,
            spin,
            radius,
            mass,
            0.4 * mass * radius**2,
        ),
        across * 4.1e-3,
    )


def solver(dimension: int, n: int, threads: int = 1, **changes: object) -> Solver:
    grains, width_m = cloud(dimension, n)
    made = Solver(scene(dimension, **changes), box(dimension, width_m), 6e-4, threads)
    made.add(grains)
    return made


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("seed", range(3))
def test_every_near_pair_is_listed_with_both_grains(dimension: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    grains, _ = cloud(dimension, 300)
    # crowded, and two far away as lost grains are
    grains = grains._replace(position=rng.uniform(0, 0.03, (300, dimension)))
    grains.position[0] += 5.0
    grains.position[1] -= 3.0
    skin = 5e-4
    low, high = grains.position.min(axis=0), grains.position.max(axis=0)
    grid = make_grid(low, high, 4e-3 + skin, 300)
    order, start = sort_into_cells(grains.position, grid)
    pairs = list_pairs(grains.ordered(order), start, grid, skin)
    first = np.repeat(np.arange(300), np.diff(pairs.start))
    other = order[pairs.other.astype(int)]
    found = set(zip(order[first].tolist(), other.tolist(), strict=True))
    apart = np.linalg.norm(grains.position[:, None] - grains.position[None], axis=2)
    near = apart < grains.radius[:, None] + grains.radius[None] + skin
    np.fill_diagonal(near, False)
    expected = {(i, j) for i, j in np.argwhere(near).tolist()}
    assert len(found) == len(pairs.other)
    assert found == expected


class AlwaysLooking(Solver):
    """Looks at every part of the surfaces near a grain in every step."""

    def _list(self, shift: np.ndarray) -> None:
        super()._list(shift)
        walls = self.moving.walls
        assert len(walls.due)
        self.moving = self.moving._replace(walls=walls._replace(due=np.zeros(0)))


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("box_frame", [True, False])
def test_parts_that_are_seldom_looked_at_are_felt_as_others(
    dimension: int, box_frame: bool
) -> None:
    """A fine mesh rises into falling grains while the box shakes."""
    grains, width_m = cloud(dimension, 60)
    cuts = np.linspace(0.0, width_m, 15)
    if dimension == 2:
        vertices = np.stack([cuts, 0.001 * np.sin(900.0 * cuts)], axis=1)
        facets = np.stack([np.arange(14), np.arange(1, 15)], axis=1)
    else:
        x, y = (a.ravel() for a in np.meshgrid(cuts, cuts, indexing="ij"))
        vertices = np.stack([x, y, 0.001 * np.sin(900.0 * x)], axis=1)
        first = (np.arange(14)[:, None] * 15 + np.arange(14)).ravel()
        facets = np.concatenate(
            [np.stack([first, first + a, first + b], axis=1) for a, b in ((15, 16), (16, 1))]
        )
    ends = []
    for kind in (Solver, AlwaysLooking):
        surfaces = box(dimension, width_m)
        surfaces.add_facets("mesh", vertices, facets)
        made = kind(scene(dimension, box_frame=box_frame), surfaces, 6e-4)
        made.add(grains._replace(velocity=grains.velocity.copy()))
        surfaces.set_motion("mesh", vertices + 0.002 * np.eye(dimension)[-1], 0.01, STEP_S)
        made.advance(2e-4 * np.sin(300.0 * STEP_S * np.arange(4002)))
        ends.append((made.grains.position, made.grains.spin, made.moving.walls.loads))
        assert made.moving.walls.loads[:, surfaces.vertices_of("mesh")].any()
    for one, other in zip(*ends, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("dimension", [2, 3])
def test_listing_again_changes_nothing(dimension: int) -> None:
    often, seldom = (solver(dimension, 200) for _ in range(2))
    for _ in range(60):
        often.advance(np.zeros(52))
        often._list(np.zeros(dimension))
        seldom.advance(np.zeros(52))
    assert often.lists > seldom.lists + 20
    assert len(often.contacts.first) > 3
    one, two = (s.grains.ordered(np.argsort(s.grains.id)) for s in (often, seldom))
    # The order of sums differs, and round-off grows a thousandfold in a few collisions.
    np.testing.assert_allclose(one.position, two.position, atol=1e-11)
    np.testing.assert_allclose(one.spin, two.spin, atol=1e-5)


def near_of(made: Solver) -> int:
    """Near pairs, each with both of its grains."""
    near = made.moving.near
    place = lanes_of(made.moving.bound, near)
    width = near.grain.shape[1]
    return sum(
        int((near.other[near.first_row[s] : near.last_row[s], lane] != i).sum())
        for i, (s, lane) in enumerate(zip(place // width, place % width, strict=True))
    )


@pytest.mark.parametrize("dimension", [2, 3])
def test_looks_for_near_pairs_change_no_bit(
    dimension: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    seldom, always, never = (solver(dimension, 200) for _ in range(3))
    fewer, make_room, more_room = 0, Solver._make_room, []
    monkeypatch.setattr(Solver, "_make_room", lambda s: more_room.append(s) or make_room(s))
    for _ in range(1000):
        always.moving.near.left[:] = -1.0
        moving = never.moving
        whole = new_near_pairs(
            never._dim,
            len(never._lanes),
            moving.bound,
            moving.grains,
            moving.pairs,
            never.contacts,
            1.0,
        )
        whole.left[:] = np.inf
        never.moving = moving._replace(near=whole)
        for s in (seldom, always, never):
            s.advance(np.zeros(5))
        fewer += near_of(seldom) < near_of(never) == len(never.moving.pairs.other)
        np.testing.assert_array_equal(seldom.grains.position, never.grains.position)
    assert fewer > 500  # some pairs were passed over, and looked at in every step by the other
    assert len(never.contacts.first) > 3
    assert seldom in more_room  # where a look found more than had room, contacts were kept
    for s in (seldom, always):
        np.testing.assert_array_equal(s.grains.position, never.grains.position)
        np.testing.assert_array_equal(s.contacts.friction, never.contacts.friction)


@pytest.mark.parametrize("dimension", [2, 3])
def test_threads_change_no_bit(dimension: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(moving_state, "CHUNK", 40)
    one, two = (solver(dimension, 400, threads=t) for t in (1, 2))
    two._threads = 2  # also where the machine has one core
    for s in (one, two):
        s.advance(np.zeros(3002))
    assert len(two.moving.bound) == 11
    assert len(one.contacts.first) > 10
    np.testing.assert_array_equal(one.grains.position, two.grains.position)
    np.testing.assert_array_equal(one.grains.spin, two.grains.spin)


def test_chunks_change_round_off_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = solver(3, 400)
    whole.advance(np.zeros(2002))
    monkeypatch.setattr(moving_state, "CHUNK", 40)
    parts = solver(3, 400)
    parts.advance(np.zeros(2002))  # not for long: round-off grows with every collision
    contacts, bound = parts.contacts, parts.moving.bound
    chunk = [np.searchsorted(bound, c, side="right") for c in (contacts.first, contacts.second)]
    assert (chunk[0] != chunk[1]).any()  # pairs touch across chunks
    one, two = (s.grains.ordered(np.argsort(s.grains.id)) for s in (whole, parts))
    np.testing.assert_allclose(one.position, two.position, atol=1e-11)
    np.testing.assert_allclose(one.force, two.force, atol=1e-6)


@pytest.mark.parametrize("dimension", [2, 3])
def test_restored_state_goes_on_bit_for_bit(dimension: int) -> None:
    straight = solver(dimension, 200)
    straight.advance(np.zeros(1502))
    resumed = Solver(straight.scene, box(dimension, 1.0), 6e-4)
    resumed.restore({name: array.copy() for name, array in straight.state().items()})
    lists = straight.lists
    for s in (straight, resumed):
        s.advance(np.zeros(1002))
    assert straight.lists > lists  # history went through a list
    assert resumed.steps == straight.steps
    for name, array in straight.state().items():
        np.testing.assert_array_equal(array, resumed.state()[name], err_msg=name)


@pytest.mark.parametrize("dimension", [2, 3])
def test_grains_fall_freely_once_the_gate_is_gone(dimension: int) -> None:
    grains, _ = cloud(dimension, 30)
    grains.position[:, :-1] += 0.1  # far from the side walls
    surfaces = box(dimension, 1.0)
    surfaces.add_plane("gate", np.zeros(dimension), np.eye(dimension)[-1])
    surfaces.remove("floor")
    s = Solver(scene(dimension), surfaces, 6e-4)
    s.add(grains)
    s.advance(np.zeros(20002))
    assert s.mean_loads(20000)["gate"][-1] < 0
    bonds = len(s.contacts.first)
    s.remove_surface("gate")
    assert len(s.contacts.first) == bonds > 0  # contacts of grains are kept
    s.advance(np.zeros(3))  # the first step still has the gate's last force

    def middle(values: np.ndarray) -> float:
        return float(s.grains.mass @ values[:, -1] / s.grains.mass.sum())

    height_m, speed_m_s, n = middle(s.grains.position), middle(s.grains.velocity), 2000
    s.advance(np.zeros(n + 2))
    assert "gate" not in s.mean_loads(n)
    # Central differences: the stored speeds are half a step old.
    exact = height_m + n * STEP_S * speed_m_s - 0.5 * 9.81 * n * (n + 1) * STEP_S**2
    assert middle(s.grains.position) == pytest.approx(exact, abs=1e-12)


@pytest.mark.parametrize("dimension", [2, 3])
def test_windows_add_up_to_one_long_run(dimension: int) -> None:
    cut, whole = (solver(dimension, 100) for _ in range(2))
    whole.advance(np.zeros(602))
    for _ in range(6):
        cut.advance(np.zeros(102))
    np.testing.assert_array_equal(cut.grains.position, whole.grains.position)


@pytest.mark.parametrize("dimension", [2, 3])
def test_momentum_and_angular_momentum_are_kept_without_walls(dimension: int) -> None:
    grains, _ = cloud(dimension, 150)
    middle = grains.position.mean(axis=0)
    grains.velocity[:] += 200 * (middle - grains.position)  # they meet in the middle
    free = scene(dimension, gravity=(0.0,) * dimension)
    s = Solver(free, Surfaces(dimension), 6e-4)
    s.add(grains)

    def momenta() -> tuple[np.ndarray, np.ndarray]:
        g = s.grains
        linear = g.mass[:, None] * g.velocity
        # half a step back, where the velocities are
        place = g.position - 0.5 * STEP_S * g.velocity
        if dimension == 2:
            turn = np.array([(place[:, 0] * linear[:, 1] - place[:, 1] * linear[:, 0]).sum()])
        else:
            turn = np.cross(place, linear).sum(axis=0)
        return linear.sum(axis=0), turn + (g.inertia[:, None] * g.spin).sum(axis=0)

    before = momenta()
    met = 0
    for _ in range(20):
        s.advance(np.zeros(102))
        met += len(s.contacts.first)
    after = momenta()
    assert met > 50
    scale = float((s.grains.mass * np.linalg.norm(s.grains.velocity, axis=1)).sum())
    np.testing.assert_allclose(after[0], before[0], atol=1e-12 * scale)
    # Turning moments act at whole steps, the momentum half a step away: v dt / 2 x F.
    np.testing.assert_allclose(after[1], before[1], atol=2e-5 * scale * 0.05)


def test_orientation_turns_by_the_integral_of_the_spin() -> None:
    grains, width_m = cloud(3, 2)
    grains.velocity[:] = 0.0
    spin = np.array([30.0, -20.0, 10.0])
    grains.spin[:] = spin
    free = scene(3, gravity=(0.0, 0.0, 0.0))
    s = Solver(free, box(3, width_m), 6e-4, orientations=True)
    s.add(grains)
    s.advance(np.zeros(20002))
    turned = s.orientation[0].reshape(3, 3)
    angle = 20000 * STEP_S * np.linalg.norm(spin)
    axis = spin / np.linalg.norm(spin)
    cross = np.cross(np.eye(3), -axis).T
    exact = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    np.testing.assert_allclose(turned, exact, atol=1e-10)
    np.testing.assert_allclose(turned @ turned.T, np.eye(3), atol=1e-11)


def test_another_step_leaves_the_velocities_of_now() -> None:
    s = solver(2, 30)
    s.advance(np.zeros(502))
    before, spin = s.whole_step_velocities()
    s.scene = s.scene._replace(dt=2.0 * STEP_S)
    s.change_step(STEP_S, 700)
    after, spin_after = s.whole_step_velocities()
    np.testing.assert_allclose(after, before, atol=1e-14)
    np.testing.assert_allclose(spin_after, spin, atol=1e-11)
    assert s.steps == 700


def test_a_speed_without_bounds_is_told() -> None:
    s = solver(2, 30)
    s.grains.velocity[3] = np.nan
    with pytest.raises(NotANumberError):
        s.advance(np.zeros(12))


def test_whole_step_velocities_are_midway_between_half_steps() -> None:
    s = solver(2, 30, damping=Damping(ISOTROPIC, 0.2, 0.2))
    s.advance(np.zeros(502))
    before = s.grains.velocity.copy()
    middle, _ = s.whole_step_velocities()
    order = s.grains.id.copy()
    s.advance(np.zeros(3))
    assert (s.grains.id == order).all()
    np.testing.assert_allclose(middle, 0.5 * (before + s.grains.velocity), atol=1e-12)
