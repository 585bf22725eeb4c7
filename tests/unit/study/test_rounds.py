"""Rounds that close in on an optimum: where it is, which runs are next, when it is enough."""

from __future__ import annotations

import itertools
import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

from sandmould.bad_input import BadInputError
from sandmould.definition.certificate import SEEDS
from sandmould.execution import run_study
from sandmould.runs.manifest import save_manifest
from sandmould.statistics.emulator import TooFewRunsError
from sandmould.statistics.optimum import NEAR, Optimum, find_optimum, propose
from sandmould.study.collect import collect
from sandmould.study.plan.build_plan import Plan
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from sandmould.study.rounds.decide import (
    decision_text,
    next_round,
    next_runs,
    why_narrow,
    why_over,
)
from sandmould.study.rounds.round_log import (
    ROUNDS_FILE,
    RoundLog,
    basis_of,
    read_rounds,
    write_rounds,
)
from tests.planned import announce

FREQUENCY, GRAVITY = "vibration.0.frequency_hz", "vibration.0.acceleration_g"
FILL = "tube_fill_fraction"
BEST_HZ = 45.0
COARSE = (20.0, 30.0, 45.0, 65.0, 100.0)
STUDY: dict[str, Any] = {
    "based_on": "tube",
    "scenario": {"engine": {"name": "reference"}},
    "sweep": {"keys": {FREQUENCY: list(COARSE)}},
    "replicates": 2,
    "refine": {"rounds": 3, "runs": 4},
}


def fill(frequency_hz: float, best_hz: float = BEST_HZ) -> float:
    """A fill that is best at one frequency, even in its logarithm."""
    return 0.7 - 0.2 * float(np.log(frequency_hz / best_hz)) ** 2


def table(points: list[float], replicates: int, sd: float, seed: int = 0) -> pd.DataFrame:
    noise = np.random.default_rng(seed)
    rows = [
        {FREQUENCY: f, "replicate": r, "outcome_code": 0, "cpu_s": 90.0,
         FILL: fill(f) + noise.normal(0.0, sd)}
        for f in points for r in range(1, replicates + 1)
    ]  # fmt: skip
    return pd.DataFrame(rows)


def found(sd: float = 0.004, points: tuple[float, ...] = COARSE, seed: int = 0) -> Optimum:
    return find_optimum(table(list(points), 3, sd, seed), [FREQUENCY], FILL, "larger")


def test_the_optimum_is_where_it_was_planted_and_its_interval_narrows_with_the_noise() -> None:
    dense = tuple(np.geomspace(20.0, 100.0, 8).tolist())
    sharp, dull = found(0.002, dense), found(0.03, dense)
    assert sharp.setting[FREQUENCY] == pytest.approx(BEST_HZ, rel=0.1)
    assert sharp.value[0] == pytest.approx(0.7, abs=0.01)
    low, high = sharp.interval(FREQUENCY)
    assert low < BEST_HZ < high
    assert np.diff(sharp.interval(FREQUENCY)) < np.diff(dull.interval(FREQUENCY))
    assert sharp.at_end(FREQUENCY) == ""


def test_intervals_hold_the_planted_optimum_about_as_often_as_they_say() -> None:
    # Of 10 noises 7 or fewer have a chance of 1 in 87; 60 noises held 58 or more (seeds 0 to 59).
    held = 0
    for seed in range(10):
        low, high = found(sd=0.02, seed=seed).interval(FREQUENCY)
        held += low <= BEST_HZ <= high
    assert held >= 8


def test_a_smaller_value_can_be_the_better_one() -> None:
    runs = table(list(COARSE), 3, 0.001).assign(**{FILL: lambda t: -t[FILL]})
    assert find_optimum(runs, [FREQUENCY], FILL, "smaller").setting[FREQUENCY] == pytest.approx(
        BEST_HZ, rel=0.1
    )


