"""The plan on disk and its price."""

from __future__ import annotations

import math
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from sandmould import ROOT
from sandmould.bad_input import BadInputError
from sandmould.definition.run import RUN_NAME, Run
from sandmould.engines.durations import REST_AFTER_FALL_S, REST_AFTER_MOTION_S, run_s, stage_s
from sandmould.engines.program import build_program
from sandmould.kinds.sand.planning import SandPlanning
from sandmould.kinds.sand.speed import SandSpeed
from sandmould.runs.progress import duration_text
from sandmould.scenario.placement import loose_height_m, plan_counts
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.stages import stage_kind
from sandmould.scenario.vibration import STOP_PERIODS
from sandmould.study.plan import plan_files
from sandmould.study.plan.announcement import announce, measure_speeds
from sandmould.study.plan.batches import START_S
from sandmould.study.plan.build_plan import open_plan
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from sandmould.study.plan.plan_files import plan_table, read_run
from sandmould.study.plan.price import BEGIN_S, END_S, Prices
from sandmould.user_cache import user_cache
from tests.planned import write_plan

LAMMPS = ("lammps", 2)
SAND = SandPlanning()
MEASURED = "at the speed measured on this machine"
THREE = """\
based_on: tube
scenario: {sand: {size_scale: 6}}
sweep: {keys: {vibration.0.frequency_hz: [25, 50, 100]}}
replicates: 3
"""


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> list[Run]:
    """Nine runs of a small study."""
    path = tmp_path_factory.mktemp("studies") / "three.yaml"
    path.write_text(THREE, encoding="utf-8")
    return expand(open_study(path))


def times(folder: Path) -> dict[str, int]:
    return {str(p): p.stat().st_mtime_ns for p in folder.rglob("*") if p.is_file()}


def backdate(folder: Path) -> None:
    for path in folder.rglob("*"):
        os.utime(path, (1e9, 1e9))


def test_table_has_a_row_a_run(demo: list[Run], tmp_path: Path) -> None:
    write_plan(demo, tmp_path)
    text = (tmp_path / "runs.tsv").read_text(encoding="utf-8")
    assert text.splitlines()[0] == "run\tvibration.0.frequency_hz\treplicate\tseed"
    assert text.splitlines()[1] == f"{demo[0].run}\t25\t1\t{demo[0].seed}"
    table = pd.read_csv(tmp_path / "runs.tsv", sep="\t")
    assert list(table["run"]) == [r.run for r in demo]
    assert list(table["vibration.0.frequency_hz"]) == [25] * 3 + [50] * 3 + [100] * 3
    assert not list(tmp_path.rglob("*.partial"))


def test_same_plan_again_touches_nothing(demo: list[Run], tmp_path: Path) -> None:
    write_plan(demo, tmp_path)
    backdate(tmp_path)
    before = times(tmp_path)
    write_plan(demo, tmp_path)
    assert times(tmp_path) == before
    assert len(before) == 10


def test_later_round_appends_rows_and_leaves_the_old_runs_alone(
    demo: list[Run], tmp_path: Path
) -> None:
    first, later = demo[3:], demo
    write_plan(first, tmp_path)
    backdate(tmp_path)
    before = times(tmp_path / "runs")
    write_plan(later, tmp_path)
    rows = pd.read_csv(tmp_path / "runs.tsv", sep="\t")["run"]
    assert list(rows) == [r.run for r in (*demo[3:], *demo[:3])]
    assert before.items() <= times(tmp_path / "runs").items()
    write_plan(demo[:4], tmp_path)
    rows = pd.read_csv(tmp_path / "runs.tsv", sep="\t")["run"]
    assert list(rows) == [demo[3].run, *(r.run for r in demo[:3])]
    assert (tmp_path / "runs" / demo[8].run / "scenario.yaml").is_file()


def test_run_reads_back_as_it_was(demo: list[Run], tmp_path: Path) -> None:
    write_plan(demo, tmp_path)
    for run in demo:
        assert read_run(tmp_path / "runs" / run.run / "scenario.yaml") == run


