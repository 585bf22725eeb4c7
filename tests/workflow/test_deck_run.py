"""Decks of the user's own on their engines: to the end, killed and gone on, broken."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import yaml

from sandmould.execution.locks import computing
from sandmould.execution.packs.pack import pack
from sandmould.execution.packs.unpack import unpack
from sandmould.execution.simulate import measure_run, render_run, simulate
from sandmould.kinds.deck.own import computation
from sandmould.runs import claim, progress
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.runs.run_tables import read_costs
from sandmould.study.plan.build_plan import open_plan
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from sandmould.study.plan.plan_files import write_study
from sandmould.study.plan.trust import reading_help
from tests.planned import write_plan

FALLING = """\
{% if restart %}
units si
read_restart {{ restart }}
{% else %}
units si
dimension 2
atom_style sphere
atom_modify map array
boundary f f p
newton off
comm_modify vel yes
region box block 0 0.02 -0.002 0.03 -0.001 0.001 units box
create_box 1 box
lattice sq 0.0022
region sand block 0.001 0.019 0.002 0.014 -0.0005 0.0005 units box
create_atoms 1 region sand
set type 1 diameter 0.002
set type 1 density/disc 2.4
{% endif %}
pair_style granular
pair_coeff * * hooke 1000.0 0.5 tangential linear_history 700.0 0.5 0.3 damping coeff_restitution
fix floor all wall/gran granular hooke 1000.0 0.5 tangential linear_history 700.0 0.5 0.3 &
  damping coeff_restitution yplane 0.0 NULL
fix sides all wall/gran granular hooke 1000.0 0.5 tangential linear_history 700.0 0.5 0.3 &
  damping coeff_restitution xplane 0.0 0.02
