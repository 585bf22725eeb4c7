"""The page of all commands: ``python -m sandmould.cli.reference`` writes ``docs/commands.md``."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from typer.main import get_command

from sandmould import ROOT
from sandmould.cli.commands import app
from sandmould.module_main import run_main

COMMANDS = ROOT / "docs" / "commands.md"
_WIDTH = 100


def commands_page() -> str:
    """Each command with its options, as ``--help`` prints them."""
    return "\n".join(_lines()) + "\n"


def _lines() -> Iterator[str]:
    group: Any = get_command(app)
    yield from (
        "# Commands", "",
        "Written by `make schema` from the code; nothing here is edited by hand.", "",
        "`sandmould COMMAND --help` prints the same. `sandmould --install-completion` lets the "
        "shell complete commands, options, names of shipped studies and paths of keys.", "",
        "| command | does |", "| --- | --- |",
    )  # fmt: skip
    for name, command in group.commands.items():
        yield f"| [`{name}`](#{name}) | {command.help.splitlines()[0]} |"
    for name, command in group.commands.items():
        context = command.make_context(
            f"sandmould {name}", ["--"], resilient_parsing=True, terminal_width=_WIDTH
        )
        text = "\n".join(line.rstrip() for line in command.get_help(context).splitlines())
        yield from ("", f"## {name}", "", "```text", text, "```")


def main() -> None:
    """Write the page."""
    COMMANDS.write_text(commands_page(), encoding="utf-8")


if __name__ == "__main__":
    run_main(main, "python -m sandmould.cli.reference")