def test_an_optimum_at_the_end_of_the_sweep_is_told() -> None:
    rising = found(points=(10.0, 15.0, 20.0, 25.0, 30.0), sd=0.001)
    assert rising.at_end(FREQUENCY) == "highest"
    assert rising.setting[FREQUENCY] == 30.0


def test_how_flat_it_is_and_what_a_wrong_frequency_costs() -> None:
    optimum = found(sd=1e-5, points=(20.0, 25.0, 32.0, 40.0, 45.0, 50.0, 60.0, 75.0, 100.0))
    low, high = optimum.no_worse(FREQUENCY, 0.02)
    # 0.2 ln(f/45)^2 = 0.02 at a ratio of exp(0.316) = 1.372
    assert (low, high) == pytest.approx((45 / 1.372, 45 * 1.372), rel=0.05)
    assert optimum.loss(FREQUENCY, 10.0) == pytest.approx(0.7 - fill(55.0), abs=0.003)
    assert np.isnan(optimum.loss(FREQUENCY, 80.0))


def test_two_keys_have_one_optimum() -> None:
    rows = [
        {FREQUENCY: f, GRAVITY: g, "replicate": 1, "outcome_code": 0,
         FILL: fill(f) - 0.1 * (g - 1.4) ** 2}
        for f, g in itertools.product(COARSE, (0.5, 1.0, 1.5, 2.0))
    ]  # fmt: skip
    optimum = find_optimum(pd.DataFrame(rows), [FREQUENCY, GRAVITY], FILL, "larger")
    assert optimum.setting[FREQUENCY] == pytest.approx(BEST_HZ, rel=0.15)
    assert optimum.setting[GRAVITY] == pytest.approx(1.4, abs=0.15)


def test_too_few_points_are_no_surface() -> None:
    with pytest.raises(TooFewRunsError, match="known at 3 settings, at least 4 are needed"):
        found(points=COARSE[:3])


def test_new_runs_lie_where_the_optimum_may_be() -> None:
    runs = table(list(COARSE), 3, 0.02)
    optimum = find_optimum(runs, [FREQUENCY], FILL, "larger")
    chosen = propose(optimum, runs, 30, seed=1)
    low, high = optimum.interval(FREQUENCY)
    inside = [low <= point[FREQUENCY] <= high for point, _ in chosen]
    assert np.mean(inside) > 0.8
    # Never the same run twice; a point that has runs gets its next replicate.
    assert len({(p[FREQUENCY], r) for p, r in chosen}) == 30
    again = [r for p, r in chosen if p[FREQUENCY] in COARSE]
    assert again
    assert min(again) == 4
    # New points keep apart, by logarithms.
    values = sorted({p[FREQUENCY] for p, _ in chosen} | set(COARSE))
    reach = np.log(COARSE[-1] / COARSE[0])
    assert min(np.diff(np.log(values))) > 0.9 * NEAR * reach


def test_rounds_end_by_width_by_count_and_by_budget(tmp_path: Path) -> None:
    study = opened(tmp_path).study
    optimum = found(sd=0.004)
    low, high = optimum.interval(FREQUENCY)

    def why(done: int = 0, spent_h: float = 0.0, **changes: Any) -> str:
        refine = study.refine.model_copy(update=changes)
        return why_narrow(refine, optimum) or why_over(refine, done, spent_h, round_h=2.0)

    assert why() == ""
    enough = f"as narrow as asked: frequency {low:.3g} to {high:.3g} Hz."
    assert enough in why(interval={FREQUENCY: 1.1 * (high - low)})
    assert why(interval={FREQUENCY: 0.9 * (high - low)}) == ""
    assert why(done=3) == "All 3 rounds are done."
    assert why(spent_h=3.0, budget_core_h=6.0) == ""
    assert why(spent_h=4.5, budget_core_h=6.0).startswith("Of 6 h of processor time 4.5 h are")


