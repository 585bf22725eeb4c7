"""The command ``sandmould``: verbs, names of studies, and what is said of bad input."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from PIL import Image
from typer.testing import CliRunner, Result

from sandmould.bad_input import BadInputError
from sandmould.cli.commands import app
from sandmould.cli.study_file import STUDIES, shipped_studies, study_file

COARSE = """\
based_on: plates
sweep: {design: list, points: [{exchange: faces, element_m: 0.01, layers: []}]}
reference: {exchange: faces, element_m: 0.01}
"""


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def sandmould(*arguments: str) -> Result:
    return CliRunner().invoke(app, arguments)


@pytest.mark.parametrize("arguments", [[], ["--help"]])
def test_help_lists_the_verbs(arguments: list[str]) -> None:
    said = sandmould(*arguments)
    for verb in ("plan", "run", "status", "show", "report"):
        assert f"\n  {verb} " in said.output
    # Every verb's sentence fits its line.
    assert "..." not in said.output.partition("Commands:")[2]


def test_version() -> None:
    said = sandmould("--version")
    assert (said.exit_code, said.output.split()[0]) == (0, "sandmould")


@pytest.mark.parametrize(
    ("study", "question", "runs"),
    [
        ("plates_small", "How much accuracy do coarse elements lose on four plates", 9),
        # The speed of two engines is measured first.
        pytest.param("tube_demo", "At which frequency does sand", 32, marks=pytest.mark.slow),
    ],
)
def test_plan_of_a_shipped_study_goes_to_the_results_of_this_folder(
    study: str, question: str, runs: int, elsewhere: Path
) -> None:
    said = sandmould("plan", study, "--cores", "3")
    assert said.exit_code == 0, said.output
    assert question in said.output
    assert "Wall time on 3 cores" in said.output
    assert [p.name for p in elsewhere.iterdir()] == ["results"]
    planned = (elsewhere / "results" / study / "runs.tsv").read_text().splitlines()
    assert len(planned) == runs + 1


def test_state_of_a_study_of_the_user(elsewhere: Path) -> None:
    (elsewhere / "coarse.yaml").write_text(COARSE)
    said = sandmould("status", "coarse.yaml")
    assert said.exit_code == 0, said.output
    assert said.output.startswith("coarse: 1 waiting of 1 runs\n")


def test_bad_key_is_one_sentence(elsewhere: Path) -> None:
    (elsewhere / "bad.yaml").write_text(COARSE.replace("exchange:", "exhange:"))
    for verb in ("plan", "run", "status"):
        said = sandmould(verb, "bad.yaml")
        assert said.exit_code == 1
        assert isinstance(said.exception, SystemExit)  # no traceback
        (sentence,) = said.stderr.splitlines()
        assert sentence.startswith("bad.yaml: ")
        assert "exhange" in sentence
        assert said.stdout == ""
    assert not (elsewhere / "results").exists()


def test_unknown_study_gets_the_nearest_names() -> None:
    said = sandmould("plan", "tube_dmo")
    assert said.exit_code == 1
    (sentence,) = said.stderr.splitlines()
    assert sentence.startswith("STUDY = 'tube_dmo' cannot be used: valid is the path of a study's")
    assert "such as tube_demo, " in sentence
    said = sandmould("plan", "no_such_thing_at_all")
    assert f"such as tube_demo; all of them lie in {STUDIES}." in said.stderr


def test_a_file_that_is_not_there_is_said_to_be_missing(elsewhere: Path) -> None:
    said = sandmould("plan", "nothere.yaml")
    assert said.stderr == f"nothere.yaml: there is no such file in {elsewhere}.\n"
    said = sandmould("plan", "tube_dmo.yaml")
    assert f"in {elsewhere} (did you mean the shipped study tube_demo or" in said.stderr


def test_a_study_is_a_file_or_the_name_of_a_shipped_one(elsewhere: Path) -> None:
    mine = elsewhere / "mine.yaml"
    mine.touch()
    assert study_file("mine.yaml") == Path("mine.yaml")
    assert study_file(str(mine)) == mine
    assert study_file("tube_demo") == STUDIES / "tube_demo.yaml"
    assert shipped_studies("plates") == ["plates", "plates_small"]
    for missing in ("mine", "", "../tube_demo", "no/tube_demo.yaml"):
        with pytest.raises(BadInputError, match="tube_demo"):
            study_file(missing)
    with pytest.raises(BadInputError, match=r"study's file, such as mine\.yaml, or the name"):
        study_file("mine")


def test_no_report_without_results(elsewhere: Path) -> None:
    said = sandmould("report", "tube_demo")
    assert said.exit_code == 1
    assert said.stderr == (
        "STUDY = 'tube_demo' cannot be used: valid is a study with results: "
        "sandmould run tube_demo comes first.\n"
    )
    broken = elsewhere / "results" / "tube_demo"
    broken.mkdir(parents=True)
    (broken / "runs.tsv").write_text("run\treplicate\tseed\n")
    said = sandmould("report", "tube_demo")
    assert said.exit_code == 1
    assert isinstance(said.exception, SystemExit)
    assert said.stderr == (
        "results = 'results/tube_demo' cannot be used: valid is a folder with summary.tsv, which "
        "is missing: sandmould run tube_demo writes it.\n"
    )
    (broken / "summary.tsv").write_bytes(b"\x00")
    said = sandmould("report", "tube_demo")
    assert said.exit_code == 1
    assert isinstance(said.exception, SystemExit)
    (sentence,) = said.stderr.splitlines()
    assert sentence.startswith("results = 'results/tube_demo' cannot be used: valid is a folder of")


def test_run_hands_options_on_to_snakemake(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[tuple[Path, list[str]]] = []

    def run_study(path: Path, options: list[str]) -> int:
        calls.append((path, options))
        return 7

    monkeypatch.setattr("sandmould.execution.run_study.run_study", run_study)
    said = sandmould("run", "tube_demo", "--cores", "2", "--", "--quiet", "rules", "host")
    assert said.exit_code == 7
    assert sandmould("run", "tube_demo").exit_code == 7
    file = STUDIES / "tube_demo.yaml"
    assert calls == [(file, ["--cores", "2", "--quiet", "rules", "host"]), (file, [])]


def test_the_quick_demo_says_that_the_installation_works(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from sandmould.execution import run_study

    folder = tmp_path / "results" / "tube_quick"
    folder.mkdir(parents=True)
    (folder / "report.html").write_text("")
    (folder / "verdict.txt").write_text("Use 6 g: there the tube fills best.\n")
    monkeypatch.chdir(tmp_path)
    for status, opening in ((0, "The installation works. Use 6 g"), (1, "Use 6 g")):
        monkeypatch.setattr(run_study, "_snakemake", lambda *_, status=status: status)
        with pytest.raises(SystemExit) as ended:
            app(["demo", "--quick", "--cores", "1"])
        assert ended.value.code == status
        assert capsys.readouterr().out.splitlines()[-1].startswith(opening)


VERBS = (
    *("demo", "new", "show", "plan", "run", "status", "again", "tidy", "report", "compare"),
    *("measures", "keys", "doctor"),
)


def test_every_verb_has_help_with_an_example() -> None:
    verbs = {command.name or command.callback.__name__ for command in app.registered_commands}
    assert set(VERBS) <= verbs
    for verb in verbs:
        said = sandmould(verb, "--help")
        assert said.exit_code == 0
        assert f"Usage: sandmould {verb} " in said.output
        assert f"Example: sandmould {verb}" in said.output


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        ("plan plates_", ["plates_small"]),
        ("compare tube_demo plates_", ["plates_small"]),
        ("keys scenario.vibr", ["scenario.vibration"]),
        ("keys scenario.vibration.0.freq", ["scenario.vibration.0.frequency_hz"]),
        ("keys repl", ["replicates"]),
    ],
)
def test_the_shell_is_offered_studies_and_keys(typed: str, offered: list[str]) -> None:
    words = {
        "_SANDMOULD_COMPLETE": "complete_bash",
        "COMP_WORDS": f"sandmould {typed}",
        "COMP_CWORD": str(len(typed.split())),
    }
    said = CliRunner().invoke(app, [], prog_name="sandmould", env=words)
    assert said.stdout.split() == offered


def test_the_shell_can_be_told_to_complete() -> None:
    assert "--install-completion" in sandmould("--help").output
    said = CliRunner().invoke(
        app, [], prog_name="sandmould", env={"_SANDMOULD_COMPLETE": "source_bash"}
    )
    assert "complete -o default -F" in said.stdout


def test_measures_of_a_study_are_printed() -> None:
    said = sandmould("measures", "tank_small")
    assert said.exit_code == 0, said.output
    assert re.search(r"^h70_sd_pa +Pa +Standard deviation in time", said.stdout, re.MULTILINE)


def test_a_measure_that_no_run_will_have_starts_nothing(elsewhere: Path) -> None:
    (elsewhere / "typo.yaml").write_text("based_on: tube_demo\nobjective: {measure: tube_fil}\n")
    for verb in ("plan", "run", "status"):
        said = sandmould(verb, "typo.yaml")
        assert said.exit_code == 1
        assert "objective.measure = 'tube_fil' cannot be used: valid is a measure" in said.stderr
    assert not (elsewhere / "results").exists()


SMALL_TUBE = """\
based_on: tube_demo
scenario:
  fill: {layers: [{count: 40, repeat: 2}]}
