"""Decks of LAMMPS and LIGGGHTS that take their time step from the filled bed."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import yaml

from sandmould.engines.bed_limit import limit_of_snapshot_s
from sandmould.engines.bed_step import with_bed_step
from sandmould.engines.guard import grain_masses_kg
from sandmould.engines.liggghts.process import executable
from sandmould.engines.program import build_program
from sandmould.engines.session import Array
from sandmould.runs.checkpoint_folders import END_CHECKPOINT
from sandmould.runs.outcome import Outcome
from sandmould.runs.run_tables import read_costs
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.time_step import TimeStep
from tests.hopper import hopper_scene
from tests.liggghts_scenes import liggghts_scene, needs_liggghts, open_liggghts
from tests.scenes import open_lammps, tube_scene
from tests.workflow.runs import SOON, last_snapshot, run_folder
from tests.workflow.test_shared_fill import compute, pair

REST = {**SOON, "load_tolerance": 0.3}
OF_BED: dict[str, Any] = {"rest": REST, "time_step": {"bed_fraction": 0.7}}
SCENES = {"lammps": tube_scene(**OF_BED), "liggghts": liggghts_scene(**OF_BED)}
LMP = str(Path(sys.executable).parent / "lmp")
ENGINES = ["lammps", pytest.param("liggghts", marks=needs_liggghts)]


class Branched(NamedTuple):
    """A fill and the runs that go on from it."""

    scene: Scenario
    fill: Path
    runs: list[Path]


@pytest.fixture(scope="module", params=ENGINES)
def branched(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Branched:
    scene = SCENES[request.param]
    runs, fill = pair(scene, tmp_path_factory.mktemp(request.param))
    assert [compute(folder) for folder in (fill, *runs)] == [Outcome.FINISHED] * 3
    return Branched(scene, fill, runs)


def cost_of(folder: Path) -> Any:
    return read_costs([folder]).rows.iloc[-1]


def assert_alone_equals(scene: Scenario, run: Path, folder: Path) -> None:
    """Run the deck of a run by hand, elsewhere, and compare where the sand is at its end."""
    shutil.copytree(run / "layers", folder / "layers")
    shutil.copy(run / "deck.in", folder)
    command = LMP if scene.engine.name == "lammps" else executable() or "liggghts"
    ran = subprocess.run([command, "-in", "deck.in"], cwd=folder, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout[-2000:]
    alone, end = yaml.safe_load((folder / "summary.yaml").read_text()), last_snapshot(run)
    mass = grain_masses_kg(scene, end)
    rms_m_s = np.sqrt(mass @ (end.velocity_m_s**2).sum(axis=1) / mass.sum())
    assert alone["simulated_s"] == pytest.approx(end.time_s, rel=1e-12)
    assert alone["rms_speed_m_s"] == pytest.approx(rms_m_s, rel=1e-12)
    top_m = (end.position_m[:, -1] + end.radius_m).max()
    assert alone["largest_height_m"] == pytest.approx(top_m, rel=1e-14)


def test_the_step_is_a_share_of_the_limit_of_the_bed_and_all_branches_have_it(
    branched: Branched,
) -> None:
    scene, fill, runs = branched
    stage = build_program(scene).stages[0]
    limit_s = limit_of_snapshot_s(scene, stage, last_snapshot(fill), ())
    assert cost_of(fill).bed_limit_s == pytest.approx(limit_s, rel=1e-9)
    assert cost_of(fill).time_step_s == scene.planned_step_s
    steps_s = {float(cost_of(run).time_step_s) for run in runs}
    assert len(steps_s) == 1
    # rounded down to four digits
    assert 0.999 * 0.7 < steps_s.pop() / limit_s <= 0.7
    for run in runs:
        assert cost_of(run).limit_moments == 20
        assert cost_of(run).least_limit_s > cost_of(run).time_step_s


def test_the_deck_of_a_branch_runs_alone_and_equals_its_session(
    branched: Branched, tmp_path: Path
) -> None:
    assert_alone_equals(branched.scene, branched.runs[0], tmp_path)


@pytest.mark.parametrize("engine", ENGINES)
def test_so_does_that_of_a_run_that_fills_by_itself_and_opens_a_gate(
    engine: str, tmp_path: Path
) -> None:
    scene = hopper_scene(
        engine,
        frame="laboratory",
        fill={"layers": [{"count": 80}]},
        rest={"rms_speed_m_s": 0.05, "discharge_rms_speed_m_s": 0.3, "load_tolerance": 0.1},
        vibration=[{"acceleration_g": 1.5, "frequency_hz": 50.0, "duration_s": 0.02}],
        time_step={"bed_fraction": 0.7},
    )
    run = run_folder(scene, tmp_path)
    unknown = (run / "deck.in").read_text()
    steps_s = re.findall(r"^variable time_step index (\S+)", unknown, re.M)
    assert steps_s == [repr(scene.planned_step_s)] * 2
    assert "The bed is not filled yet: until then this part has the planned time step." in unknown
    assert compute(run) is Outcome.FINISHED
    deck = (run / "deck.in").read_text()
    assert f"variable time_step index {float(cost_of(run).time_step_s)!r}  # s, time step" in deck
    assert_alone_equals(scene, run, tmp_path)


def shaken_m(scene: Scenario, fill: Path, folder: Path, forgets: bool = False) -> Array:
    """How far the grains go in a while after the fill, with or without what contacts remember."""
    opened = open_lammps if scene.engine.name == "lammps" else open_liggghts
    session: Any = opened(scene, folder, fill / END_CHECKPOINT)
    bed = session.snapshot()
    if forgets:
        session.send("run 0")
        friction = "pair_style gran model hooke/stiffness\npair_coeff * *\n"
        if scene.engine.name == "lammps":
            friction = "pair_style zero 0.01\npair_coeff * *\n"
        session.send(friction + "run 0\n" + session._blocks["contacts"].text)
    session.end_stage()
    session.start_stage(session._program.stages[-2])
    session.advance(0.002)
    found: Array = session.snapshot().position_m - bed.position_m
    session.close()
    return found


def test_contacts_remember_over_the_change_of_the_step(branched: Branched, tmp_path: Path) -> None:
    """A step as good as the old one moves the grains as if there had been no change."""
    scene, fill, _ = branched
    plain = scene.model_copy(update={"time_step": TimeStep(bed_fraction=None)})
    close = with_bed_step(scene, scene.planned_step_s / 0.7 * 1.0005)
    assert close.step_s == pytest.approx(scene.planned_step_s, rel=1e-3)
    before = shaken_m(plain, fill, tmp_path / "before")
    after = shaken_m(close, fill, tmp_path / "after")
    without = shaken_m(plain, fill, tmp_path / "without", forgets=True)
    # a grain that still falls would hide the bed
    kept_m, lost_m = (float(np.median(np.abs(way - before))) for way in (after, without))
    assert kept_m < 0.05 * lost_m
