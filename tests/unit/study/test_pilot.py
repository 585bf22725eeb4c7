"""A deck of one's own is priced by a pilot, where it may run."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from sandmould.study.kinds.deck import speed
from sandmould.study.plan.build_plan import (
    Plan,
    announce,
    measure_speeds,
    open_plan,
    stored_speeds,
)
from sandmould.study.plan.price import Prices

LAMMPS = ("lammps", 0)


def short(folder: Path, steps: int) -> Plan:
    """The shipped deck with so many steps."""
    path = folder / "trial.yaml"
    path.write_text(
        f"based_on: own_deck\nscenario: {{steps: {steps}, values: {{number_of_steps: {steps}}}}}\n"
        "sweep: {keys: {values.angle_deg: [8, 24]}}\n"
    )
    return open_plan(path, folder)


def test_a_short_deck_is_computed_whole_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = short(tmp_path, 2000)
    assert measure_speeds(plan, tmp_path)
    # the first and the last point, of which the dearer counts
    ends_s = list(json.loads((tmp_path / speed.STORED).read_text()).values())
    assert len(ends_s) == 2
    assert all(0.0 < core_s < 20.0 for core_s in ends_s)
    prices = Prices(stored_speeds(plan, tmp_path))
    assert prices.engine_s(plan.runs[0]) == pytest.approx(max(ends_s))
    assert prices.basis(plan.runs) == "by a pilot run (results/pilots.json)"
    monkeypatch.setattr(speed, "pilot", lambda scenario: pytest.fail("a second pilot"))
    assert not measure_speeds(plan, tmp_path)


def test_a_long_deck_is_foretold_by_its_steps(tmp_path: Path) -> None:
    scenario = short(tmp_path, 10**9).runs[0].scenario
    core_s = speed.pilot(scenario, pilot_s=6.5)
    assert core_s is not None
    # The chute takes 20 us to 200 us a step, a thousand million of them hours.
    assert core_s > 3600.0
    without = scenario.model_copy(update={"steps": None})
    assert speed.pilot(without, pilot_s=0.5) is None


def test_a_deck_of_several_ranks_has_no_pilot(tmp_path: Path) -> None:
    scenario = short(tmp_path, 2000).runs[0].scenario
    engine = scenario.engine.model_copy(update={"ranks": 2})
    assert speed.pilot(scenario.model_copy(update={"engine": engine})) is None


def test_a_deck_that_may_not_run_has_no_pilot(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "own.in.j2").write_text("run {{ number }}\n")
    (tmp_path / "own.yaml").write_text(
        "kind: deck\nscenario: {template: own.in.j2, values: {number: 3}}\n"
    )
    monkeypatch.setattr(speed, "pilot", lambda scenario: pytest.fail("it ran"))
    assert not measure_speeds(open_plan(tmp_path / "own.yaml", tmp_path), tmp_path)


@pytest.mark.parametrize("trusted", [False, True])
def test_plan_starts_no_deck(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, trusted: bool
) -> None:
    monkeypatch.setattr(speed, "pilot", lambda scenario: pytest.fail("it ran"))
    if trusted:
        (tmp_path / "own.in.j2").write_text("run {{ number }}\n")
        (tmp_path / "own.yaml").write_text(
            "kind: deck\ntrust_deck: true\nscenario: {template: own.in.j2, values: {number: 3}}\n"
        )
        plan = open_plan(tmp_path / "own.yaml", tmp_path)
    else:
        plan = short(tmp_path, 2000)
    said = announce(plan, tmp_path, 1, measure=True)
    assert ", by expected_core_s, an estimate\n" in said
    assert not (tmp_path / speed.STORED).exists()
