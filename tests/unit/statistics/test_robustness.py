"""The certificate: what each control changes, which runs it adds, and what they say together."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

from sandmould import ROOT
from sandmould.analysis.spectrum import first_resonance_hz, transfer
from sandmould.bad_input import BadInputError
from sandmould.definition.certificate import SEEDS, RobustnessChecks, frequency_key, spanned_hz
from sandmould.definition.study import Study
from sandmould.kinds.registry import kind_named
from sandmould.scenario.box import Tube
from sandmould.scenario.scenario import Scenario
from sandmould.statistics.robustness import Robustness, assess_robustness
from sandmould.statistics.spring_dependence import assess_springs
from sandmould.study.plan.announcement import price
from sandmould.study.plan.build_plan import open_plan
from sandmould.study.plan.expand import expand
from sandmould.study.plan.fills import share_fills
from sandmould.study.plan.load_study import OpenStudy, open_study
from sandmould.study.robustness.controls import BY_FACTOR, SHAKEN_HZ, Case, cases
from sandmould.study.rounds.decide import next_round, next_runs
from sandmould.study.rounds.round_log import RoundLog, basis_of, read_rounds, write_rounds
from sandmould.wording.robustness import robustness_sentences

FREQUENCY = "vibration.0.frequency_hz"
FILL = "tube_fill_fraction"
BEST_HZ = 50.0
CERTIFIED_HZ = (35.5, 50.0, 70.5)
ALL = ["hold", "springs", "bed_depth", "grain_scale", "tube_length", "time_step", "engine",
       "spectrum"]  # fmt: skip
STUDY: dict[str, Any] = {
    "based_on": "tube",
    "scenario": {"engine": {"name": "reference"}},
    "sweep": {"keys": {FREQUENCY: [20, 35, 50, 70, 100]}},
    "replicates": 3,
    "equivalence": {"margins": {FILL: 0.03}},
    "certificate": {"controls": ALL},
}


def opened(folder: Path, **changes: Any) -> OpenStudy:
    path = folder / "trial.yaml"
    path.write_text(yaml.safe_dump(STUDY | changes), encoding="utf-8")
    return open_study(path)


def by_part(study: OpenStudy, best_hz: float = BEST_HZ) -> dict[str, Case]:
    scenario = study.study.scenario
    return {case.part: case for case in cases(study.study.certificate, scenario, best_hz)}


def test_what_is_held_changes_nothing_at_the_best_frequency(tmp_path: Path) -> None:
    study = opened(tmp_path)
    stage = study.study.scenario.vibration[0]
    found = by_part(study)
    assert {p for p in found if "hold" in p} == {
        "control: hold displacement", "control: hold velocity",
    }  # fmt: skip
    for power, held in ((1, "velocity"), (2, "displacement")):
        (new,) = found[f"control: hold {held}"].change(study.study.scenario).vibration
        for f in (25.0, 50.0, 100.0):
            was, now = (s.model_copy(update={"frequency_hz": f}) for s in (stage, new))
            ratio = now.peak_acceleration_g / was.peak_acceleration_g
            assert ratio == pytest.approx((f / BEST_HZ) ** power)


def test_a_sweep_with_an_unbalance_is_compared_with_motions_laid_down(tmp_path: Path) -> None:
    table = {
        "moment_kg_m": 0.006, "moving_mass_kg": 30, "mount_frequency_hz": 6, "flask_depth_m": 0.5,
    }  # fmt: skip
    stage = {"hold": "unbalance", "unbalance": table, "duration_s": 1}
    study = opened(tmp_path, scenario={"engine": {"name": "reference"}, "vibration": [stage]})
    found = {part: case for part, case in by_part(study).items() if "hold" in part}
    assert len(found) == 3
    swept = study.study.scenario.vibrations[0].model_copy(update={"frequency_hz": BEST_HZ})
    for case in found.values():
        (new,) = case.change(study.study.scenario).vibrations
        at_best = new.model_copy(update={"frequency_hz": BEST_HZ})
        assert new.unbalance is None
        assert at_best.amplitude_m == pytest.approx(swept.amplitude_m)
        # sand on a table changes its amplitude, so that the middle frequency differs too
        assert case.steps == (-1, 0, 1)


def test_each_control_changes_what_it_is_named_after(tmp_path: Path) -> None:
    study = opened(tmp_path)
    old = study.study.scenario

    def new(part: str) -> Scenario:
        return by_part(study)[f"control: {part}"].change(old)

    soft = new("springs x0.25 acceleration").contact
    for pair in ("grain_grain", "grain_wall"):
        for key in ("normal", "tangential", "rolling"):
            name = f"{key}_stiffness_n_m"
            was, now = (getattr(getattr(c, pair), name) for c in (old.contact, soft))
            assert now == pytest.approx(0.25 * was)
    assert soft.grain_grain.friction == old.contact.grain_grain.friction
    allowed = {part: new(part).guard.largest_overlap_fraction
               for part in ("springs x0.25 velocity", "springs x4 velocity", "bed_depth x2")
               }  # fmt: skip
    assert allowed == pytest.approx(
        {"springs x0.25 velocity": 1.0, "springs x4 velocity": 0.5, "bed_depth x2": 0.5}
    )
    loose = old.model_copy(
        update={"guard": old.guard.model_copy(update={"largest_overlap_fraction": 1.2})}
    )
    softest = by_part(study)["control: springs x0.25 acceleration"].change(loose)
    assert softest.guard.largest_overlap_fraction == 2.0
    deep = new("bed_depth x2")
    assert deep.fill.layers[0].height_m == 2 * old.fill.layers[0].height_m
    assert deep.box.height_m == 2 * old.box.height_m
    assert new("bed_depth x0.5").box.height_m == old.box.height_m
    assert new("grain_scale x1.5").sand.size_scale == 1.5 * old.sand.size_scale
    tube, longer = (next(o for o in s.obstacles if isinstance(o, Tube))
                    for s in (old, new("tube_length x1.5")))  # fmt: skip
    assert longer.length_m == pytest.approx(1.5 * tube.length_m)
    assert longer.right_end_x_m == pytest.approx(tube.right_end_x_m)
    assert new("time_step x0.5").step_s == pytest.approx(0.5 * old.step_s)
    of_bed = old.time_step.model_copy(update={"bed_fraction": 0.7})
    of_bed = (
        by_part(study)["control: time_step x0.5"]
        .change(old.model_copy(update={"time_step": of_bed}))
        .time_step
    )
    assert (of_bed.fraction, of_bed.bed_fraction) == (0.5 * old.time_step.fraction, 0.35)
    assert new("engine lammps").engine.name == "lammps"
    shaken = new("spectrum small shake")
    assert [s.frequency_hz for s in shaken.vibration] == list(SHAKEN_HZ)
    assert all(s.peak_acceleration_g < 0.1 for s in shaken.vibration)


def test_sand_by_number_of_grains_stays_as_much(tmp_path: Path) -> None:
    study = opened(tmp_path, scenario={"engine": {"name": "reference"},
                                       "fill": {"layers": [{"count": 900}]}})  # fmt: skip
    coarse = by_part(study)["control: grain_scale x1.5"].change(study.study.scenario)
    assert coarse.fill.layers[0].count == 400


def test_springs_are_changed_with_each_amplitude_held(tmp_path: Path) -> None:
    study = opened(tmp_path)
    old, found = study.study.scenario, by_part(study)
    springs = {part: case for part, case in found.items() if "springs" in part}
    assert set(springs) == {
        f"control: springs x{factor} {hold}"
        for factor in ("0.25", "4") for hold in ("acceleration", "velocity", "displacement")
    }  # fmt: skip
    for case in springs.values():
        changed = case.change(old)
        ratio = (changed.contact.grain_wall.normal_stiffness_n_m
                 / old.contact.grain_wall.normal_stiffness_n_m)  # fmt: skip
        assert ratio == pytest.approx(case.factor)
        (stage,) = changed.vibrations
        assert stage.hold == case.hold
        at_best = stage.model_copy(update={"frequency_hz": BEST_HZ})
        assert at_best.peak_acceleration_g == pytest.approx(1.5)


def test_runs_are_added_round_the_best_and_share_their_seeds(tmp_path: Path) -> None:
    study = opened(tmp_path, certificate={"controls": ["hold", "springs", "spectrum"]})
    swept = expand(study)
    runs = expand(study, (), CERTIFIED_HZ)
    assert [r.run for r in runs[: len(swept)]] == [r.run for r in swept]
    count: dict[str, int] = {}
    for run in runs:
        count[run.part] = count.get(run.part, 0) + 1
    # Of seven frequencies 50 Hz is swept already; at it all holds are one motion.
    of_springs = {
        f"control: springs x{factor} {hold}": (7 if hold == "acceleration" else 6) * SEEDS
        for factor in ("0.25", "4") for hold in ("acceleration", "velocity", "displacement")
    }  # fmt: skip
    assert count == {
        "sweep": 5 * 3 + 6 * SEEDS + SEEDS - 3,
        "control: hold velocity": 2 * SEEDS, "control: hold displacement": 2 * SEEDS,
        **of_springs,
        "control: spectrum small shake": SEEDS,
    }  # fmt: skip
    assert len({r.run for r in runs}) == len(runs)
    seeds = {r.seed for r in runs}
    assert {r.seed for r in swept} < seeds
    assert len(seeds) == SEEDS
    soft = [r for r in runs if r.part == "control: springs x0.25 velocity"]
    assert soft[0].run.startswith("control_springs_x0_25_velocity_frequency_17p9_r1_")
    # Fillings differ by springs and seed alone: holds and frequencies share them.
    _, fills = share_fills(runs, kind_named("sand").planning)
    assert len(fills) == 3 * SEEDS
    # Without springs three frequencies are enough.
    few = expand(opened(tmp_path, certificate={"controls": ["hold"]}), (), CERTIFIED_HZ)
    assert {r.parameters[FREQUENCY] for r in few} == {20, 35, 50, 70, 100, 35.5, 70.5}


def test_the_plan_prices_controls_that_are_still_to_come(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    opened(tmp_path, certificate={"controls": ["springs"]})
    plan = open_plan(tmp_path / "trial.yaml")
    said = price(plan, tmp_path / "results", 2)
    # 2 x (7 + 6 + 6) runs of springs and six further frequencies of the sweep, 4 seeds each; the
    # best frequency of the sweep, which has three, gets one more.
    assert "Then, once the optimum is known, its controls: about 177 runs, 152 of them with" in said
    log = RoundLog(basis_of(plan.study.study), (), "The sweep is done.", CERTIFIED_HZ)
    (tmp_path / "results" / "trial").mkdir(parents=True)
    write_rounds(log, tmp_path / "results" / "trial")
    chosen = open_plan(tmp_path / "trial.yaml")
    assert len(chosen.runs) == len(plan.runs) + 177
    assert "Then," not in price(chosen, tmp_path / "results", 2)


def test_a_control_that_cannot_be_run_is_told_before_anything_starts(tmp_path: Path) -> None:
    wide = {"engine": {"name": "reference"}, "obstacles": [
        {"kind": "tube", "diameter_m": 0.024, "length_m": 0.11, "left_end_x_m": 0.01,
         "axis_height_m": 0.035, "closed_end": "right"}]}  # fmt: skip
    study = opened(tmp_path, scenario=wide, certificate={"controls": ["tube_length"]})
    with pytest.raises(BadInputError, match=r"certificate.controls = 'tube_length x1.5' cannot"):
        expand(study, (), CERTIFIED_HZ)


def test_a_refused_control_is_told_before_the_first_run_not_after_the_rounds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    long = {"obstacles": [{"kind": "tube", "diameter_m": 0.024, "length_m": 0.11,
                           "left_end_x_m": 0.01, "axis_height_m": 0.035,
                           "closed_end": "right"}]}  # fmt: skip
    opened(tmp_path, scenario=STUDY["scenario"] | long, refine={"rounds": 2})
    with pytest.raises(BadInputError, match=r"certificate.controls = 'tube_length x1.5' cannot"):
        open_plan(tmp_path / "trial.yaml")


def test_an_engine_that_refuses_a_control_is_told_before_the_first_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    # LAMMPS moves no wall.
    piston = {"wall": "left", "velocity_m_s": 0.01, "duration_s": 0.1}
    scene = STUDY["scenario"] | {"piston": piston}
    opened(tmp_path, scenario=scene, certificate={"controls": ["engine"]})
    with pytest.raises(BadInputError, match="absent on engine lammps, whose walls stand"):
        open_plan(tmp_path / "trial.yaml")


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"sweep": {"keys": {"sand.size_scale": [6, 7, 8, 9]}}}, r"one swept key, a frequency"),
        ({"sweep": {"keys": {FREQUENCY: [20, 50]}}}, r"at least 4 frequencies to find the best"),
        ({"certificate": {"controls": ["hold", "hold"]}}, r"'hold' .* each control once"),
        (
            {"scenario": {"obstacles": []}, "objective": {"measure": "solid_fraction"}},
            r"'tube_length' .* there is no tube",
        ),
    ],
)
def test_certificates_that_make_no_sense_are_told(
    tmp_path: Path, changes: dict[str, Any], told: str
) -> None:
    with pytest.raises(BadInputError, match=told):
        opened(tmp_path, **changes)


def planted(
    fill: Callable[[str, float], float], parts: list[str], sd: float, seed: int = 3
) -> pd.DataFrame:
    """A summary of the sweep and its controls; the fill is given by part and frequency."""
    noise = np.random.default_rng(seed)
    rows = []
    spanned = tuple(spanned_hz(CERTIFIED_HZ).values())
    for part in ("sweep", *(f"control: {p}" for p in parts)):
        for f in CERTIFIED_HZ if part != "sweep" and "springs" not in part else spanned:
            for replicate in (1, 2, 3):
                value = fill(part.removeprefix("control: "), f) + noise.normal(0.0, sd)
                rows.append({"part": part, FREQUENCY: f, "replicate": replicate,
                             "outcome_code": 0, "cpu_s": 10.0, FILL: value})  # fmt: skip
    return pd.DataFrame(rows)


def hill(frequency_hz: float, best_hz: float) -> float:
    return 0.6 - 0.3 * float(np.log(frequency_hz / best_hz)) ** 2


SPRINGS = ["springs x0.25 acceleration", "springs x4 acceleration"]
PARTS = ["hold velocity", "hold displacement", *SPRINGS, "bed_depth x0.5", "bed_depth x2",
         "time_step x0.5", "engine lammps"]  # fmt: skip


def assess_study(table: pd.DataFrame, study: Study) -> Robustness:
    """Assess the controls of a study by its own objective and margin."""
    margin = study.equivalence.margins.get(study.objective.measure)
    controlled = tuple(cases(study.certificate, study.scenario, CERTIFIED_HZ[1]))
    objective = study.objective
    springs = assess_springs(
        table, FREQUENCY, BEST_HZ, objective, controlled, "acceleration", margin
    )
    return assess_robustness(table, FREQUENCY, CERTIFIED_HZ, objective, margin, controlled, springs)


def assessed(
    tmp_path: Path, moved: dict[str, float], sd: float = 0.004, parts: list[str] = PARTS
) -> Robustness:
    """Assess controls of which some move the optimum to another frequency."""
    table = planted(lambda part, f: hill(f, moved.get(part, BEST_HZ)), parts, sd)
    return assess_study(table, opened(tmp_path).study)


def test_an_optimum_that_nothing_moves_belongs_to_the_sand(tmp_path: Path) -> None:
    found = assessed(tmp_path, {})
    assert found.cause == "rearrangement of grains"
    assert not found.is_artefact
    assert {m.verdict for m in found.shifts} == {"held"}
    assert (found.best_hz, found.lacking) == (50.0, ())


FOLLOWING = {SPRINGS[0]: 25.0, SPRINGS[1]: 100.0}


def test_an_optimum_that_goes_with_springs_and_depth_is_the_beds(tmp_path: Path) -> None:
    column = FOLLOWING | {"bed_depth x0.5": 100.0, "bed_depth x2": 25.0}
    found = assessed(tmp_path, column)
    assert found.cause == "bed resonance"
    assert not found.is_artefact
    assert [m.name for m in found.moved_by("bed_depth")] == ["bed depth x0.5", "bed depth x2"]
    # Springs alone are not enough to call it a column.
    alone = assessed(tmp_path, FOLLOWING)
    assert alone.cause == "follows the springs"
    against = assessed(tmp_path, FOLLOWING | {"bed_depth x0.5": 25.0, "bed_depth x2": 100.0})
    assert against.cause == "follows the springs"


def test_other_factors_of_the_depth_reach_the_same_verdict(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What a control multiplies by is passed on as a number: 3 stands for 2."""
    monkeypatch.setitem(BY_FACTOR, "bed_depth", ((0.5, 3.0), BY_FACTOR["bed_depth"][1]))
    moved = {"bed_depth x0.5": 100.0, "bed_depth x3": 50 / 3}
    found = assessed(tmp_path, moved, parts=list(moved))
    assert all(s.follows_depth for s in found.shifts)
    against = assessed(tmp_path, moved | {"bed_depth x3": 150.0}, parts=list(moved))
    assert [s.follows_depth for s in against.shifts] == [True, False]


