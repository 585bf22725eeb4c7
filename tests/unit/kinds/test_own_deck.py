"""Decks of the user's own: what is refused before anything starts, and what their logs say."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import yaml

from sandmould.bad_input import BadInputError
from sandmould.kinds.deck.kind import DECK
from sandmould.kinds.deck.own.deck import check_unchanged, render
from sandmould.kinds.deck.own.thermo import read_thermo
from sandmould.report.page import write_report
from sandmould.runs.manifest import save_manifest
from sandmould.runs.outcome import Outcome
from sandmould.scenario.own_deck import OwnDeck
from sandmould.study.collect import collect
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from sandmould.study.plan.plan_files import plan_table, read_run, write_study
from sandmould.study.plan.price import Prices
from tests.planned import write_plan

TEMPLATE = """\
variable a equal {{ angle_deg }}
variable seed equal {{ seed }}
{% if restart %}read_restart {{ restart }}{% endif %}
restart 10 {{ restart_files }}
run {{ number }}
"""
STUDY: dict[str, Any] = {
    "kind": "deck",
    "scenario": {
        "template": "chute.in.j2",
        "values": {"angle_deg": 20, "number": 100},
        "measures": {"speed_m_s": "v_speed"},
        "expected_core_s": 30,
    },
    "sweep": {"keys": {"values.angle_deg": [10, 20]}},
    "replicates": 2,
    "objective": {"measure": "speed_m_s"},
}
LOG = """\
LAMMPS (22 Jul 2025)
run 100
   Step          Time          v_speed
         0   0              0
WARNING: something 3 words long
        50   0.5            1.5
       100   1              2.5
Loop time of 4.0 on 1 procs for 100 steps with 10 atoms

