"""A deck of one's own is priced by a pilot, where it may run."""

from __future__ import annotations

import math
from pathlib import Path

import pandas as pd
import pytest

from sandmould.bad_input import BadInputError
from sandmould.kinds.deck import speed
from sandmould.scenario.own_deck import Taken
from sandmould.study.plan import announcement
from sandmould.study.plan.announcement import announce, measure_speeds, stored_speeds
from sandmould.study.plan.build_plan import Plan, open_plan
from sandmould.study.plan.price import Prices
from sandmould.user_cache import user_cache

LAMMPS = ("lammps", 0)

pytestmark = pytest.mark.usefixtures("unmeasured")


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
    measure_speeds(plan, tmp_path)
    # the first and the last point, of which the dearer counts
    kept = {plan.kind.planning.speed.file(run.scenario) for run in plan.runs}
    ends_s = [float(file.read_text()) for file in kept]
    assert len(ends_s) == 2
    assert all(0.0 < core_s < 20.0 for core_s in ends_s)
    prices = Prices(stored_speeds(plan))
    assert prices.engine_s(plan.runs[0]) == pytest.approx(max(ends_s))
    assert prices.basis(plan.runs) == "by a pilot run"
    monkeypatch.setattr(speed, "pilot", lambda *_: pytest.fail("a second pilot"))
    measure_speeds(plan, tmp_path)


def test_a_long_deck_is_foretold_by_its_steps(tmp_path: Path) -> None:
    scenario = short(tmp_path, 10**9).runs[0].scenario
    core_s, _ = speed.pilot(scenario, tmp_path, pilot_s=6.5)
    assert core_s is not None
    # The chute takes 20 us to 200 us a step, a thousand million of them hours.
    assert core_s > 3600.0
    without = scenario.model_copy(update={"steps": None})
    assert speed.pilot(without, tmp_path, pilot_s=0.5)[0] is None


def test_windows_beyond_the_run_of_a_pilot_are_told(tmp_path: Path) -> None:
    plan = short(tmp_path, 2000)
    measures = {"late_m_s": Taken(of="v_speed", take="mean", from_s=500.0),
                "speed_m_s": Taken(of="v_speed", take="mean", over_last_s=1e-3)}  # fmt: skip
    scenario = plan.runs[0].scenario.model_copy(update={"measures": measures})
    _, said = speed.pilot(scenario, tmp_path)
    assert "s, and measures.late_m_s.from_s is 500 s." in said
    assert "over_last_s" not in said


def test_a_deck_of_several_ranks_has_no_pilot(tmp_path: Path) -> None:
    scenario = short(tmp_path, 2000).runs[0].scenario
    engine = scenario.engine.model_copy(update={"ranks": 2})
    assert speed.pilot(scenario.model_copy(update={"engine": engine}), tmp_path) == (None, "")


def test_a_deck_that_may_not_run_has_no_pilot(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "own.in.j2").write_text("run {{ number }}\n")
    (tmp_path / "own.yaml").write_text(
        "kind: deck\nscenario: {template: own.in.j2, values: {number: 3}}\n"
    )
    monkeypatch.setattr(speed, "pilot", lambda *_: pytest.fail("it ran"))
    measure_speeds(open_plan(tmp_path / "own.yaml", tmp_path), tmp_path)


@pytest.mark.parametrize("trusted", [False, True])
def test_plan_starts_no_deck(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, trusted: bool
) -> None:
    monkeypatch.setattr(speed, "pilot", lambda *_: pytest.fail("it ran"))
    if trusted:
        (tmp_path / "own.in.j2").write_text("run {{ number }}\n")
        (tmp_path / "own.yaml").write_text(
            "kind: deck\ntrust_deck: true\nscenario: {template: own.in.j2, values: {number: 3}}\n"
        )
        plan = open_plan(tmp_path / "own.yaml", tmp_path)
    else:
        plan = short(tmp_path, 2000)
    said = announce(plan, tmp_path, 1, measure="engines")
    assert (
        ", by expected_core_s (600 s unless you write it), until a first run has shown it\n" in said
    )
    assert not (user_cache() / "speeds").exists()


def failing(folder: Path, angles_deg: str) -> Plan:
    """A deck that stops with an error where its angle is above 20."""
    (folder / "own.in.j2").write_text(
        "units si\natom_style sphere\nregion box block 0 1 0 1 0 1\ncreate_box 1 box\n"
        "{{ 'nonsense here' if angle_deg > 20 else '' }}\n"
        "thermo_style custom step time\npair_style zero 0.1\npair_coeff * *\nrun 1\n"
    )
    (folder / "own.yaml").write_text(
        "kind: deck\ntrust_deck: true\n"
        "scenario: {template: own.in.j2, values: {angle_deg: 8}}\n"
        f"sweep: {{keys: {{values.angle_deg: {angles_deg}}}}}\n"
    )
    return open_plan(folder / "own.yaml", folder / "results")