def test_what_is_held_and_the_numerics_are_told_apart(tmp_path: Path) -> None:
    held = assessed(tmp_path, {"hold velocity": 70.0, "hold displacement": 100.0})
    assert held.cause == "held artefact"
    assert [m.name for m in held.moved_by("hold")] == ["velocity held", "displacement held"]
    step = assessed(tmp_path, {"hold velocity": 70.0, "time_step x0.5": 75.0})
    assert step.cause == "numerics artefact"
    assert {m.name: m.verdict for m in step.moved} == {
        "velocity held": "up", "time step x0.5": "up"
    }  # fmt: skip
    both = assessed(tmp_path, {"hold velocity": 30.0, "time_step x0.5": 75.0})
    said = robustness_sentences(both)
    assert said[0].endswith("comes from the numerics: it moves with time step x0.5.")
    assert said[1] == "It moves up with time step x0.5 and down with velocity held."


def test_noise_leaves_it_unresolved(tmp_path: Path) -> None:
    # One control in twenty moves it by chance alone; with these draws none does.
    table = planted(lambda part, f: hill(f, BEST_HZ), PARTS, 0.1, seed=4)
    found = assess_study(table, opened(tmp_path).study)
    assert found.cause == "unresolved"
    assert found.untold


def test_controls_that_were_not_asked_or_failed_keep_it_unresolved(tmp_path: Path) -> None:
    table = planted(lambda part, f: hill(f, BEST_HZ), [*PARTS[2:6], "time_step x0.5"], 0.004)
    failed = ["control: springs x4 acceleration", "control: time_step x0.5"]
    table.loc[table["part"].isin(failed), "outcome_code"] = 311
    found = assess_study(table, opened(tmp_path).study)
    assert found.cause == "unresolved"
    assert found.lacking == ("hold", "engine")
    assert [m.name for m in found.untold] == ["time step x0.5"]
    assert found.springs is not None
    assert found.springs.own.dependence == "unresolved"


