"""A folder of results belongs to one study file."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from sandmould import ROOT
from sandmould.cli.commands import app
from sandmould.cli.study_file import STUDIES
from sandmould.study.plan.ownership import OWNER_FILE, owner_of, owner_path, owner_text
from tests.finished_study import study_text

FOLDER = Path("results/trial")


@pytest.fixture(autouse=True)
def two_of_one_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for folder, elements_m in (("a", [0.01]), ("b", [0.02])):
        Path(folder).mkdir()
        Path(folder, "trial.yaml").write_text(study_text(elements_m))


def sandmould(*arguments: str) -> Result:
    return CliRunner().invoke(app, arguments)


def test_another_file_of_the_name_is_refused_and_changes_nothing() -> None:
    assert sandmould("plan", "a/trial.yaml").exit_code == 0
    assert owner_of(FOLDER) == "a/trial.yaml"
    assert owner_path(FOLDER) == Path("a/trial.yaml")
    before = {path: path.read_bytes() for path in FOLDER.rglob("*") if path.is_file()}
    for verb in ("plan", "run", "status", "tidy", "report"):
        said = sandmould(verb, "b/trial.yaml")
        assert said.exit_code == 1, verb
        assert said.stderr == (
            "STUDY = 'b/trial.yaml' cannot be used: valid is a study file of another name, since "
            "results/trial belongs to a/trial.yaml; sandmould plan b/trial.yaml --adopt takes it "
            "over.\n"
        )
    assert before == {path: path.read_bytes() for path in FOLDER.rglob("*") if path.is_file()}
    assert sandmould("plan", "a/trial.yaml").exit_code == 0


def test_adopting_takes_the_results_over() -> None:
    sandmould("plan", "a/trial.yaml")
    for row in (FOLDER / "runs.tsv").read_text().splitlines()[1:]:
        (FOLDER / "runs" / row.split("\t")[0]).mkdir(parents=True)
    assert sandmould("plan", "b/trial.yaml", "--adopt").exit_code == 0
    assert owner_of(FOLDER) == "b/trial.yaml"
    assert "0p02" in (FOLDER / "runs.tsv").read_text()
    assert sandmould("status", "a/trial.yaml").exit_code == 1
    # What was begun of the first one is left over, to be tidied.
    assert "3 run folders of " in sandmould("status", "b/trial.yaml").output


def test_a_bad_study_adopts_nothing() -> None:
    sandmould("plan", "a/trial.yaml")
    Path("b/trial.yaml").write_text(study_text().replace("exchange", "exhange"))
    assert sandmould("plan", "b/trial.yaml", "--adopt").exit_code == 1
    assert owner_of(FOLDER) == "a/trial.yaml"


def test_the_file_is_named_as_seen_from_the_working_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    absolute = str(tmp_path / "a" / "trial.yaml")
    assert sandmould("plan", absolute).exit_code == 0
    Path("link.yaml").symlink_to(absolute)
    assert owner_text(Path("link.yaml")) == owner_of(FOLDER) == "a/trial.yaml"
    # Study and results moved together still belong to each other.
    moved = tmp_path / "moved"
    moved.mkdir()
    for name in ("a", "results"):
        shutil.move(name, moved / name)
    monkeypatch.chdir(moved)
    assert sandmould("status", "a/trial.yaml").exit_code == 0
    # A study that was moved takes its results with it: its file is no longer where they say.
    shutil.move("a", "c")
    assert sandmould("plan", "c/trial.yaml").exit_code == 0
    assert owner_of(FOLDER) == "c/trial.yaml"


def test_a_shipped_study_is_the_same_wherever_it_is_installed(tmp_path: Path) -> None:
    assert owner_text(STUDIES / "plates.yaml") == "shipped study plates"
    folder = tmp_path / "results" / "plates"
    folder.mkdir(parents=True)
    (folder / OWNER_FILE).write_text("shipped study plates\n")
    assert owner_path(folder) == STUDIES / "plates.yaml"
    assert (ROOT / "config" / "studies" / "plates.yaml").is_file()


def test_results_without_an_owner_get_the_first_that_comes() -> None:
    sandmould("plan", "a/trial.yaml")
    (FOLDER / OWNER_FILE).unlink()
    assert sandmould("plan", "b/trial.yaml").exit_code == 0
    assert owner_of(FOLDER) == "b/trial.yaml"
