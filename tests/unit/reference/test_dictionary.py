"""Studies that code gives as dictionaries: checked first, then written, then computed."""

from __future__ import annotations

import os
import subprocess
import sys
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import sandmould
from sandmould import BadInputError
from sandmould.reference.dictionary import WRITTEN_LINE

FREQUENCY = "vibration.0.frequency_hz"
STUDY: dict[str, Any] = {
    "based_on": "tube_quick",
    "sweep": {"keys": {FREQUENCY: [25, 50]}},
    "replicates": 1,
}


@pytest.fixture(autouse=True)
def _alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def ends_with(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Have the command do nothing but end with a status, or by a signal."""

    def end(code: str) -> None:
        class Command(subprocess.Popen[str]):
            def __init__(self, command: list[str], **options: Any) -> None:
                super().__init__([sys.executable, "-c", code], **options)

        monkeypatch.setattr("sandmould.notebook.subprocess.Popen", Command)

    return end


def _with_verdict(name: str, folder: Path = Path()) -> None:
    path = folder / "results" / name / "verdict.txt"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("An old answer.\n")


def test_nothing_is_written_before_it_is_checked() -> None:
    with pytest.raises(BadInputError, match=r"replicate = 2 .* \(did you mean replicates"):
        sandmould.run(STUDY | {"replicate": 2}, name="mine")
    assert list(Path().iterdir()) == []


def test_a_changed_dictionary_goes_on_with_its_study(ends_with: Any) -> None:
    ends_with("print('as if')")
    _with_verdict("mine")
    for replicates in (1, 3):
        sandmould.run(STUDY | {"replicates": replicates}, name="mine", quiet=True)
        text = Path("mine.yaml").read_text()
        assert text.startswith(f"{WRITTEN_LINE}\n")
        assert yaml.safe_load(text)["replicates"] == replicates


def test_a_file_written_by_hand_is_never_replaced(ends_with: Any) -> None:
    ends_with("")
    _with_verdict("mine")
    text = f"# mine\n{yaml.safe_dump(STUDY)}"
    Path("mine.yaml").write_text(text)
    sandmould.run(STUDY, name="mine")  # the same study
    with pytest.raises(BadInputError, match=r"mine.yaml holds another study, and it was not wri"):
        sandmould.run(STUDY | {"replicates": 3}, name="mine")
    assert Path("mine.yaml").read_text() == text


def test_numbers_of_numpy_are_numbers() -> None:
    plain = sandmould.plan(STUDY | {"replicates": 2})
    keys = {FREQUENCY: np.array([25.0, 50.0])}
    given = STUDY | {"replicates": np.int64(2), "sweep": {"keys": keys}}
    assert list(sandmould.plan(given)["run"]) == list(plain["run"])
    keys = {FREQUENCY: [np.float64(25), np.int32(50)]}
    assert list(sandmould.plan(given | {"sweep": {"keys": keys}})["run"]) == list(plain["run"])


@pytest.mark.parametrize(
    ("study", "said"),
    [
        ({"sweep": {"keys": {"fill": {25, 50}}}}, r"sweep.keys.fill = {.*} .* a list or a dictio"),
        ({"title": date(2024, 1, 2)}, r"title = datetime.date\(2024, 1, 2\) .* text, true or fal"),
        ({"scenario": {5: 1}}, "scenario = 5 .* text as the name of a key"),
        (5, "study = 5 cannot be used: valid is the name of a shipped study, the path"),
        (None, "study = None cannot be used: .* or a dictionary"),
    ],
)
def test_what_no_file_can_hold_is_told(study: Any, said: str) -> None:
    with pytest.raises(BadInputError, match=said) as caught:
        sandmould.plan(study)
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize(
    ("code", "said"),
    [
        ("import os; os.kill(os.getpid(), 9)", "stopped by signal 9"),
        ("print('no room'); raise SystemExit(78)", "no room"),
        ("print('broken'); raise SystemExit(1)", "broken"),
    ],
)
def test_an_old_answer_is_no_answer_of_a_broken_study(ends_with: Any, code: str, said: str) -> None:
    ends_with(code)
    _with_verdict("mine")
    with pytest.raises(RuntimeError, match=rf"mine did not end \({said}\). Call it again"):
        sandmould.run(STUDY, name="mine")


def test_an_interrupt_ends_the_command(ends_with: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    ends_with("import os, time; print(os.getpid(), flush=True); time.sleep(600)")
    seen: list[int] = []

    def interrupt(line: str, **options: Any) -> None:
        seen.append(int(line))
        raise KeyboardInterrupt

    monkeypatch.setattr("builtins.print", interrupt)
    with pytest.raises(KeyboardInterrupt):
        sandmould.run(STUDY, name="mine")
    (pid,) = seen
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_results_go_where_they_are_asked(ends_with: Any) -> None:
    ends_with("import os; print(os.getcwd())")
    there = Path("there")
    with pytest.raises(BadInputError, match=r"folder = .*there.* a folder that is there"):
        sandmould.run(STUDY, name="mine", folder=there)
    there.mkdir()
    _with_verdict("mine", there)
    result = sandmould.run(STUDY, name="mine", folder=there)
    assert result.folder == there.absolute() / "results" / "mine"
    assert result.verdict == "An old answer."
    assert (there / "mine.yaml").is_file()
    assert not Path("mine.yaml").exists()


@pytest.mark.usefixtures("unmeasured")
def test_a_plan_is_a_table_with_units() -> None:
    table = sandmould.plan(STUDY | {"replicates": 2}, cores=2)
    ofsweep = table[table["part"] == "sweep"]
    assert list(ofsweep[FREQUENCY]) == [25.0, 25.0, 50.0, 50.0]
    assert (ofsweep[["grain_steps", "wall_time_s"]] > 0.0).all(axis=None)
    assert table.attrs["wall_time_s"] > table["wall_time_s"].max()
    assert table.attrs["price"] == "an estimate"
    assert list(Path().iterdir()) == []


def test_the_package_shows_what_it_has_and_loads_none_of_it() -> None:
    code = (
        "import sys, sandmould\n"
        "print({'BadInputError', 'Result', '__version__', 'plan', 'run'} - {*dir(sandmould)},"
        " {'pandas', 'yaml', 'pydantic'} & {*sys.modules}, sandmould.__version__[0])"
    )
    environment = os.environ | {"PYTHONPATH": str(sandmould.ROOT)}
    ran = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment
    )
    assert ran.stdout == "set() set() 0\n"
    assert (sandmould.ROOT / "sandmould" / "py.typed").is_file()
