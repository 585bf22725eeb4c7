"""The calibration benchmark on a made-up map: its oracle, its counting, its lines, its page."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from benchmarks.calibration import oracle
from benchmarks.calibration.coverage import (
    counted,
    dem_coverage,
    ellipse_holds,
    our_coverage,
    planted,
)
from benchmarks.calibration.measure import CalibrationExtent, measure
from benchmarks.calibration.methods import (
    CalibrationProblem,
    Messages,
    Nearest,
    Ours,
    Peer,
    PeerError,
    open_peers,
    problem_of,
)
from benchmarks.calibration.oracle import (
    ANGLE,
    KEYS,
    SECOND,
    Map,
    NoMapError,
    by_dem,
    by_emulator,
    read_map,
)
from benchmarks.calibration.page import page
from benchmarks.calibration.race import HELD_AFTER, Race, quartiles, run_race, summarised
from sandmould import ROOT
from sandmould.study.plan.plan_files import read_run

NOISE_DEG = 0.8
FAKE = """\
import sys
sys.path.insert(0, {peers!r})
from jsonl_pipe import serve

def solve(pipe, problem):
    if problem["target"] < 0:
        raise ValueError("no such angle")
    print("chatter that is no message")
    tried = []
    for first in (0, 4):
        tried += [(pipe.ask(p), p) for p in problem["start"][first : first + 4]]
        known = [(abs(v - problem["target"]), p) for v, p in tried if v is not None]
        nearest = min(known)[1]
        samples = [p for _, p in known]
        pipe.guess({{"nearest": nearest}}, samples=samples, weights=[1 / len(known)] * len(known))
    return "two generations are enough"

serve(solve, ("numpy",))
"""


@pytest.fixture(scope="module")
def summary(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Summary of a made-up map, two replicates a point."""
    grid = np.meshgrid(np.linspace(0.1, 0.8, 5), np.linspace(0.0, 0.3, 5), indexing="ij")
    points = np.repeat(np.stack(grid, axis=-1).reshape(-1, 2), 2, axis=0)
    noise = np.random.default_rng(5).normal(0.0, NOISE_DEG, len(points))
    angle = 12 + 14 * np.tanh(2 * points[:, 0]) + 40 * points[:, 1] + noise
    table = pd.DataFrame(
        {KEYS[0]: points[:, 0], KEYS[1]: points[:, 1], ANGLE: angle, "outcome_code": 0}
    )
    path = tmp_path_factory.mktemp("map") / "summary.tsv"
    table.to_csv(path, sep="\t", index=False)
    return path


@pytest.fixture(scope="module")
def known(summary: Path) -> Map:
    return read_map(summary)


@pytest.fixture
def fake(tmp_path: Path) -> Iterator[Peer]:
    """A peer's program without a peer: the nearest run of two generations of four."""
    program = tmp_path / "fake.py"
    peers = str(ROOT / "benchmarks" / "peers")
    program.write_text(FAKE.format(peers=peers), encoding="utf-8")
    peer = Peer("GrainLearning", [sys.executable, str(program)])
    yield peer
    peer.close()


def problem(target: float = 25.0, tolerance: float = 0.8) -> CalibrationProblem:
    return problem_of([0.1, 0.0], [0.8, 0.3], target, 0.5, tolerance, seed=1)


class Scripted:
    """A method that asks in pairs and states what it is told to."""

    name, versions = "scripted", {}

    def __init__(self, guesses: list[dict[str, list[float]]]) -> None:
        self.guesses = guesses
        self.got: list[float | None] = []

    def solve(self, problem: CalibrationProblem) -> Messages:
        for guess in self.guesses:
            for _ in range(2):
                self.got.append((yield {"ask": [0.0, 0.0]}))
            yield {"guess": guess}
        yield {"ended": "it said all"}


def miss(point: list[float]) -> float:
    return abs(point[0])


