"""What the pages tell a person to write plans, and the command has the options that they show."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import typer.main
import yaml

from sandmould import ROOT
from sandmould.bad_input import BadInputError
from sandmould.cli.commands import app
from sandmould.execution.cluster.settings import read_cluster
from sandmould.study.plan.build_plan import open_plan
from tests.workflow.pages import BLOCK, PAGES, blocks

INLINE = re.compile(r"`(sandmould [^`]+)`")
STUDY_KEYS = {"based_on", "scenario", "kind"}


def pages_with(note: str = "", language: str = "", titled: bool = False) -> list[str]:
    """Pages that have such a block."""
    return [
        page
        for page in PAGES
        if any(
            block.note == note and block.language == language and bool(block.title) == titled
            for block in blocks(page)
        )
    ]


@pytest.mark.parametrize("page", pages_with(language="yaml", titled=True))
def test_files_that_a_page_has_written_are_sound(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    written = [block for block in blocks(page) if block.title]
    for block in written:
        Path(block.title).write_text(block.text, encoding="utf-8")
    for block in written:
        if block.language == "python":
            subprocess.run([sys.executable, block.title], check=True)
    for block in written:
        if block.title == "cluster.yaml":
            assert read_cluster().partition
        elif block.language == "yaml":
            assert open_plan(Path(block.title)).runs


@pytest.mark.parametrize("page", pages_with("with", "yaml"))
def test_parts_of_a_study_plan_with_the_study_that_they_are_put_into(
    page: str, tmp_path: Path
) -> None:
    parts = [block for block in blocks(page) if block.note == "with"]
    for number, block in enumerate(parts):
        study = tmp_path / f"part_{number}.yaml"
        study.write_text(f"based_on: {block.noted}\n{block.text}", encoding="utf-8")
        assert open_plan(study).runs, block.text


@pytest.mark.parametrize("page", pages_with("file", "yaml"))
def test_shipped_files_are_shown_as_they_are(page: str) -> None:
    for block in blocks(page):
        if block.note == "file":
            assert block.text == (ROOT / block.noted).read_text(encoding="utf-8")


def test_other_yaml_is_yaml_and_whole_studies_plan(tmp_path: Path) -> None:
    planned = []
    for page in PAGES:
        for block in blocks(page):
            if block.language != "yaml" or block.note or block.title:
                continue
            values = yaml.safe_load(block.text)
            if STUDY_KEYS & values.keys() and "based_on" in values:
                study = tmp_path / f"study_{len(planned)}.yaml"
                study.write_text(block.text, encoding="utf-8")
                assert open_plan(study).runs, page
                planned.append(page)
    assert len(planned) >= 1


def test_the_refusal_that_a_tutorial_shows_is_that_of_today(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    found = blocks("docs/tutorials/first_study.md")
    (study,) = (block for block in found if block.title)
    (shown,) = (block.text for block in found if "cannot be used" in block.text)
    text = study.text.replace("acceleration_g: 1.5,", "acceleration_g: 1.5 g,")
    Path(study.title).write_text(text, encoding="utf-8")
    with pytest.raises(BadInputError) as refused:
        open_plan(Path(study.title))
    assert f"{refused.value}\n" == shown


def commands(page: str) -> list[str]:
    """Calls of the command that a page shows, in blocks and within sentences."""
    text = (ROOT / page).read_text(encoding="utf-8")
    shown = [
        line.strip()
        for block in blocks(page)
        if block.language == "sh"
        for line in block.text.splitlines()
    ]
    shown = [re.sub(r"^(\.venv/bin/|~/sandmould-env/bin/)", "", line) for line in shown]
    typed = [line for line in shown if line.startswith("sandmould ")]
    return typed + INLINE.findall(BLOCK.sub("", text))


@pytest.mark.parametrize("page", [page for page in PAGES if commands(page)])
def test_commands_have_these_options(page: str) -> None:
    for line in commands(page):
        refused = why_refused(shlex.split(line.replace("...", ""), comments=True)[1:])
        assert not refused, f"{page}: {line}: {refused}"


def why_refused(arguments: list[str]) -> str:
    """What the command has against its arguments, as far as that can be told without files."""
    top: Any = typer.main.get_command(app)
    if arguments and arguments[0].startswith("-"):
        known = {name for option in top.params for name in option.opts} | {"--help"}
        return "" if arguments[0] in known else "no such option"
    command = top.commands.get(arguments[0]) if arguments else None
    if command is None:
        return "" if arguments == ["COMMAND", "--help"] else "no such command"
    try:
        _, left, _ = command.make_parser(typer.Context(command)).parse_args([*arguments[1:]])
    except Exception as error:  # the class of the command line's own library, which is private
        return str(error)
    return f"{left} is too much" if left else ""


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("pln my.yaml", "no such command"),
        ("plan my.yaml --core 2", "No such option: --core"),
        ("plan my.yaml other.yaml", "too much"),
        ("--versio", "no such option"),
    ],
)
def test_a_wrong_command_would_be_found(line: str, said: str) -> None:
    assert said in why_refused(line.split())
