"""Files read back: meshio for ParaView's, by hand for OVITO's."""

from pathlib import Path

import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sandmould.analysis.export import solids_to_vtk, to_ovito, to_vtk
from sandmould.engines.snapshot import Snapshot
from sandmould.geometry.geometry import Block, Scene
from sandmould.geometry.outline import Outline
from sandmould.geometry.revolved import Revolved


@pytest.fixture(params=[2, 3], ids=["2D", "3D"])
def snapshot(request):
    rng = np.random.default_rng(11)
    d = request.param
    spin = rng.normal(size=(5, 3))
    if d == 2:
        spin[:, :2] = 0.0
    return Snapshot(
        1.25, 0.5, "vibrate", np.arange(1, 6), np.array([1, 1, 2, 3, 3]),
        rng.uniform(0.0, 0.3, (5, d)), rng.normal(size=(5, d)), spin, rng.uniform(1e-3, 2e-3, 5),
    )  # fmt: skip


def padded(vector):
    return np.hstack([vector, np.zeros((len(vector), 3 - vector.shape[1]))])


def test_vtu_round_trip(snapshot, tmp_path):
    to_vtk(snapshot, tmp_path / "sand.vtu")
    mesh = meshio.read(tmp_path / "sand.vtu")
    assert_array_equal(mesh.points, padded(snapshot.position_m))
    assert_array_equal(mesh.cells_dict["vertex"].ravel(), np.arange(5))
    data = mesh.point_data
    assert_array_equal(data["id"], snapshot.id)
    assert_array_equal(data["layer"], snapshot.layer)
    assert_array_equal(data["radius_m"], snapshot.radius_m)
    assert_array_equal(data["velocity_m_s"], padded(snapshot.velocity_m_s))
    assert_array_equal(data["spin_rad_s"], snapshot.spin_rad_s)
    assert_array_equal(data["time_s"], np.full(5, 1.25))
    assert_array_equal(data["vibration_time_s"], np.full(5, 0.5))


def test_solids_round_trip(tmp_path):
    square = Block("square", np.array([0.5, 0.5]), np.array([0.5, 0.5]), np.eye(2))
    wedge = Outline("wedge", np.array([[2.0, 0.0], [3.0, 0.0], [2.0, 1.0]]))
    solids_to_vtk(Scene(2, (), (square,), (), (wedge,)), tmp_path / "flat.vtu")
    flat = meshio.read(tmp_path / "flat.vtu")
    assert_array_equal(flat.cell_data["solid"][0], [0, 0, 0, 0, 1, 1, 1])
    ends = flat.points[flat.cells_dict["line"]]
    assert_allclose(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), [1, 1, 1, 1, 1, 2**0.5, 1])
    cube = Block("cube", np.zeros(3), np.full(3, 0.5), np.eye(3))
    profile = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 0.5], [0.0, 0.5]])
    rod = Revolved("rod", np.array([5.0, 0.0, 0.0]), np.eye(3)[0], profile)
    scene = Scene(3, (), (cube,), (), meshes=(rod.mesh(8),), revolved=(rod,))
    solids_to_vtk(scene, tmp_path / "solids.vtu")
    solids = meshio.read(tmp_path / "solids.vtu")
    assert_array_equal(np.unique(solids.cell_data["solid"][0]), [0, 1, 2])
    a, b, c = solids.points[solids.cells_dict["triangle"]].transpose(1, 0, 2)
    volume = np.sum(a * np.cross(b, c)) / 6
    assert volume == pytest.approx(1 + 2 * rod.measure)
    solids_to_vtk(Scene(2, (), (), ()), tmp_path / "none.vtu")
    assert (tmp_path / "none.vtu").is_file()


def test_dump_round_trip(snapshot, tmp_path):
    to_ovito(snapshot, tmp_path / "sand.dump")
    lines = (tmp_path / "sand.dump").read_text().splitlines()
    assert lines[:6] == ["ITEM: TIMESTEP", "1250000", "ITEM: TIME", "1.25",
                         "ITEM: NUMBER OF ATOMS", "5"]  # fmt: skip
    assert lines[6] == "ITEM: BOX BOUNDS ff ff ff"
    bounds = np.array([line.split() for line in lines[7:10]], dtype=float)
    position, radius = padded(snapshot.position_m), snapshot.radius_m[:, None]
    assert_allclose(bounds[:, 0], (position - radius).min(axis=0))
    assert_allclose(bounds[:, 1], (position + radius).max(axis=0))
    names = lines[10].removeprefix("ITEM: ATOMS ").split()
    rows = np.array([line.split() for line in lines[11:]], dtype=float)
    column = dict(zip(names, rows.T, strict=True))
    assert_array_equal(column["id"], snapshot.id)
    assert_array_equal(column["type"], snapshot.layer)
    assert_array_equal(column["layer"], snapshot.layer)
    assert_allclose(column["radius"], snapshot.radius_m, rtol=1e-9)
    for k, axis in enumerate("xyz"):
        assert_allclose(column[axis], position[:, k], rtol=1e-9)
        assert_allclose(column[f"v{axis}"], padded(snapshot.velocity_m_s)[:, k], rtol=1e-9)
        assert_allclose(column[f"omega{axis}"], snapshot.spin_rad_s[:, k], rtol=1e-9)
    assert lines[11].split()[1] == "1"  # a whole number, not 1.0


def test_a_failed_write_leaves_the_old_file(snapshot, tmp_path, monkeypatch):
    for write, module in ((to_vtk, "meshio.Mesh.write"), (to_ovito, "numpy.savetxt")):
        path = tmp_path / "old"
        path.write_text("old")

        def fail(*arguments: object, **_keywords: object) -> None:
            target = next(a for a in arguments if isinstance(a, Path))
            target.write_text("half")
            raise OSError("disk full")

        with monkeypatch.context() as patch:
            patch.setattr(module, fail)
            with pytest.raises(OSError, match="disk full"):
                write(snapshot, path)
        assert path.read_text() == "old"
        write(snapshot, path)
        assert [p.name for p in tmp_path.iterdir()] == ["old"]