def test_the_map_is_read_with_its_noise(known: Map) -> None:
    noise = known.noise()
    assert (known.replicates, known.freedom) == (2, 25)
    assert noise["low_deg"] < NOISE_DEG < noise["high_deg"]
    assert known.tolerance == max(0.5, 2 * known.truth.noise_sd / math.sqrt(3))
    simulate = by_emulator(known, seed=1)
    values = [simulate((0.4, 0.1)) for _ in range(300)]
    assert np.mean(values) == pytest.approx(known.mean((0.4, 0.1)), abs=0.2)
    assert np.std(values) == pytest.approx(known.truth.noise_sd, rel=0.15)
    assert by_emulator(known, seed=1)((0.4, 0.1)) == values[0]


def test_a_map_that_cannot_be_used_is_told_in_a_sentence(summary: Path, tmp_path: Path) -> None:
    with pytest.raises(NoMapError, match="is not there: sandmould run repose_map"):
        read_map(tmp_path / "none.tsv")
    table = pd.read_csv(summary, sep="\t")
    bad = tmp_path / "bad.tsv"
    table.drop(columns=ANGLE).to_csv(bad, sep="\t", index=False)
    with pytest.raises(NoMapError, match="lacks the column heap_angle_deg, so"):
        read_map(bad)
    table.head(4).to_csv(bad, sep="\t", index=False)
    with pytest.raises(NoMapError, match=r"too small a map: .* known at 2 settings"):
        read_map(bad)
    bad.write_text("", encoding="utf-8")
    with pytest.raises(NoMapError, match="cannot be read as a table"):
        read_map(bad)
    with pytest.raises(NoMapError, match="no angle of 80 degrees"):
        measure(summary, [], CalibrationExtent(targets=(80.0,)))