"""


def test_a_scene_is_drawn_and_nothing_starts(elsewhere: Path) -> None:
    (elsewhere / "small.yaml").write_text(SMALL_TUBE)
    said = sandmould("show", "small.yaml")
    assert (said.exit_code, said.stdout) == (0, "small_scene.png\n"), said.output
    assert Image.open("small_scene.png").width > 500
    said = sandmould("show", "small.yaml", "-o", "small.html")
    assert (said.exit_code, said.stdout) == (0, "small.html\n")
    page = Path("small.html").read_text()
    assert "±0.596 mm" in page  # 1.5 g at 25 Hz: 1.5 * 9.80665 / (2 pi 25)^2 m
    assert "80 in layers of 40 and 40" in page
    assert {p.name for p in elsewhere.iterdir()} == {
        "small.yaml", "small.html", "small_scene.png",
    }  # fmt: skip


def test_a_scene_that_lacks_the_measure_asked_for_is_drawn_all_the_same(elsewhere: Path) -> None:
    (elsewhere / "bare.yaml").write_text(f"{SMALL_TUBE}  obstacles: []\n")
    assert sandmould("plan", "bare.yaml").exit_code == 1
    assert sandmould("show", "bare.yaml").exit_code == 0


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("tank_small",), "STUDY = 'tank_small' cannot be used: valid is a study of sand or so"),
        (("tube_demo", "-o", "a.pdf"), "--output = 'a.pdf' cannot be used: valid is a file that"),
        (("tube_demo", "-o", "no/a.png"), "--output = 'no/a.png' cannot be used: valid is a file"),
        (("tube_demo", "--run", "x"), "--run = 'x' cannot be used: valid is a run of tube_demo: f"),
    ],
)
def test_what_cannot_be_drawn_is_one_sentence(
    arguments: tuple[str, ...], sentence: str, elsewhere: Path
) -> None:
    said = sandmould("show", *arguments)
    assert said.exit_code == 1
    (line,) = said.stderr.splitlines()
    assert line.startswith(sentence)
    assert not list(elsewhere.iterdir())