def test_frequencies_are_chosen_round_the_optimum_and_anew_after_more_rounds(
    tmp_path: Path,
) -> None:
    study = opened(tmp_path, refine={"rounds": 2, "runs": 3}).study
    table = planted(lambda part, f: hill(f, BEST_HZ), [], 0.002)
    log = next_runs(RoundLog(basis_of(study)), opened(tmp_path).study, table, [FREQUENCY])
    low, best, high = log.certified_hz
    assert best == pytest.approx(BEST_HZ, rel=0.06)
    assert (low, high) == pytest.approx((best / 1.41, best * 1.41), rel=0.01)
    write_rounds(log, tmp_path)
    assert read_rounds(tmp_path, study) == log
    assert next_round(log, study, table, [FREQUENCY]).certified_hz == ()


def test_a_swept_frequency_is_found() -> None:
    sweep = open_study(ROOT / "config" / "studies" / "tube_demo.yaml").study.sweep
    assert frequency_key(sweep) == FREQUENCY
    assert RobustnessChecks().controls == ()


def shaken_mass(frequency_hz: float, own_hz: float, damping: float) -> float:
    """Force amplitude of a mass on a spring over that of a rigid one: exact."""
    r = frequency_hz / own_hz
    passed = 1 + (2 * damping * r) ** 2
    return float(np.sqrt(passed / ((1 - r * r) ** 2 + (2 * damping * r) ** 2)))


def test_transfer_is_that_of_a_mass_on_a_spring() -> None:
    own_hz, damping, window_s, rigid_n = 80.0, 0.2, 3e-4, 2.5
    shaken = np.array(SHAKEN_HZ)
    found = []
    for f in SHAKEN_HZ:
        amplitude = rigid_n * shaken_mass(f, own_hz, damping)
        ends = np.arange(1, int(8 / f / window_s)) * window_s
        # The mean of a sine over each window, exactly.
        a, b = 2 * np.pi * f * (ends - window_s), 2 * np.pi * f * ends
        mean = amplitude * (np.cos(a + 0.3) - np.cos(b + 0.3)) / (b - a) + 40.0
        found.append(transfer(ends, mean, f, window_s, rigid_n))
        assert found[-1] == pytest.approx(shaken_mass(f, own_hz, damping), rel=1e-6)
    # The grid is coarse: 1.26 from frequency to frequency.
    assert first_resonance_hz(shaken, np.array(found)) == pytest.approx(own_hz, rel=0.1)
    assert np.isnan(first_resonance_hz(shaken, np.linspace(1.0, 0.1, len(shaken))))
    assert np.isnan(transfer(np.array([0.0, 1e-3]), np.zeros(2), 50.0, 1e-3, 1.0))
