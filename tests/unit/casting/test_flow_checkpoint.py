"""Flows that were killed: what they go on from, and what they do not trust."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from sandmould.casting.mps import computation, scene
from sandmould.casting.mps.flow import Flow
from sandmould.runs import checkpoint_file
from sandmould.runs.checkpoint_file import CheckpointFile
from sandmould.runs.outcome import Outcome
from sandmould.runs.products import Computed
from sandmould.scenario.casting.flow import MetalFlow

SHOULDER = {"kind": "shoulder", "particle_m": 0.00625, "rate_kg_s": 0.2}
POURED = MetalFlow(case=SHOULDER, duration_s=0.02, record_s=0.005, relaxations=2)
TANK = {"kind": "tank", "particle_m": 0.004, "width_m": 0.024, "depth_m": 0.032}
STILL = MetalFlow(case=TANK, duration_s=0.03, record_s=0.005, source_share=1.0)
KEPT = 12
"""Steps before the run is killed: by then metal was poured."""


def computed(scenario: MetalFlow, folder: Path) -> Computed:
    return computation.compute(scenario, folder, "run")


Kill = Callable[[Path, MetalFlow], Path]


@pytest.fixture
def killed(monkeypatch: pytest.MonkeyPatch) -> Kill:
    """Compute a run that keeps every step and is killed amid them; gives its checkpoint."""

    def kill(folder: Path, scenario: MetalFlow) -> Path:
        keep, steps = CheckpointFile.write_when_due, []

        def then_die(self: CheckpointFile, arrays: Callable[[], dict[str, object]]) -> None:
            keep(self, arrays)
            steps.append(1)
            if len(steps) == KEPT:
                raise KeyboardInterrupt

        with monkeypatch.context() as now:
            now.setattr(checkpoint_file, "INTERVAL_S", 0.0)
            now.setattr(CheckpointFile, "write_when_due", then_die)
            with pytest.raises(KeyboardInterrupt):
                computed(scenario, folder)
        return folder / "work" / computation.CHECKPOINT

    return kill


@pytest.mark.parametrize("scenario", [POURED, STILL], ids=["poured", "still"])
def test_a_killed_run_ends_as_one_that_was_not(
    tmp_path: Path, killed: Kill, scenario: MetalFlow, capsys: pytest.CaptureFixture[str]
) -> None:
    straight = computed(scenario, tmp_path / "straight")
    killed(tmp_path / "killed", scenario)
    resumed = computed(scenario, tmp_path / "killed")
    assert "cannot be used" not in capsys.readouterr().err
    assert straight.outcome == resumed.outcome
    assert resumed.outcome.outcome is Outcome.FINISHED
    # bit for bit, so that the cost counts each step once
    for counted in ("steps", "particle_solves", "poisson_iterations", "particles"):
        assert getattr(straight.cost, counted) == getattr(resumed.cost, counted)
    works = [tmp_path / name / "work" for name in ("straight", "killed")]
    first, second = ((work / "series.tsv").read_bytes() for work in works)
    assert first == second
    with np.load(works[0] / "fields.npz") as one, np.load(works[1] / "fields.npz") as two:
        assert len(one["count"]) > 3
        for name in one.files:
            np.testing.assert_array_equal(one[name], two[name], err_msg=name)


def test_a_flow_taken_up_goes_on_bit_for_bit() -> None:
    straight, second = scene.open_flow(STILL), scene.open_flow(STILL)
    kept: dict[str, np.ndarray] = {}

    def each(flow: Flow) -> None:
        if flow.cost.steps == KEPT:
            kept.update({name: np.array(value) for name, value in flow.arrays().items()})

    straight.advance(STILL.duration_s, each)
    second.take_up(kept)
    second.advance(STILL.duration_s)
    for name, value in straight.arrays().items():
        if not name.endswith("_s") or name == "time_s":  # the clock is no part of it
            np.testing.assert_array_equal(value, second.arrays()[name], err_msg=name)


@pytest.mark.parametrize("harm", ["torn", "flipped", "empty"])
def test_a_damaged_checkpoint_is_said_and_not_trusted(
    tmp_path: Path, killed: Kill, harm: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = killed(tmp_path, STILL)
    whole = bytearray(path.read_bytes())
    if harm == "flipped":
        whole[len(whole) // 2] ^= 1
    path.write_bytes({"torn": whole[:-100], "flipped": whole, "empty": b""}[harm])
    kept = CheckpointFile(path, computation.computed_hash(STILL))
    assert kept.read() is None
    told = capsys.readouterr().err
    assert "checkpoint.bin cannot be used: its bytes do not match their hash" in told


def test_a_checkpoint_of_another_scenario_is_not_taken_up(
    tmp_path: Path, killed: Kill, capsys: pytest.CaptureFixture[str]
) -> None:
    path = killed(tmp_path, STILL)
    same = computation.computed_hash(STILL)
    assert CheckpointFile(path, same).read() is not None
    assert CheckpointFile(path.with_name("none"), same).read() is None
    assert "cannot be used" not in capsys.readouterr().err
    other = STILL.model_copy(update={"duration_s": 0.02})
    assert CheckpointFile(path, computation.computed_hash(other)).read() is None
    assert "of another scenario or solver" in capsys.readouterr().err
    fresh = computed(other, tmp_path)
    assert fresh.outcome.simulated_s == pytest.approx(0.02)


def test_a_checkpoint_waits_until_it_is_due(tmp_path: Path) -> None:
    kept = CheckpointFile(tmp_path / "kept", "hash")
    kept.write_when_due(lambda: {"x": np.zeros(1)})
    assert not list(tmp_path.iterdir())