Step 7 of a sentence
"""


def opened(folder: Path, text: str = TEMPLATE, /, **scenario: Any) -> Path:
    """Write a template and a study of it."""
    (folder / "chute.in.j2").write_text(text)
    study = {**STUDY, "scenario": {**STUDY["scenario"], **scenario}}
    path = folder / "trial.yaml"
    path.write_text(yaml.safe_dump(study))
    return path


def test_every_point_gets_its_deck(tmp_path: Path) -> None:
    runs = expand(open_study(opened(tmp_path)))
    assert len(runs) == 4
    text = render(runs[-1].scenario, "r", "s", "../restart.b")
    assert "variable a equal 20" in text
    assert "read_restart ../restart.b" in text
    assert "restart 10 ../restart.a ../restart.b" in text
    assert "read_restart" not in render(runs[0].scenario, "r", "s")
    assert runs[0].run.startswith("angle_deg_10_r1_")


def test_replicates_need_a_seed_in_the_template(tmp_path: Path) -> None:
    path = opened(tmp_path, TEMPLATE.replace("{{ seed }}", "7"))
    told = r"replicates = 2 cannot be used: valid is 1, since the template has no {{ seed }}"
    with pytest.raises(BadInputError, match=told):
        expand(open_study(path))


@pytest.mark.parametrize(
    ("template", "scenario", "told"),
    [
        (
            TEMPLATE,
            {"template": "other.in.j2"},
            r"scenario.template = 'other.in.j2' .* is there",
        ),
        (TEMPLATE, {"files": ["grains.data"]}, r"scenario.files = 'grains.data' .* that is there"),
        (TEMPLATE + "{{ friction }}", {}, r"'friction' is undefined\); it is given angle_deg, n"),
        ("{% if %}", {}, r"template that renders \(line 1: "),
        (TEMPLATE + "{% include 'other' %}", {}, "no loader"),
        (
            "{{ seed | first_prime }}",
            {},
            r"\(line 1: No filter named 'first_prime'\.\); it is given",
        ),
        (
            TEMPLATE,
            {"values": {"angle_deg": 20, "number": 1, "anlge": 3}},
            r"scenario.values.anlge = 3 .* uses: angle_deg, number",
        ),
        (
            TEMPLATE,
            {"values": {"angle_deg": 20, "number": 1, "seed": 3}},
            "scenario.values.seed = 3 cannot be used: valid is another name",
        ),
        (
            TEMPLATE,
            {"engine": {"name": "liggghts", "ranks": 2}},
            r"scenario.engine.ranks = 2 .* 1 on engine liggghts",
        ),
        (TEMPLATE, {"engine": {"name": "reference"}}, "one of 'lammps' or 'liggghts'"),
        (TEMPLATE, {"box": {}}, "one of the keys engine, expected_core_s, files"),
        (TEMPLATE, {"files": ["sub/chute.in.j2"]}, "files of different names"),
    ],
)
def test_what_cannot_run_is_told_in_one_sentence(
    tmp_path: Path, template: str, scenario: dict[str, Any], told: str
) -> None:
    if scenario.get("files") == ["sub/chute.in.j2"]:
        (tmp_path / "sub").mkdir()
        (tmp_path / "sub" / "chute.in.j2").touch()
    with pytest.raises(BadInputError, match=told):
        expand(open_study(opened(tmp_path, template, **scenario)))


@pytest.mark.parametrize(
    ("of", "told"),
    [
        ({"take": "mean"}, ".of = None cannot be used: valid is a value"),
        ({"of": "KinEng", "take": "median"}, ".take = 'median' .* one of 'last', 'mean' or 'rate'"),
        (
            {"of": "KinEng", "from_s": 1},
            "valid is take: mean or take: rate with one of over_last_s",
        ),
        ({"of": "y", "dump": "../a.dump"}, r".dump = '../a.dump' cannot be used"),
        (3, "speed_m_s = 3 cannot be used: valid is text or a mapping of keys to values"),
    ],
)
def test_what_no_measure_is_taken_from_is_told(tmp_path: Path, of: Any, told: str) -> None:
    with pytest.raises(BadInputError, match=told) as error:
        open_study(opened(tmp_path, measures={"speed_m_s": of}))
    assert len(error.value.problems) == 1


def test_a_deck_without_objective_is_asked_for_one(tmp_path: Path) -> None:
    path = opened(tmp_path, measures={"speed_m_s": "v_speed", "height_m": "v_height"})
    path.write_text(yaml.safe_dump(yaml.safe_load(path.read_text()) | {"objective": {}}))
    with pytest.raises(BadInputError) as told:
        expand(open_study(path))
    assert str(told.value) == (
        f"{path}: state an objective, such as objective: {{measure: height_m}}: this study "
        "measures height_m and speed_m_s."
    )


PRINTS = TEMPLATE + "thermo_style custom step time v_speed &\n  v_height # v_width\n"


@pytest.mark.parametrize(
    ("template", "measure", "told"),
    [
        (PRINTS, "v_height", ""),
        (
            PRINTS,
            "v_width",
            "scenario.measures.speed_m_s = 'v_width' cannot be used: valid is a column that the "
            "deck prints: step, time, v_speed, v_height.",
        ),
        (
            PRINTS + 'if "$(step) < 5" then "run 5" else "run 4"\njump SELF\n',
            "v_width",
            "scenario.measures.speed_m_s = 'v_width' cannot be used",
        ),
        (
            PRINTS.replace(" time", ""),
            "v_speed",
            "a deck that prints the time: thermo_style custom step time",
        ),
        (
            PRINTS.replace("v_speed", "ke"),
            "ke",
            "measures.speed_m_s = 'ke' cannot be used: valid is its heading, KinEng",
        ),
        # What an engine names itself, and what the text of a deck does not show, a run tells.
        (PRINTS, "KinEng", ""),
        (PRINTS.replace("v_speed", "${what}"), "v_speed", ""),
        (PRINTS + "include more.in\n", "v_width", ""),
        (PRINTS + 'if "$(step) < 5" then "jump more.in"\n', "v_width", ""),
        (PRINTS + 'if "$(step) < 5" then "thermo_style custom step time v_width"\n', "v_width", ""),
        (PRINTS + "thermo_modify colname v_height v_width\n", "v_width", ""),
    ],
)
def test_a_column_that_a_deck_does_not_print_is_told_before_any_run(
    tmp_path: Path, template: str, measure: str, told: str
) -> None:
    path = opened(tmp_path, template, measures={"speed_m_s": measure})
    if not told:
        assert len(expand(open_study(path))) == 4
        return
    with pytest.raises(BadInputError, match=told.replace("(", r"\(")):
        expand(open_study(path))


@pytest.mark.parametrize(
    "section",
    [
        {"material": "rojek_2004"},
        {"certificate": {"controls": ["hold"]}},
        {"cross_check": {"engine": "liggghts", "at": {"values.angle_deg": 10}}},
    ],
)
def test_sections_of_sand_are_refused(tmp_path: Path, section: dict[str, Any]) -> None:
    path = opened(tmp_path)
    path.write_text(yaml.safe_dump(yaml.safe_load(path.read_text()) | section))
    name = next(iter(section))
    with pytest.raises(BadInputError, match=f"{name} = .* valid is absent: "):
        open_study(path)


def test_a_changed_deck_is_another_run_and_stops_a_planned_one(tmp_path: Path) -> None:
    before = expand(open_study(opened(tmp_path)))[0]
    after = expand(open_study(opened(tmp_path, TEMPLATE + "run 1\n")))[0]
    assert before.run != after.run
    check_unchanged(after.scenario)
    with pytest.raises(BadInputError, match="plan the study again"):
        check_unchanged(before.scenario)


@pytest.mark.parametrize(
    ("was", "is_now", "same"),
    [
        ("run {{", "# a comment\n\n{# another #}run {{", True),
        # each of these may be read by an engine
        ("run {{", "run & \n# a comment\n {{", False),
        ("run {{", "# a comment &\nrun {{", False),
        ("run {{", 'print """\n# no comment\n"""\nrun {{', False),
        # what a run does that goes on counts as well
        ("read_restart", "read_restart ./", False),
    ],
)
def test_comments_of_a_deck_count_where_they_may_be_commands(
    tmp_path: Path, was: str, is_now: str, same: bool
) -> None:
    runs = [expand(open_study(opened(tmp_path, TEMPLATE)))]
    runs.append(expand(open_study(opened(tmp_path, TEMPLATE.replace(was, is_now)))))
    assert (runs[0] == runs[1]) is same