fix gravity all gravity {{ gravity_m_s2 }} vector 0 -1 0
fix motion all nve/sphere disc
fix plane all enforce2d
timestep 2e-6
variable height equal xcm(all,y)
thermo_style custom step time v_height
thermo 1000
dump grains all custom 10000 grains.dump id x y
restart 4000 {{ restart_files }}
run {{ number }} upto
"""
FALLING_IN_LIGGGHTS = """\
units si
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
region box block 0 0.02 0 0.02 -0.002 0.03 units box
create_box 1 box
create_atoms 1 single 0.01 0.01 0.01 units box
set group all diameter 0.002 density {{ density_kg_m3 }}
neighbor 0.001 bin
fix young all property/global youngsModulus peratomtype 5e6
fix poisson all property/global poissonsRatio peratomtype 0.45
fix bounce all property/global coefficientRestitution peratomtypepair 1 0.5
fix rub all property/global coefficientFriction peratomtypepair 1 0.3
pair_style gran model hertz tangential history
pair_coeff * *
fix floor all wall/gran model hertz tangential history primitive type 1 zplane 0.0
fix gravity all gravity 9.81 vector 0 0 -1
fix motion all nve/sphere
timestep 1e-5
variable height equal xcm(all,z)
thermo_style custom step time v_height
thermo 100
run 500
"""


def planned(folder: Path, template: str, **scenario: Any) -> Path:
    """Plan and render a study of one run; its folder."""
    (folder / "deck.in.j2").write_text(template)
    study: dict[str, Any] = {"kind": "deck", "scenario": {"template": "deck.in.j2", **scenario}}
    for measure in scenario.get("measures", ()):
        study["objective"] = {"measure": measure}
    (folder / "trial.yaml").write_text(yaml.safe_dump(study))
    (run,) = expand(open_study(folder / "trial.yaml"))
    write_plan([run], folder / "results")
    of_run = folder / "results" / "runs" / run.run
    render_run(of_run)
    return of_run


def compute(folder: Path) -> int:
    """Compute a run as its job does; the exit status."""
    return subprocess.run([*_command(folder)], capture_output=True).returncode


def _command(folder: Path) -> list[str]:
    return [sys.executable, "-m", "sandmould.execution.simulate", str(folder)]


LAMMPS = {
    "values": {"gravity_m_s2": 9.81, "number": 60000},
    "measures": {"height_m": "v_height"},
    "steps": 60000,
}


def test_a_killed_run_goes_on_from_its_restart_file(tmp_path: Path) -> None:
    folder = planned(tmp_path, FALLING, **LAMMPS)
    process = subprocess.Popen(_command(folder), stderr=subprocess.DEVNULL)
    newest, log = folder / "work" / "restart.b", folder / "work" / "engine_1.log"
    deadline = time.monotonic() + 60
    while not (newest.exists() and "\n      8000 " in log.read_text()):
        assert time.monotonic() < deadline
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert not (folder / "outcome.json").exists()
    # The newest may be cut short; then the one before it serves.
    os.truncate(newest, newest.stat().st_size // 2)
    assert compute(folder) == 0
    outcome = RunOutcome.read(folder / "outcome.json")
    assert outcome.outcome is Outcome.FINISHED
    assert "restart.b could not be gone on from" in outcome.detail
    series = pd.read_csv(folder / "series.tsv", sep="\t")
    assert series["log_Step"].tolist() == list(range(0, 60001, 1000))
    assert outcome.simulated_s == series["time_s"].iloc[-1] == 0.12
    # Columns of six discs of 2 mm fall straight down and stand: their middle is at 6 mm, less what
    # the springs give.
    assert 0.00595 < series["log_v_height"].iloc[-1] < 0.006
    cost = read_costs([folder]).rows.iloc[0]
    # Of both attempts: of the first as far as its log tells, or to where the second begins.
    assert 60000 <= cost["steps"] < 120000
    assert (folder / "output" / "grains.dump").is_file()
    assert not (folder / "work").exists()
    measure_run(folder)
    assert "height_m" in pd.read_csv(folder / "measures.tsv", sep="\t")


def test_a_deck_runs_on_liggghts(tmp_path: Path) -> None:
    folder = planned(
        tmp_path, FALLING_IN_LIGGGHTS, engine={"name": "liggghts"},
        values={"density_kg_m3": 2400}, measures={"height_m": "height"},
    )  # fmt: skip
    assert compute(folder) == 0
    outcome = RunOutcome.read(folder / "outcome.json")
    assert outcome.outcome is Outcome.FINISHED, outcome.detail
    measure_run(folder)
    height_m = pd.read_csv(folder / "measures.tsv", sep="\t")["height_m"]
    time_s = 0.005
    # Velocity Verlet is exact in free fall; the log has seven digits.
    assert abs(height_m.iloc[-1] - (0.01 - 9.81 * time_s**2 / 2)) < 1e-8


TWO_FALL = """\
units si
atom_style sphere
boundary p p f
region box block 0 1 0 1 -9 1
create_box 1 box
create_atoms 1 single 0.5 0.5 0.5
create_atoms 1 single 0.5 0.5 0.75
set group all diameter 0.1
set group all density 1000
pair_style none
comm_modify cutoff 0.2
fix gravity all gravity 10 vector 0 0 -1
fix motion all nve/sphere
timestep 1e-3
variable speed equal vcm(all,z)
thermo_style custom step time v_speed
thermo_modify format float %20.12g
thermo 10
dump grains all custom 25 grains.dump id z
run 100
"""


def test_a_run_named_from_here_keeps_its_lock_and_shows_how_far_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = planned(tmp_path, FALLING, **LAMMPS).relative_to(tmp_path)
    monkeypatch.chdir(tmp_path)
    for where, name in ((claim, "BEAT_S"), (computation, "LINE_EVERY_S"),
                        (computation, "FLUSH_EVERY_S"), (progress, "STATE_EVERY_S")):  # fmt: skip
        monkeypatch.setattr(where, name, 0.02)
    with computing(folder):
        assert simulate(folder) == 0
    assert RunOutcome.read(folder / "outcome.json").outcome is Outcome.FINISHED
    assert re.search(r"\d % +deck ", capsys.readouterr().err)


def test_measures_of_a_fall_are_those_worked_out_by_hand(tmp_path: Path) -> None:
    rate = {"of": "v_speed", "take": "rate"}
    top = {"of": "z", "dump": "grains.dump", "grains": "max"}
    worked_out = {
        "speed_m_s": ("v_speed", -1.0),
        # speed falls on a line: its mean is that of the ends of the window
        "late_m_s": ({"of": "v_speed", "take": "mean", "over_last_s": 0.05}, -0.75),
        "mean_m_s": ({"of": "v_speed", "take": "mean"}, -0.5),
        "rate_m_s2": ({**rate, "from_s": 0.02}, -10.0),
        "last_m": ({**top, "take": "last"}, 0.75 - 0.05),
        "low_m": ({**top, "grains": "min"}, 0.5 - 0.05),
        "both_m": ({**top, "grains": "sum"}, 1.25 - 0.1),
        "middle_m": ({**top, "grains": "mean"}, 0.625 - 0.05),
        # from 0.75 - 10 t²/2 at 0.05 s to the same at 0.1 s
        "sinks_m_s": ({**top, "take": "rate", "over_last_s": 0.05}, -(0.05 - 0.0125) / 0.05),
        # three moments, 25 steps apart: 0.05, 0.075 and 0.1 s
        "mean_top_m": (
            {**top, "take": "mean", "over_last_s": 0.05},
            0.75 - (0.0125 / 2 + 0.028125 + 0.05 / 2) / 2,
        ),
    }
    measures = {name: of for name, (of, _) in worked_out.items()}
    folder = planned(tmp_path, TWO_FALL, measures=measures)
    assert simulate(folder) == 0
    measure_run(folder)
    table = pd.read_csv(folder / "measures.tsv", sep="\t")
    exact = {name: value for name, (_, value) in worked_out.items()}
    # a dump of LAMMPS has six digits
    assert table.iloc[-1][list(exact)].to_dict() == pytest.approx(exact, abs=1e-5)
    assert table["rate_m_s2"].isna().sum() == 2  # before 0.02 s


@pytest.mark.parametrize(
    ("of", "told"),
    [
        (
            {"of": "vz", "dump": "grains.dump"},
            "the deck wrote no grains.dump with vz (measures.top_m)",
        ),
        ({"of": "z", "dump": "other.dump"}, "the deck wrote no other.dump with z (measures.top_m)"),
    ],
)
def test_a_dump_that_lacks_a_measure_is_told(tmp_path: Path, of: dict[str, str], told: str) -> None:
    folder = planned(tmp_path, TWO_FALL, measures={"top_m": of})
    assert simulate(folder) == 0
    assert RunOutcome.read(folder / "outcome.json").detail == told


def test_an_error_of_the_engine_is_quoted(tmp_path: Path) -> None:
    lammps = planned(tmp_path, "units si\nbogus {{ a }}\n", values={"a": 1})
    assert compute(lammps) == 0
    outcome = RunOutcome.read(lammps / "outcome.json")
    assert outcome.outcome is Outcome.ENGINE_FAILED
    assert "LAMMPS says: ERROR: Unknown command: bogus 1" in outcome.detail
    liggghts = planned(
        tmp_path, "units si\nbogus {{ a }}\n", values={"a": 2}, engine={"name": "liggghts"}
    )
    assert compute(liggghts) == 0
    assert "LIGGGHTS says: ERROR: Unknown command: bogus 2" in (
        RunOutcome.read(liggghts / "outcome.json").detail
    )


def test_a_log_holds_what_the_engine_said_when_it_died(tmp_path: Path) -> None:
    sphere = "particletemplate/sphere 12 atom_type 1 density constant 1 radius constant 1"
    seeded = FALLING_IN_LIGGGHTS.replace("run 500", f"fix grains all {sphere}")
    folder = planned(tmp_path, seeded, engine={"name": "liggghts"}, values={"density_kg_m3": 2400})
    assert compute(folder) == 0
    assert "a prime number" in (folder / "last_work" / "engine_1.log").read_text()


def test_a_measure_that_the_log_lacks_is_told(tmp_path: Path) -> None:
    few = {**LAMMPS, "values": {"gravity_m_s2": 9.81, "number": 1000}}
    # Behind such a command the text of a deck does not show all that it prints.
    hidden = FALLING.replace("thermo 1000", 'if "1 > 0" then "thermo 1000"')
    folder = planned(tmp_path, hidden, **{**few, "measures": {"speed_m_s": "v_speed"}})
    assert compute(folder) == 0
    outcome = RunOutcome.read(folder / "outcome.json")
    assert outcome.outcome is Outcome.BAD_INPUT
    assert "lacks the column v_speed (measures.speed_m_s): it has Step, Time, v_h" in outcome.detail
    measure_run(folder)  # what there is


def test_a_file_from_outside_is_listed_and_stays_out_of_packs(tmp_path: Path) -> None:
    (tmp_path / "away").mkdir()
    (tmp_path / "away" / "grains.data").write_text("of others")
    scenario = {"template": "deck.in.j2", "files": ["../away/grains.data"]}
    (tmp_path / "here").mkdir()
    (tmp_path / "here" / "deck.in.j2").write_text("units si\n")
    path, results = tmp_path / "here" / "trial.yaml", tmp_path / "results"
    told = {"kind": "deck", "allowed_folders": ["../away"], "scenario": scenario}
    path.write_text(yaml.safe_dump(told))
    plan = open_plan(path, results)
    listed = "../away/grains.data (from outside the study's folder, taken into results)"
    assert listed in reading_help(plan.study, plan.runs)
    write_plan(plan.runs, results / "trial")
    write_study(plan.study.study, results / "trial")
    (folder,) = (results / "trial" / run.place for run in plan.runs)
    render_run(folder)
    assert simulate(folder) == 0
    measure_run(folder)
    copy = f"trial/runs/{folder.name}/output/grains.data"
    for asked in (False, True):
        said = pack(plan, results, tmp_path / "runs.zip", outside_files=asked)
        assert ("../away/grains.data" in said) is not asked
        with zipfile.ZipFile(tmp_path / "runs.zip") as packed:
            assert (copy in packed.namelist()) is asked
    pack(plan, results, tmp_path / "runs.zip")
    unpack(tmp_path / "runs.zip", tmp_path / "elsewhere")
    assert open_plan(path, tmp_path / "elsewhere").lacks(tmp_path / "elsewhere") == {}


def test_a_misspelt_style_is_no_missing_engine(tmp_path: Path) -> None:
    folder = planned(tmp_path, "units si\npair_style blah\n")
    assert simulate(folder) == 0
    outcome = RunOutcome.read(folder / "outcome.json")
    assert outcome.outcome is Outcome.BAD_INPUT
    assert "does not know a style of the deck: its name is misspelt, or" in outcome.detail
    assert "pair_style blah" in outcome.detail