def opened(folder: Path, **changes: Any) -> Any:
    path = folder / "trial.yaml"
    path.write_text(yaml.safe_dump(STUDY | changes), encoding="utf-8")
    return open_study(path)


def test_rounds_are_appended_to_the_runs_and_redo_none(tmp_path: Path) -> None:
    study = opened(tmp_path)
    first = expand(study)
    assert len(first) == 10
    more = [({FREQUENCY: 45.0}, 3), ({FREQUENCY: 52.0}, 1), ({FREQUENCY: 30.0}, 2)]
    runs = expand(study, more)
    assert [r.run for r in runs[:10]] == [r.run for r in first]
    new = runs[len(first) :]
    assert [(r.parameters[FREQUENCY], r.replicate) for r in new] == [(45.0, 3), (52.0, 1)]
    # One that the sweep has come to hold is there once. Replicate 1 of a new point has the grains
    # of replicate 1 of all points.
    assert new[1].seed == first[0].seed


def test_a_round_log_is_read_back_and_another_studys_is_kept_aside(tmp_path: Path) -> None:
    study = opened(tmp_path).study
    runs = table(list(COARSE), 2, 0.01)
    log = next_round(RoundLog(basis_of(study)), study, runs, [FREQUENCY])
    assert len(log.runs) == 4
    assert decision_text(log, study).startswith("Round 1 of at most 3: best so far is frequency ")
    write_rounds(log, tmp_path)
    assert read_rounds(tmp_path, study) == log
    # More rounds go on with those that are there; another scene begins anew and loses nothing.
    for more in ({"refine": {"rounds": 9}}, {"replicates": 4}):
        assert read_rounds(tmp_path, opened(tmp_path, **more).study) == log
    other = opened(tmp_path, scenario={"sand": {"size_scale": 9}}).study
    fresh = read_rounds(tmp_path, other)
    assert fresh.rounds == ()
    write_rounds(fresh, tmp_path)
    kept = json.loads((tmp_path / f"rounds_{log.basis[:6]}.json").read_text())
    assert len(kept["rounds"]) == 1
    (tmp_path / ROUNDS_FILE).write_text('{"basis": 1}')
    with pytest.raises(BadInputError, match=r"rounds.json: rounds = .* as the study wrote it"):
        read_rounds(tmp_path, study)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"sweep": {"keys": {FREQUENCY: [20, 50]}}}, r"'2 points' .* at least 4 points for rounds"),
        ({"sweep": {}}, r"refine.rounds = 3 .* 0 in a study that sweeps nothing"),
        (
            {"objective": {"better": "neither", "measure": "solid_fraction"}},
            r"refine.rounds = 3 .* objective.better is neither",
        ),
        ({"refine": {"rounds": 0, "budget_core_h": 2.0}}, r"refine.rounds = 0 .* at least 1"),
        ({"refine": {"rounds": 1, "interval": {GRAVITY: 1.0}}}, rf"a swept key, {FREQUENCY}"),
        (
            {"sweep": {"keys": {GRAVITY: [1.5], FREQUENCY: [20, 30, 40, 50, 60, 70]}}},
            rf"sweep.keys.{GRAVITY} = 1.5 .* two values or more, with rounds",
        ),
        (
            {"sweep": {"keys": {"frame": ["box", "laboratory"], FREQUENCY: [20, 50, 90]}}},
            r"sweep.keys.frame = 'box' .* numbers, in a study with rounds",
        ),
    ],
)
def test_what_cannot_be_refined_is_told(tmp_path: Path, changes: dict[str, Any], told: str) -> None:
    with pytest.raises(BadInputError, match=told):
        opened(tmp_path, **changes)


