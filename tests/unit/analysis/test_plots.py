"""Pictures: what is on the axes, in mm."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from numpy.testing import assert_allclose

from sandmould.analysis import plots
from sandmould.engines.snapshot import Snapshot
from sandmould.geometry.geometry import Block, Bore, Scene, Wall
from sandmould.geometry.outline import Outline
from sandmould.geometry.revolved import Revolved


def box(size, blocks=(), bores=()):
    d = len(size) + 1
    walls = [Wall("floor", np.zeros(d), np.eye(d)[-1])]
    for k, width in enumerate(size):
        walls.append(Wall(f"low {k}", np.zeros(d), np.eye(d)[k]))
        walls.append(Wall(f"high {k}", width * np.eye(d)[k], -np.eye(d)[k]))
    return Scene(d, tuple(walls), tuple(blocks), tuple(bores))


def snapshot(position, radius, layer):
    n, d = position.shape
    return Snapshot(
        1.0, np.nan, "settle", np.arange(1, n + 1), np.array(layer), position,
        np.zeros((n, d)), np.zeros((n, 3)), radius,
    )  # fmt: skip


@pytest.fixture
def ax():
    return Figure().subplots()


def grains(ax):
    return next(c for c in ax.collections if isinstance(c, EllipseCollection))


THREE = snapshot(
    np.array([[0.02, 0.01], [0.05, 0.01], [0.08, 0.01]]), np.array([0.01, 0.005, 0.01]), [1, 2, 9]
)


def test_scene_2d(ax):
    block = Block("block", np.array([0.05, 0.03]), np.array([0.02, 0.01]), np.eye(2))
    bore = Bore("tube", np.array([0.0, 0.05]), np.array([1.0, 0.0]), 0.04, np.array([[0.0, 1.0]]),
                np.array([[-0.005], [0.005]]))  # fmt: skip
    assert plots.draw_scene(box([0.1], [block], [bore]), ax, 0.2) is ax
    lines = next(c for c in ax.collections if isinstance(c, LineCollection))
    walls = np.array([path.vertices for path in lines.get_paths()])
    assert len(walls) == 3  # open at the top
    assert walls[:, :, 0].max() == pytest.approx(100.0)
    assert walls[:, :, 1].max() == pytest.approx(200.0)
    solid, broken = (p for p in ax.patches if isinstance(p, Polygon))
    assert_allclose(np.ptp(solid.get_xy(), axis=0), [40.0, 20.0])
    assert_allclose(np.ptp(broken.get_xy(), axis=0), [40.0, 10.0])
    assert (solid.get_fill(), broken.get_fill()) == (True, False)
    assert ax.get_aspect() == 1.0
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x, mm", "y, mm")
    assert ax.get_xlim()[0] < 0.0 < 100.0 < ax.get_xlim()[1] < 110.0


def test_scene_3d_is_cut_by_the_middle_plane(ax):
    axes = np.array([[0.8, 0.0, 0.6], [0.0, 1.0, 0.0], [-0.6, 0.0, 0.8]])
    there = Block("there", np.array([0.05, 0.03, 0.05]), np.array([0.02, 0.01, 0.01]), axes)
    away = Block("away", np.array([0.05, 0.01, 0.05]), np.array([0.02, 0.01, 0.01]), axes)
    scene = box([0.1, 0.06], [there, away])
    plots.draw_scene(scene, ax, 0.2)
    (shown,) = ax.patches
    extent = 2e3 * (0.02 * np.array([0.8, 0.6]) + 0.01 * np.array([0.6, 0.8]))
    assert_allclose(np.ptp(shown.get_xy(), axis=0), extent)
    assert len(ax.collections[0].get_paths()) == 3
    assert ax.get_ylabel() == "z, mm"
    other = Figure().subplots()
    plots.draw_scene(scene, other, 0.2, cut_m=0.055)
    assert len(other.patches) == 0


def test_outline_is_drawn_as_it_is(ax):
    notched = np.array([[0, 0], [6, 0], [6, 4], [4, 4], [4, 1], [2, 1], [2, 4], [0, 4]]) * 1e-2
    scene = replace(box([0.1]), outlines=(Outline("u", notched),))
    plots.draw_scene(scene, ax, 0.2)
    (shown,) = ax.patches
    assert shown.get_fill()
    assert_allclose(shown.get_xy()[:-1], notched * 1e3)


def test_hole_of_a_mesh_stays_open_in_its_section(ax):
    profile = np.array([[0.02, 0.01], [0.04, 0.01], [0.04, 0.02], [0.02, 0.02]])
    ring = Revolved("ring", np.array([0.05, 0.0, 0.05]), np.eye(3)[1], profile)
    for scene in (
        replace(box([0.1, 0.06]), revolved=(ring,)),
        replace(box([0.1, 0.06]), meshes=(ring.mesh(),)),
    ):
        other = Figure().subplots()
        plots.draw_scene(scene, other, 0.2)
        (shown,) = other.patches
        path = shown.get_path()
        assert path.contains_point((50.0 + 15.0, 50.0))
        assert not path.contains_point((50.0, 50.0))


def test_grains_2d(ax):
    assert plots.draw_grains(THREE, ax) is ax
    got = grains(ax)
    assert_allclose(got.get_offsets(), THREE.position_m * 1e3)
    assert_allclose(got.get_widths(), [20.0, 10.0, 20.0])
    assert_allclose(got.get_facecolor(), [to_rgba(plots._SAND)])
    assert ax.get_xlim()[0] < 10.0 < 90.0 < ax.get_xlim()[1]
    assert ax.get_ylim()[0] < 0.0 < 20.0 < ax.get_ylim()[1]


def test_grains_3d_are_the_sections_by_the_plane(ax):
    position = np.array([[0.02, 0.0, 0.01], [0.05, 0.006, 0.01], [0.08, 0.02, 0.03]])
    cut = snapshot(position, np.full(3, 0.01), [1, 1, 1])
    plots.draw_grains(cut, ax, np.array([5.0, 7.0, 9.0]), limits=(4.0, 10.0), cut_m=0.0)
    got = grains(ax)
    assert_allclose(got.get_offsets(), [[20.0, 10.0], [50.0, 10.0]])
    assert_allclose(got.get_widths(), [20.0, 16.0])
    assert_allclose(got.get_array(), [5.0, 7.0])
    assert got.get_clim() == (4.0, 10.0)


def test_values_that_are_missing_are_grey(ax):
    plots.draw_grains(THREE, ax, np.array([1.0, np.nan, 3.0]))
    got = grains(ax)
    assert got.get_clim() == (1.0, 3.0)
    got.update_scalarmappable()
    assert_allclose(got.get_facecolor()[1], to_rgba("0.85"))


def test_by_layer(ax):
    plots.draw_by_layer(THREE, ax)
    expected = [to_rgba(plots.LAYER_COLOURS[k]) for k in (0, 1, 0)]  # the ninth repeats the first
    assert_allclose(grains(ax).get_facecolor(), expected)
    legend = ax.get_legend()
    assert [text.get_text() for text in legend.get_texts()] == ["9", "2", "1"]
    assert legend.get_title().get_text() == "layer"


def test_all_renders_without_a_window(tmp_path):
    figure = Figure()
    ax = figure.subplots()
    plots.draw_scene(box([0.1]), ax, 0.05)
    plots.draw_grains(THREE, ax, np.array([1.0, 2.0, 3.0]))
    empty = snapshot(np.zeros((0, 3)), np.zeros(0), np.zeros(0, dtype=np.int64))
    plots.draw_by_layer(empty, figure.subplots())
    figure.savefig(tmp_path / "look.png", dpi=40)
    assert (tmp_path / "look.png").stat().st_size > 1_000
