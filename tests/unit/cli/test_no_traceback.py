"""Files that cannot be used end every verb and every module in a sentence, never in a traceback."""

from __future__ import annotations

import os
import re
import runpy
import shutil
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from sandmould import ROOT
from sandmould.cli.commands import app
from sandmould.study.plan.build_plan import open_plan
from sandmould.study.plan.plan_files import write_run

CASTING = """\
kind: solidification
material: hirata_2019
objective: {measure: solidification_time_s}
scenario:
  element_m: 0.02
  shapes: [{kind: rectangle, low_m: [0.1, 0.1], high_m: [0.3, 0.3]}]
  box: {low_m: [0, 0], high_m: [0.4, 0.4]}
"""
JUNK = {
    "empty": b"",
    "binary": bytes(range(256)),
    "latin": "title: Größe".encode("latin-1"),
    "utf16": "title: x".encode("utf-16"),
    "list": b"- 1",
    "cut": b"{a: [1, 2",
    "other": b'{"outcome": 99}',
    "table": b"a\tb\n1\n",
}
ENTRY = 'if __name__ == "__main__":\n'
MAINS = [
    path
    for room in ("sandmould", "pattern_fe", "benchmarks")
    for path in sorted((ROOT / room).rglob("*.py"))
    # Programs of peers run in environments of their own; argparse tells how others are called.
    if "peers" not in path.parts
    and ENTRY in (text := path.read_text(encoding="utf-8"))
    and "ArgumentParser" not in text
    and "BENCHMARK" not in text
    # started by the renderer alone, with numbers of its own
    and path.stem != "template_process"
]


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def said(*arguments: str) -> tuple[int, list[str]]:
    """Exit status of a verb and the lines that it says of what is wrong."""
    ran = CliRunner().invoke(app, arguments)
    assert ran.exception is None or isinstance(ran.exception, SystemExit), ran.exception
    return ran.exit_code, ran.stderr.splitlines()


SENTENCE = re.compile(
    "cannot be used: valid is |cannot be read as YAML: |: there is no such file in "
)


@pytest.mark.parametrize("verb", ["plan", "run", "status", "measures", "show", "report"])
def test_a_file_that_is_no_study(verb: str, elsewhere: Path) -> None:
    Path("folder.yaml").mkdir()
    for name, content in JUNK.items():
        Path(f"{name}.yaml").write_bytes(content)
    for name in (*JUNK, "folder", "absent"):
        status, lines = said(verb, f"{name}.yaml")
        assert status == 1
        assert lines
        assert all(SENTENCE.search(line) for line in lines)
        assert re.search(rf"\b{name}(\.yaml)?\b", lines[0])
    assert not Path("results").exists()


@pytest.mark.usefixtures("unmeasured")
def test_results_that_are_damaged(elsewhere: Path) -> None:
    Path("bar.yaml").write_text(CASTING)
    status, (line,) = said("plan", "bar.yaml")
    assert (status, line.startswith("Measuring the speed of this machine, once")) == (0, True)
    (planned,) = open_plan(Path("bar.yaml")).runs
    run = write_run(planned, Path("results", "bar"))
    of_study = [Path("results", "bar", name) for name in ("runs.tsv", "study.yaml", "summary.tsv")]
    of_run = [run / name for name in ("outcome.json", "products.json", "scenario.yaml")]
    (run / "work").mkdir()
    for path in (*of_study, *of_run, run / "work" / "progress.json"):
        before = path.read_bytes() if path.exists() else None
        for name in ("binary", "list", "other", "table"):
            path.write_bytes(JUNK[name])
            assert said("status", "bar.yaml") == (0, [])
            status, lines = said("report", "bar.yaml")
            assert (status, bool(lines)) == (1, True)
            assert said("plan", "bar.yaml") == (0, [])  # written anew where it is the plan's
            path.unlink()
        if before is not None:
            path.write_bytes(before)
    shutil.rmtree("results")
    Path("results").write_text("a file")
    for verb in ("plan", "report"):
        status, (line,) = said(verb, "bar.yaml")
        assert (status, "cannot be used" in line) == (1, True)


def end_of(path: Path, arguments: list[str], monkeypatch: pytest.MonkeyPatch) -> str | int:
    """Run a module as ``python -m`` does; what it ends with."""
    module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
    monkeypatch.setattr(sys, "argv", [str(path), *arguments])
    monkeypatch.delitem(sys.modules, module, raising=False)
    with pytest.raises(SystemExit) as end:
        runpy.run_module(module, run_name="__main__")
    return end.value.code or 0


@pytest.mark.parametrize("path", MAINS, ids=[path.stem for path in MAINS])
def test_a_module_tells_how_it_is_called(
    path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert end_of(path, ["--help"], monkeypatch) == 0
    assert capsys.readouterr().out.startswith("usage: python -m ")
    assert end_of(path, ["one", "two", "three"], monkeypatch) == 2
    assert "usage: python -m " in capsys.readouterr().err


def test_the_process_that_renders_templates_says_that_it_is_started_by_us(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    path = ROOT / "sandmould" / "kinds" / "deck" / "own" / "template_process.py"
    for arguments in ([], ["--help"], ["one", "two", "three"]):
        assert str(end_of(path, arguments, monkeypatch)).startswith("usage: ")


@pytest.mark.parametrize(
    ("based_on", "scene"),
    [
        ("bracket_small", "obstacles: [{kind: mesh, name: a, file: FILE}]"),
        ("plates_small", "shapes: [{kind: image, file: FILE, pixel_m: 0.001}]"),
        ("tube_demo", "pattern: {shape: {kind: file, file: FILE}}"),
    ],
)
def test_a_drawing_that_is_a_device_or_a_pipe(based_on: str, scene: str, elsewhere: Path) -> None:
    """One has no end, the other waits for a writer: neither is opened."""
    os.mkfifo("pipe")
    for file in ("/dev/zero", str(elsewhere / "pipe"), "."):
        text = f"based_on: {based_on}\nscenario: {{{scene.replace('FILE', file)}}}\n"
        Path("drawn.yaml").write_text(text)
        status, lines = said("plan", "drawn.yaml")
        assert status == 1
        assert any("folder or a device" in line for line in lines), lines


@pytest.mark.parametrize("module", ["simulate", "records"])
def test_a_module_tells_of_a_folder_that_it_cannot_use(
    module: str, elsewhere: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (path,) = (path for path in MAINS if path.stem == module)
    Path("folder").mkdir()
    for name, content in JUNK.items():
        Path(name).mkdir()
        Path(name, "scenario.yaml").write_bytes(content)
        Path(f"{name}.yaml").write_bytes(content)
    names = [f"{name}.yaml" if module == "records" else name for name in (*JUNK, "folder")]
    for name in (*names, "absent"):
        arguments = ["record", name] if module == "records" else [name]
        end = end_of(path, arguments, monkeypatch)
        assert isinstance(end, str)
        assert "\n" not in end.strip() or all("cannot be used" in line for line in end.split("\n"))