def test_an_optimum_at_the_end_of_the_sweep_is_not_called_narrow(tmp_path: Path) -> None:
    study = opened(tmp_path, refine=STUDY["refine"] | {"interval": {FREQUENCY: 20.0}}).study
    rising = table([10.0, 15.0, 20.0, 25.0, 30.0], 3, 0.001)
    log = next_round(RoundLog(basis_of(study)), study, rising, [FREQUENCY])
    assert log.ended == (
        "The optimum may lie beyond the highest frequency swept: no round inside the sweep "
        "narrows it."
    )


def test_controls_beyond_the_sweep_open_no_round_that_has_ended(tmp_path: Path) -> None:
    study = opened(
        tmp_path,
        sweep={"keys": {FREQUENCY: [10.0, 15.0, 20.0, 25.0, 30.0]}},
        replicates=3,
        refine=STUDY["refine"] | {"interval": {FREQUENCY: 4.0}},
        certificate={"controls": ["hold"]},
    ).study
    swept = table([10.0, 15.0, 20.0, 25.0, 30.0], 3, 0.01)
    ended = next_runs(RoundLog(basis_of(study)), study, swept, [FREQUENCY])
    assert ended.ended
    assert ended.certified_hz[1] == 30.0
    # The controls find more at 42.3 Hz, and less again at 60 Hz.
    with_controls = pd.concat([swept, table([21.3, 42.3, 60.0], 4, 0.01)], ignore_index=True)
    assert find_optimum(with_controls, [FREQUENCY], FILL, "larger").setting[FREQUENCY] > 35.0
    assert next_runs(ended, study, with_controls, [FREQUENCY]) == ended


@pytest.mark.slow
def test_one_command_drives_all_rounds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The runs are planted instead of computed: Snakemake itself is tested in tests/workflow."""
    monkeypatch.chdir(tmp_path)
    opened(tmp_path, certificate={"controls": ["hold"]})
    calls: list[list[str]] = []
    computed: list[str] = []

    def snakemake(plan: Plan, options: list[str], targets: list[str], begun_s: float) -> int:
        calls.append(targets)
        announce(plan, Path("results"), 1)
        for run in plan.runs:
            folder = Path("results/trial/runs") / run.run
            if (folder / "outcome.json").exists():
                continue
            computed.append(run.run)
            (folder / "outcome.json").write_text(
                json.dumps({"code": 0, "outcome": "finished", "detail": "", "simulated_s": 1.0,
                            "planned_s": 1.0})
            )  # fmt: skip
            value = fill(run.parameters[FREQUENCY]) + 0.01 * np.sin(len(computed))
            (folder / "measures.tsv").write_text(
                f"time_s\tvibration_time_s\tstage\t{FILL}\n1.0\t1.0\tvibrate_1\t{value}\n"
            )
            save_manifest(folder, {"cost": {"cpu_s": 60.0}})
        collect(Path("results/trial"))
        return 0

    monkeypatch.setattr(run_study, "_snakemake", snakemake)
    assert run_study.run_study(Path("trial.yaml"), []) == 0
    # Three rounds of four runs after the ten of the sweep, then the controls, each computed once.
    assert calls == [["results/trial/summary.tsv"]] * 4 + [[]]
    assert len(computed) == len(set(computed))
    log = json.loads((tmp_path / "results" / "trial" / ROUNDS_FILE).read_text())
    assert log["ended"] == "All 3 rounds are done."
    low, best, high = log["certified_hz"]
    rows = pd.read_csv("results/trial/runs.tsv", sep="\t")
    assert rows["run"].tolist() == computed
    assert (rows["part"][:22] == "sweep").all()
    held = rows[rows["part"] == "control: hold velocity"]
    assert sorted(held[FREQUENCY]) == [low] * SEEDS + [high] * SEEDS
    swept = rows[rows["part"] == "sweep"]
    assert all((swept[FREQUENCY] == f).sum() >= SEEDS for f in (low, best, high))
    # Again: nothing is left to compute.
    many = len(computed)
    assert run_study.run_study(Path("trial.yaml"), []) == 0
    assert len(computed) == many