def test_a_deck_that_fails_is_told_with_the_engines_own_line(tmp_path: Path) -> None:
    results = tmp_path / "results"
    with pytest.raises(BadInputError) as told:
        measure_speeds(failing(tmp_path, "[24, 32]"), results)
    (said,) = str(told.value).splitlines()
    assert "Unknown command: nonsense here" in said
    assert said.endswith(f" Its log: {results / speed.FAILED_LOG}. No run was begun.")
    assert "nonsense here" in (results / speed.FAILED_LOG).read_text()
    assert not (user_cache() / "speeds").exists()


def test_a_point_that_fails_alone_is_told_and_keeps_nothing_from_running(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    measure_speeds(failing(tmp_path, "[8, 32]"), tmp_path / "results")
    said = capsys.readouterr().err
    assert said.startswith("Trying own.in.j2 at 2 points, each for some seconds.\n")
    assert said.rstrip().endswith("The other points are computed.")
    assert "Unknown command: nonsense here" in said


TRYING = "Trying own.in.j2 for some seconds.\n"
FALLING = """\
{{% if restart %}}
units si
read_restart {{{{ restart }}}}
{{% else %}}
units si
atom_style sphere
region box block 0 1 0 1 0 1
create_box 1 box
create_atoms 1 single 0.5 0.5 0.5
velocity all set 0 0 0.2
{{% endif %}}
pair_style zero 0.1
pair_coeff * *
fix gravity all gravity 9.81 vector 0 0 -1
fix motion all nve/sphere
{then}
timestep 1e-4
variable speed equal vcm(all,z)
thermo_style custom step time v_speed
thermo 10
restart 40 {{{{ restart_files }}}}
run 100 {upto}
"""


@pytest.mark.parametrize(
    ("then", "upto", "told"),
    [
        ("", "upto", ""),
        (
            "velocity all set 0 0 0.2",
            "upto",
            "own.in.j2 with the values {}: gone on from a restart file, it comes to other values "
            "than in one piece: at step 100 speed 0.1411 m/s instead of 0.1019 m/s; they part at "
            "once, so the deck does not bring back all that it needs.\n",
        ),
        (
            "",
            "",
            "own.in.j2 with the values {}: a run that is killed does not go on as it should. the "
            "deck ended at step 140, not at steps = 100: after a restart write run 100 upto; gone "
            "on from restart.a at step 40.\n",
        ),
    ],
)
def test_what_a_restart_changes_is_said_before_the_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], then: str, upto: str, told: str
) -> None:
    (tmp_path / "own.in.j2").write_text(FALLING.format(then=then, upto=upto))
    (tmp_path / "own.yaml").write_text(
        "kind: deck\ntrust_deck: true\nobjective: {measure: speed_m_s}\n"
        "scenario: {template: own.in.j2, measures: {speed_m_s: v_speed}, steps: 100}\n"
    )
    plan = open_plan(tmp_path / "own.yaml", tmp_path / "results")
    for said in (TRYING, ""):
        measure_speeds(plan, tmp_path / "results")
        assert capsys.readouterr().err == said + told


def test_what_parts_slowly_is_told_apart() -> None:
    whole = pd.DataFrame({"log_Step": [0, 1, 2, 3], "speed_m_s": [1.0, 2.0, 3.0, 4.1]})
    resumed = whole.assign(speed_m_s=[1.0, 2.0, 3.00001, 4.2])
    told = speed.difference(whole, resumed, ["speed_m_s"])
    assert "at step 3 speed 4.200 m/s instead of 4.100 m/s; they part slowly" in told
    near = whole.assign(speed_m_s=[1.0, 2.0, 3.0, 4.104])
    assert speed.difference(whole, near, ["speed_m_s"]) == ""


def test_finished_runs_price_a_deck(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plan = short(tmp_path, 2000)
    ended = tmp_path / plan.study.name / plan.runs[0].place
    monkeypatch.setattr(
        announcement, "computed_wall_s", lambda folder: 240.0 if folder == ended else math.nan
    )
    prices = announcement.known_prices(plan, tmp_path)
    assert prices.basis(plan.runs) == "by finished runs"
    other = plan.runs[-1]
    assert prices.engine_s(other) == prices.work(other) == pytest.approx(240.0)
    assert f"{len(plan.runs) * 240} core-seconds" in announce(plan, tmp_path, 1).replace(",", "")