def test_a_run_by_dem_is_the_studys_with_the_point_and_another_filling(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    planned = []

    def simulated(folder: Path) -> int:
        planned.append(read_run(folder / "scenario.yaml").scenario)
        return 0

    monkeypatch.setattr(oracle, "simulate", simulated)
    monkeypatch.setattr(oracle, "render_run", lambda folder: None)
    monkeypatch.setattr(oracle, "write_measures", lambda scenario, folder, out: None)
    run = by_dem(1, tmp_path)
    # Nothing was computed, so there is no angle.
    assert [math.isnan(run(point)) for point in ((0.3, 0.1), (0.3, 0.2))] == [True, True]
    first, second = planned
    assert first.contact.grain_grain.friction == 0.3
    assert second.contact.grain_grain.rolling_arm_fraction == 0.2
    assert first.sand.size_scale == 8
    assert first.seed != second.seed
    # What was made is not made again, and what was cut off while it was written is.
    last = max(tmp_path.glob("*.json"), key=lambda path: path.stat().st_mtime_ns)
    last.write_text(last.read_text(encoding="utf-8")[:-10], encoding="utf-8")
    run = by_dem(1, tmp_path)
    run((0.3, 0.1))
    assert len(planned) == 2
    run((0.3, 0.2))
    assert planned[2:] == [second]


def test_a_guess_counts_all_runs_before_it() -> None:
    method = Scripted([{"a": [2.0], "b": [0.1]}, {"a": [0.3], "b": [3.0]}])
    race = run_race(method, problem(tolerance=0.5), lambda point: math.nan, miss)
    assert race.first == {"a": 4, "b": 2}
    assert race.since == {"a": 4}  # the last of b was bad
    assert (race.runs, race.ended) == (4, "it said all")
    # A run without an angle is told as none.
    assert method.got == [None] * 4


def test_a_race_ends_at_the_cap_or_once_all_is_known() -> None:
    bad, good = {"a": [2.0]}, {"a": [0.0]}
    race = run_race(Scripted([bad] * 30), problem(), lambda point: 1.0, miss, cap=20)
    assert (race.runs, race.first, race.ended) == (20, {}, "")
    race = run_race(Scripted([bad] * 20 + [good] * 30), problem(), lambda point: 1.0, miss)
    assert (race.runs, race.first) == (42, {"a": 42})
    assert race.since == {}  # 40 runs had not been enough
    luck = [good, bad, *[good] * 40]
    race = run_race(Scripted(luck), problem(), lambda point: 1.0, miss)
    assert (race.runs, race.first, race.since) == (HELD_AFTER, {"a": 2}, {"a": 6})


def test_failures_count_as_longer_than_anything() -> None:
    assert quartiles([10, None, 20, 30]) == [10.0, 20.0, 30.0]
    assert quartiles([10, None, None, None]) == [10.0, None, None]
    races = [Race(9, {"a": 6}, {"a": 8}, ["a"]), Race(4, {}, {}, [], "ValueError: broken")]
    (row,) = summarised("m", 25.0, races)
    assert row["runs_needed"] == [6, None]
    assert row["good_since"] == [8, None]
    assert (row["failures"], row["not_good_after"], row["seeds"]) == (1, 1, 2)
    assert row["ended"] == ["ValueError: broken"]
    (row,) = summarised("m", 25.0, races[1:])
    assert (row["guess"], row["failures"]) == ("none stated", 1)


@pytest.mark.slow
def test_our_method_finds_the_ridge_of_the_map(known: Map) -> None:
    race = run_race(
        Ours(), problem(tolerance=known.tolerance), by_emulator(known, seed=1),
        lambda point: abs(known.mean(point) - 25.0), cap=20,
    )  # fmt: skip
    (needed,) = race.first.values()
    assert 6 <= needed <= 20


def test_the_control_guesses_its_nearest_run() -> None:
    race = run_race(Nearest(), problem(), lambda point: 25.0 + 100.0 * point[1], miss, cap=5)
    nearest = min(problem().start[:5], key=lambda point: point[1])
    assert race.last["guess"]["nearest run"] == list(nearest)
    race = run_race(Nearest(), problem(), lambda point: math.nan, miss, cap=5)
    assert (race.runs, race.names) == (5, [])


def test_our_method_goes_on_when_runs_give_no_value() -> None:
    asked = []

    def simulate(point: list[float]) -> float:
        asked.append(point)
        return math.nan if len(asked) < 4 else 12.0 + 40.0 * point[1] + point[0]

    race = run_race(Ours(), problem(), simulate, lambda point: 9.9, cap=11)
    assert race.names == ["least expected miss"]
    assert len(np.unique(asked, axis=0)) == race.runs == 11


def test_a_peer_is_driven_over_its_lines(fake: Peer) -> None:
    assert fake.versions == {"numpy": np.__version__}
    asked = []

    def simulate(point: list[float]) -> float:
        asked.append(point)
        return math.nan if len(asked) == 1 else 40.0 * point[1] + 20.0

    easy = problem(tolerance=100.0)
    race = run_race(fake, easy, simulate, lambda point: 0.0)
    assert asked == [list(point) for point in easy.start[:8]]
    assert (race.runs, race.first) == (8, {"nearest": 4})
    assert race.ended == "two generations are enough"
    assert len(race.last["samples"]) == 7
    # Given up after three runs it takes the next problem; one that breaks it has only failed.
    assert run_race(fake, easy, simulate, lambda point: 0.0, cap=3).runs == 3
    race = run_race(fake, problem(target=-1.0), simulate, lambda point: 0.0)
    assert (race.runs, race.ended) == (0, "ValueError: no such angle")
    assert run_race(fake, easy, simulate, lambda point: 0.0).runs == 8


def test_a_peer_that_is_not_there_or_breaks_is_told(tmp_path: Path) -> None:
    with pytest.raises(PeerError, match="is not there: make peers makes"):
        open_peers(tmp_path / "python")
    with pytest.raises(PeerError, match=r"ended with status 1 before its time: .*no_such"):
        Peer("broken", [sys.executable, "-c", "import no_such"])


def test_regions_hold_what_they_should(known: Map) -> None:
    samples = np.random.default_rng(1).normal(size=(400, 2)) * [1.0, 0.1]
    even = np.full(400, 1 / 400)
    assert ellipse_holds(samples, even, (2.0, 0.0))
    assert not ellipse_holds(samples, even, (0.0, 1.0))
    assert not ellipse_holds(samples[:1], np.ones(1), samples[0])
    row = counted("m", "all", [True] * 19 + [False])
    assert row["held"] / row["truths"] == row["claimed"]
    assert row["low"] < 0.95 < row["high"]
    assert our_coverage(known, planted(known, 5))["held"] >= 3


def test_the_page_says_what_was_measured(summary: Path, fake: Peer, tmp_path: Path) -> None:
    settings = CalibrationExtent(seeds=1, truths=2, targets=(25.0,), cap=9)
    found = measure(summary, [Ours(), fake, Nearest()], settings)
    text = page(json.loads(json.dumps({"emulator": found, "dem": dem(found)})))
    noise = found["noise"]["sd_deg"]
    assert f"differs from the mean of its point by {noise:.2f} degrees" in text
    assert "| 25 | sandmould | least expected miss |" in text
    assert "| 25 | GrainLearning | nearest |" in text
    assert "| 25 | no method | nearest run |" in text
    assert "GrainLearning, 25 degrees, ended before the cap: two generations are enough." in text
    assert f"- GrainLearning: numpy {np.__version__}" in text
    found_alone = "0.450 ± 0.200, 0.120 ± 0.050 | yes, 2.5 bits"
    row = f"| 0.400, 0.100 | 25.3, none | 25.1, 0.2 | {found_alone} | off the map | – |"
    assert row in text
    assert "summary.tsv" in text
    assert str(summary.parent) not in text


def dem(found: dict[str, Any]) -> dict[str, Any]:
    """What a measurement by DEM adds."""
    one = {"held": True, "bits": 2.5, "mode": [0.45, 0.12], "sd": [0.2, 0.05]}
    truth = {
        "truth": [0.4, 0.1], "measured": {ANGLE: 25.3, SECOND: None},
        "emulated": {ANGLE: 25.1, SECOND: 0.2},
        "by": {"first": one, "all": {"held": False, "bits": None, "mode": None, "sd": None}},
    }  # fmt: skip
    return {key: found[key] for key in found if key != "coverage"} | {"dem_truths": [truth]}


def test_truths_planted_by_runs_are_found_by_one_measure_and_better_by_two(
    summary: Path, known: Map, tmp_path: Path
) -> None:
    table = pd.read_csv(summary, sep="\t")
    # Where the angle rises with the arm, the outflow falls with friction alone.
    table[SECOND] = 0.9 - 0.2 * table[KEYS[0]] + np.tile([0.002, -0.002], len(table) // 2)
    table.to_csv(tmp_path / "second.tsv", sep="\t", index=False)
    maps = {ANGLE: known, SECOND: read_map(tmp_path / "second.tsv", SECOND)}

    def runs(number: int) -> Callable[[list[float]], dict[str, float]]:
        simulate = {measure: by_emulator(known, seed=number) for measure, known in maps.items()}

        def run(point: list[float]) -> dict[str, float]:
            row = {measure: one(point) for measure, one in simulate.items()}
            return row | {SECOND: math.nan} if number == 1 else row

        return run

    found, lost = dem_coverage(maps, np.array([[0.4, 0.1], [0.5, 0.2]]), runs)
    assert found["by"]["all"]["held"]
    assert found["by"]["all"]["bits"] > found["by"]["first"]["bits"] + 1.0
    assert found["by"]["all"]["mode"][0] == pytest.approx(0.4, abs=0.05)
    assert lost["by"]["first"]["bits"] is not None
    assert lost["by"]["all"] == {"held": False, "bits": None, "mode": None, "sd": None}
