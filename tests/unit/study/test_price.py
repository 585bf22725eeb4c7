"""What runs and studies will take: the arithmetic, and what is learnt from finished runs."""

from __future__ import annotations

import pytest

from sandmould import ROOT
from sandmould.definition.run import Run
from sandmould.kinds.kind import SpeedClass
from sandmould.kinds.sand import planning
from sandmould.kinds.sand.planning import (
    MEASURING_3D_S,
    PASS_S,
    PASSES,
    SandPlanning,
)
from sandmould.study.plan.batches import START_S
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from sandmould.study.plan.price import (
    BEGIN_S,
    END_S,
    Piece,
    Prices,
    TimeLeft,
    foretold_s,
    ratios_of,
    spread_s,
    study_s,
)

SAND = SandPlanning()
REFERENCE: SpeedClass = ("reference", 2)
RATES = {REFERENCE: 1e7, ("lammps", 2): 1e6}


@pytest.fixture(scope="module")
def demo() -> list[Run]:
    return expand(open_study(ROOT / "config" / "studies" / "tube_demo.yaml"))


def of_engine(runs: list[Run], name: str) -> list[Run]:
    return [run for run in runs if run.scenario.engine.name == name]


@pytest.mark.parametrize(
    ("walls_s", "cores", "whole_s"),
    [
        ([], 2, 0.0),
        ([10.0], 2, 10.0),
        ([10.0, 10.0, 10.0], 2, 20.0),
        ([1.0, 1.0, 10.0], 2, 11.0),
        ([10.0, 1.0, 1.0], 2, 10.0),
        ([3.0, 4.0], 1, 7.0),
    ],
)
def test_runs_begin_in_order_as_cores_come_free(
    walls_s: list[float], cores: int, whole_s: float
) -> None:
    assert spread_s([Piece(wall_s) for wall_s in walls_s], cores) == whole_s


def test_a_run_of_several_threads_waits_for_its_cores() -> None:
    assert spread_s([Piece(2.0), Piece(3.0, 2), Piece(1.0)], 2) == 6.0
    # One of more threads than there are cores takes all of them.
    assert spread_s([Piece(3.0, 8), Piece(1.0)], 2) == 4.0


def test_a_study_has_its_start_and_its_report() -> None:
    assert study_s([Piece(10.0)], 2) == BEGIN_S + 10.0 + END_S


def test_a_run_has_its_process_and_its_steps(demo: list[Run]) -> None:
    run = of_engine(demo, "reference")[0]
    assert foretold_s(run, RATES) == pytest.approx(SAND.planned_work(run.scenario) / 1e7)
    assert Prices(RATES).piece(run).wall_s == pytest.approx(
        START_S + SAND.planned_work(run.scenario) / 1e7
    )


def test_a_finished_run_corrects_those_of_its_engine_alone(demo: list[Run]) -> None:
    ours, other = of_engine(demo, "reference"), of_engine(demo, "lammps")
    before = Prices(RATES)
    ratios = ratios_of([(run, 3.0 * before.engine_s(run)) for run in ours[:3]], RATES)
    prices = Prices(RATES, ratios)
    assert prices.engine_s(ours[5]) == pytest.approx(3.0 * before.engine_s(ours[5]))
    assert prices.engine_s(other[0]) == before.engine_s(other[0])
    assert prices.basis(ours) == "by finished runs"
    assert prices.basis(demo) == "at the speed measured on this machine"
    assert Prices({}, ratios).basis(demo) == "an estimate"


def test_one_odd_run_does_not_set_the_price(demo: list[Run]) -> None:
    ours = of_engine(demo, "reference")[:3]
    walls_s = [100.0 * foretold_s(ours[0], RATES), *(foretold_s(run, RATES) for run in ours[1:])]
    assert ratios_of(zip(ours, walls_s, strict=True), RATES)[REFERENCE] == pytest.approx(1.0)


def test_passes_of_a_pattern_take_time_whatever_the_grains() -> None:
    small = expand(open_study(ROOT / "config" / "studies" / "l_pattern_small.yaml"))[0].scenario
    windows = SAND.planned_s(small) / small.pattern.loop.window_s
    assert SAND.beside_s(small) == pytest.approx(PASSES * PASS_S * windows)
    sand = expand(open_study(ROOT / "config" / "studies" / "tube_demo.yaml"))[0].scenario
    assert SAND.beside_s(sand) == 0.0


def test_a_matrix_beyond_the_cache_costs_more_an_entry(monkeypatch: pytest.MonkeyPatch) -> None:
    path = ROOT / "config" / "studies" / "bracket_foam_small.yaml"
    scenario = next(
        run.scenario
        for run in expand(open_study(path))
        if run.scenario.pattern.loop.scheme == "in_step"
    )
    costs_s: list[float] = []
    for components in (800, 1_600, 3_200):
        monkeypatch.setattr(planning, "_stepped_components", lambda _, n=components: n)
        costs_s.append(SAND.beside_s(scenario) - MEASURING_3D_S)
    assert costs_s[1] == pytest.approx(4 * costs_s[0])
    assert costs_s[2] > 12 * costs_s[1]


def test_time_left_is_that_of_the_whole_study(demo: list[Run]) -> None:
    runs = of_engine(demo, "reference")[:4]
    names = [run.run for run in runs]
    left = TimeLeft(runs, RATES)
    each_s = Prices(RATES).piece(runs[0]).wall_s
    assert left.seconds({}, [], 2) == 0.0
    assert left.seconds({}, names, 2) == pytest.approx(2 * each_s + END_S, rel=0.01)
    # Half of one is done, and it goes on beside a whole one.
    assert left.seconds({names[0]: 0.5}, names[1:2], 2) == pytest.approx(each_s + END_S, rel=0.01)


def test_a_run_on_its_way_counts_until_one_has_ended(demo: list[Run]) -> None:
    runs = of_engine(demo, "reference")[:3]
    left = TimeLeft(runs, RATES)
    engine_s = [foretold_s(run, RATES) for run in runs]
    left.foresee(runs[0].run, 2.0 * engine_s[0])
    assert left.prices.engine_s(runs[2]) == pytest.approx(2.0 * engine_s[2])
    left.learn(runs[1].run, 5.0 * engine_s[1])
    assert left.prices.engine_s(runs[2]) == pytest.approx(5.0 * engine_s[2])
    left.learn(runs[0].run, float("nan"))
    assert left.prices.basis(runs) == "by finished runs"