def test_a_run_has_no_folder_before_it_is_computed(demo: list[Run], tmp_path: Path) -> None:
    plan_files.write_plan(demo[:2], tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["runs.tsv"]
    assert plan_files.write_run(demo[0], tmp_path) == tmp_path / demo[0].place


def test_a_run_that_was_begun_follows_its_plan(demo: list[Run], tmp_path: Path) -> None:
    path = plan_files.write_run(demo[0], tmp_path) / "scenario.yaml"
    first = path.stat().st_mtime_ns
    plan_files.write_plan(demo[:1], tmp_path)
    assert path.stat().st_mtime_ns == first
    # Plans did not write the kind; results of weeks must not be computed again for that.
    path.write_text(path.read_text().replace("kind: sand\n", "").split("\n", 1)[1])
    plan_files.write_plan(demo[:1], tmp_path)
    assert read_run(path) == demo[0]
    elsewhere = replace(demo[0], sources=demo[0].sources | {"seed": "another file"})
    plan_files.write_plan([elsewhere], tmp_path)
    assert read_run(path) == elsewhere


def price_line(text: str) -> str:
    """The line of a plan that tells what all runs take."""
    (line,) = [line for line in text.splitlines() if "with report: " in line]
    return line


@pytest.mark.usefixtures("unmeasured")
def test_plan_is_announced_without_an_engine(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(SandSpeed, "trial", lambda *_: pytest.fail("an engine started"))
    plan = open_plan(ROOT / "config" / "studies" / "tube_demo.yaml")
    assert price_line(announce(plan, tmp_path, 1)).endswith(", an estimate")
    assert not (user_cache() / "speeds").exists()
    monkeypatch.setattr(SandSpeed, "trial", lambda *_: 1e7)
    assert capsys.readouterr().err == ""
    measure_speeds(plan, tmp_path)
    assert capsys.readouterr().err.startswith("Measuring the speed of this machine, once: about ")
    measure_speeds(plan, tmp_path)
    assert capsys.readouterr().err == ""
    assert price_line(announce(plan, tmp_path, 1)).endswith(f", {MEASURED}")
    anew = announce(plan, tmp_path / "anew", 1, measure="engines")
    assert price_line(anew).endswith(f", {MEASURED}")


def test_results_that_cannot_be_written_are_told(tmp_path: Path) -> None:
    plan = open_plan(ROOT / "config" / "studies" / "tube_demo.yaml")
    (tmp_path / "results").write_text("a file where a folder should be")
    with pytest.raises(BadInputError, match=r"valid is a folder that takes files: .* \(Not a dir"):
        announce(plan, tmp_path / "results", 1)


def test_damaged_run_file_is_bad_input(demo: list[Run], tmp_path: Path) -> None:
    write_plan(demo[:1], tmp_path)
    path = tmp_path / "runs" / demo[0].run / "scenario.yaml"
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("size_scale: 6.0", "size_scale: big"), encoding="utf-8")
    with pytest.raises(BadInputError, match=r"scenario\.sand\.size_scale = 'big'"):
        read_run(path)
    path.write_text("kind: sand\nrun: x", encoding="utf-8")
    with pytest.raises(BadInputError, match="study = None"):
        read_run(path)


def test_stages_are_falls_and_vibrations() -> None:
    between = {"acceleration_g": 1.0, "frequency_hz": 40.0, "duration_s": 0.1}
    scene = Scenario.model_validate(
        {
            "time_step": {"bed_fraction": 0},
            "fill": {"layers": [{"count": 300}, {"count": 200}],
                     "vibration_between_layers": between},
            "vibration": [{"acceleration_g": 1.5, "frequency_hz": 30.0, "duration_s": 0.31}],
        }
    )  # fmt: skip
    falls = [
        math.sqrt(2 * (0.005 + loose_height_m(scene, count)) / scene.gravity_m_s2)
        for count in (300, 200)
    ]
    expected = [falls[0] + REST_AFTER_FALL_S, 0.1, falls[1] + REST_AFTER_FALL_S, 9 / 30,
                STOP_PERIODS / 30 + REST_AFTER_MOTION_S]  # fmt: skip
    program = build_program(scene)
    stages = program.stages
    names = ["settle_1", "between_1", "settle_2", "vibrate_1", "rest"]
    assert [stage.name for stage in stages] == names
    assert [stage_kind(stage.name) for stage in stages] == [stage.kind for stage in stages]
    lasting = [stage_s(program, stage) for stage in stages]
    assert lasting == pytest.approx(expected)
    steps = [time / scene.step_s for time in expected]
    assert SAND.planned_steps(scene) == pytest.approx(sum(steps), abs=5)
    assert SAND.planned_work(scene) == pytest.approx(300 * sum(steps[:2]) + 500 * sum(steps[2:]))


def test_settling_is_planned_no_longer_than_its_rule_allows() -> None:
    scene = Scenario.model_validate(
        {"fill": {"layers": [{"count": 300}], "settling": {"longest_s": 0.2}}}
    )
    assert run_s(build_program(scene)) == 0.2
    at_once = {**scene.model_dump(), "rest": {"rms_speed_m_s": 10.0}}
    rule = scene.fill.settling.model_copy(update={"longest_s": 2.0})
    trivial = Scenario.model_validate(at_once).model_copy(
        update={"fill": scene.fill.model_copy(update={"settling": rule})}
    )
    assert run_s(build_program(trivial)) == rule.shortest_s
    weightless = scene.model_copy(update={"gravity_m_s2": 0.0})
    assert run_s(build_program(weightless)) == 0.2


def test_price_of_an_unknown_machine_is_an_estimate(demo: list[Run]) -> None:
    last = price_line(plan_table(demo, Prices(), 1))
    seconds = BEGIN_S + END_S + sum(START_S + SAND.predicted_s(r.scenario) for r in demo)
    assert last.startswith("9 runs")
    assert last.endswith(f"Wall time on 1 core with report: {duration_text(seconds)}, an estimate")


def test_price_is_grain_steps_over_rate_and_cores(demo: list[Run]) -> None:
    total = sum(SAND.planned_work(r.scenario) for r in demo)
    # times well inside the range of their unit: the sums above carry round-off
    table = plan_table(demo, Prices({LAMMPS: total / 9000}), 1)
    lines = table.splitlines()
    grains = sum(plan_counts(demo[0].scenario))
    assert lines[1].split()[:3] == ["frequency_25", "3", f"{grains:,}"]
    assert price_line(table).startswith("9 runs, ")
    assert price_line(table).endswith(f"Wall time on 1 core with report: 2.5 h, {MEASURED}")
    # Nine runs on two cores: five after each other.
    longer = duration_text(BEGIN_S + END_S + 5 * (START_S + 10_000))
    halved = plan_table(demo, Prices({LAMMPS: total / 90_000}), 2)
    assert price_line(halved).endswith(f"on 2 cores with report: {longer}, {MEASURED}")
    # On more cores than runs the longest run decides.
    longest = max(SAND.planned_work(r.scenario) for r in demo)
    alone = duration_text(BEGIN_S + END_S + START_S + 300)
    shortest = plan_table(demo, Prices({LAMMPS: longest / 300}), 99)
    assert price_line(shortest).endswith(f"on 99 cores with report: {alone}, {MEASURED}")


def test_long_table_is_cut(tmp_path: Path) -> None:
    path = tmp_path / "many.yaml"
    path.write_text(
        "based_on: tube\nsweep: {keys: {vibration.0.frequency_hz: "
        "{low: 15, high: 100, number: 30}}}",
        encoding="utf-8",
    )
    lines = plan_table(expand(open_study(path)), Prices({LAMMPS: 1e6}), 2).splitlines()
    # Heading, 20 points, how many more, the price.
    assert lines[21] == "... and 10 more points"
    assert lines[22].startswith("30 runs, ")
    assert "  and 18 more" in lines


@pytest.mark.parametrize(
    ("module", "heavy"),
    [
        # scikit-learn and scipy.stats take a second each.
        ("sandmould.execution.simulate", ("sklearn", "scipy.stats", "matplotlib", "snakemake")),
        ("sandmould.execution.jobs", ("sklearn", "scipy.stats", "snakemake")),
        (
            "sandmould.study.plan.announcement",
            ("sklearn", "scipy.stats", "matplotlib", "snakemake"),
        ),
    ],
)
def test_jobs_do_not_wait_for_libraries_of_the_report(module: str, heavy: tuple[str, ...]) -> None:
    # Every run pays for what its processes import.
    says = f"import sys, {module}; print([m for m in {heavy} if m in sys.modules])"
    ran = subprocess.run([sys.executable, "-c", says], capture_output=True, text=True, check=True)
    assert ran.stdout == "[]\n"


@pytest.mark.parametrize(
    ("study", "foreign"),
    [
        ("tube_demo", ("sandmould.casting", "sandmould.engines.driver", "skfem", "matplotlib")),
        ("tank_small", ("sandmould.casting.arpm", "sandmould.engines.driver", "matplotlib")),
        ("plates_small", ("sandmould.casting.mps", "sandmould.engines.driver", "matplotlib")),
    ],
)
def test_a_plan_imports_no_other_kind_and_nothing_that_computes(
    study: str, foreign: tuple[str, ...]
) -> None:
    says = (
        "import sys; from pathlib import Path; "
        "from sandmould.study.plan.build_plan import open_plan; "
        f"open_plan(Path('config/studies/{study}.yaml')); "
        f"print([m for m in {foreign} if m in sys.modules])"
    )
    command = [sys.executable, "-c", says]
    ran = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT)
    assert ran.stdout == "[]\n"


def test_every_name_of_a_run_fits_the_pattern_of_the_workflow(demo: list[Run]) -> None:
    assert all(re.fullmatch(RUN_NAME, run.run) for run in demo)