def test_the_plan_is_read_back_and_priced(tmp_path: Path) -> None:
    study = open_study(opened(tmp_path))
    runs = expand(study)
    write_plan(runs, tmp_path / "results")
    back = read_run(tmp_path / "results" / "runs" / runs[0].run / "scenario.yaml")
    assert back == runs[0]
    assert isinstance(back.scenario, OwnDeck)
    lines = plan_table(runs, Prices({("lammps", 0): 3.0}), 2).splitlines()
    assert lines[1].endswith(" 10 s")
    # what is used: 30 at three a second, not the 30 that the user expects
    assert lines[1].split()[-3:] == ["10", "10", "s"]
    assert lines[-1].startswith("4 runs, 40 core-seconds. Wall time on 2 cores with report: ")


def test_a_log_is_read_past_warnings(tmp_path: Path) -> None:
    (tmp_path / "one.log").write_text(LOG)
    thermo = read_thermo([tmp_path / "one.log"])
    assert thermo.table["v_speed"].tolist() == [0.0, 1.5, 2.5]
    assert (thermo.steps, thermo.grains, thermo.grain_steps, thermo.loop_s) == (100, 10, 1e3, 4.0)


def test_a_run_that_went_on_has_each_step_once(tmp_path: Path) -> None:
    (tmp_path / "one.log").write_text(LOG.split("Loop")[0])
    (tmp_path / "two.log").write_text(
        "  Step Time v_speed\n 50 0.5 1.6\n 150 1.5 3\n"
        "Loop time of 2.0 on 1 procs for 100 steps with 10 atoms\n"
    )
    thermo = read_thermo([tmp_path / "one.log", tmp_path / "two.log"])
    assert thermo.table["Step"].tolist() == [0, 50, 150]
    assert thermo.table["v_speed"].tolist() == [0, 1.6, 3]


def test_an_attempt_counts_at_least_to_where_the_next_one_begins(tmp_path: Path) -> None:
    (tmp_path / "one.log").write_text("Step Time\n 0 0.0\n 50 0.5\n")
    two = "Step Time\n {} 0.7\n 150 1.5\nLoop time of 2.0 on 1 procs for {} steps with 10 atoms\n"
    for begins, steps in ((70, 150), (30, 170)):
        (tmp_path / "two.log").write_text(two.format(begins, 150 - begins))
        assert read_thermo([tmp_path / "one.log", tmp_path / "two.log"]).steps == steps


@pytest.mark.parametrize("step", ["1e999", "nan"])
def test_a_row_whose_step_is_no_number_is_passed_over(step: str, tmp_path: Path) -> None:
    (tmp_path / "one.log").write_text(f"Step Time\n 0 0.0\n {step} 0.5\n 50 0.5\n")
    assert read_thermo([tmp_path / "one.log"]).table["Step"].tolist() == [0, 50]


def test_a_log_without_a_table_is_empty(tmp_path: Path) -> None:
    (tmp_path / "one.log").write_text("ERROR: something\n")
    assert read_thermo([tmp_path / "one.log"]).table.empty


def test_runs_are_collected_and_reported(tmp_path: Path) -> None:
    study = open_study(opened(tmp_path))
    runs = expand(study)
    folder = tmp_path / "results"
    write_plan(runs, folder)
    write_study(study.study, folder)
    for run in runs:
        angle_deg = run.parameters["values.angle_deg"]
        speed = angle_deg / 10 + 0.0001 * angle_deg * run.replicate
        of_run = folder / "runs" / run.run
        pd.DataFrame({"time_s": [0.0, 1.0], "log_v_speed": [0.0, speed]}).to_csv(
            of_run / "series.tsv", sep="\t", index=False
        )
        (of_run / "outcome.json").write_text(
            '{"code": 0, "detail": "gone on from restart.a at step 5", "simulated_s": 1.0, '
            '"planned_s": 0.0}'
        )
        cost = {"engine": "lammps", "version": "1", "ranks": 1, "cpu_s": 9.0}
        save_manifest(of_run, {"cost": cost})
        DECK.execution.measure(run, of_run)
        DECK.execution.export(run, of_run)
        assert (of_run / "final.png").stat().st_size > 5000
    collect(folder)
    summary = pd.read_csv(folder / "summary.tsv", sep="\t")
    assert summary["speed_m_s"].tolist() == pytest.approx([1.001, 1.002, 2.002, 2.004])
    write_report(folder, folder / "report.html")
    page = (folder / "report.html").read_text()
    assert "Of the two, 20 ° gives the larger speed, " in page
    assert "speed from v_speed" in page
    assert "Runs gone on with from a restart file after a kill: 4." in page
    assert (folder / "figures" / "curves.svg").exists()
    assert "vibration" not in page.split("<style>")[0] + page.split("</style>")[1]


ONE_GRAIN = """\
# seed {{ seed }}
units si
{% if restart %}
read_restart {{ restart }}
{% else %}
atom_style sphere
region box block 0 1 0 1 0 1
create_box 1 box
create_atoms 1 single 0.5 0.5 0.5
{% endif %}
pair_style zero 0.1
pair_coeff * *
variable speed equal vcm(all,x)
thermo_style custom step time v_speed
restart 10 {{ restart_files }}
run {{ number }} {{ 'upto' if angle_deg > 10 else '' }}
"""


def test_a_deck_that_goes_on_too_far_has_failed(tmp_path: Path) -> None:
    runs = expand(open_study(opened(tmp_path, ONE_GRAIN, steps=100)))
    for run in (runs[0], runs[-1]):
        folder = tmp_path / "runs" / run.run
        ended = DECK.execution.compute(run, folder).outcome
        assert (ended.outcome, ended.detail) == (Outcome.FINISHED, "")
        # restart.b holds step 100: what is left to do is nothing, or 100 steps for `run 100`
        ended = DECK.execution.compute(run, folder).outcome
        if run is runs[-1]:
            assert ended.outcome is Outcome.FINISHED
        else:
            assert ended.outcome is Outcome.BAD_INPUT
            assert ended.detail == (
                "the deck ended at step 200, not at steps = 100: after a restart write run 100 "
                "upto; gone on from restart.b at step 100"
            )


def test_what_a_killed_attempt_took_counts(tmp_path: Path) -> None:
    run = expand(open_study(opened(tmp_path, ONE_GRAIN, steps=100)))[-1]
    folder = tmp_path / "runs" / run.run
    first = DECK.execution.compute(run, folder).cost
    assert first.steps == 100
    # killed near its end: the log breaks off, and restart.a holds step 90
    log = folder / "work" / "engine_1.log"
    log.write_text(log.read_text().partition("Loop time")[0])
    (folder / "work" / "restart.b").unlink()
    (folder / "work" / "spent.json").write_text('{"wall_s": 50.0, "cpu_s": 40.0}')
    second = DECK.execution.compute(run, folder)
    assert second.outcome.outcome is Outcome.FINISHED
    assert second.cost.steps == 110
    assert 40.0 <= second.cost.cpu_s < 50.0 < second.cost.wall_s
    # what began anew is judged by its own steps
    for restart in (folder / "work").glob("restart.*"):
        restart.unlink()
    third = DECK.execution.compute(run, folder)
    assert (third.outcome.outcome, third.cost.steps) == (Outcome.FINISHED, 210)


def test_a_deck_that_ends_elsewhere_has_failed(tmp_path: Path) -> None:
    anew = ONE_GRAIN + "reset_timestep 0\nrun 50\n"
    for text, steps, said in (
        (ONE_GRAIN, 90, "the deck ended at step 100, not at steps = 90: state the steps that the "
         "deck runs, or none"),
        (anew, 150, ""),
    ):  # fmt: skip
        run = expand(open_study(opened(tmp_path, text, steps=steps)))[-1]
        folder = tmp_path / f"of_{steps}" / "runs" / run.run
        assert DECK.execution.compute(run, folder).outcome.detail == said
