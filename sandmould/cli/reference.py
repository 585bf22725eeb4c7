"""The page of all commands; ``python -m sandmould.cli.reference`` writes all generated pages."""

from __future__ import annotations

from typing import Any

from typer.main import get_command

from sandmould.cli.commands import app
from sandmould.module_main import run_main
from sandmould.reference.reference import DOCS, page, pages

COMMANDS = DOCS / "commands.md"
_WIDTH = 100


def commands_page() -> str:
    """Each command with its options, as ``--help`` prints them."""
    group: Any = get_command(app)
    commands = {}
    for name, command in group.commands.items():
        context = command.make_context(
            f"sandmould {name}", ["--"], resilient_parsing=True, terminal_width=_WIDTH
        )
        text = "\n".join(line.rstrip() for line in command.get_help(context).splitlines())
        commands[name] = (command.help.splitlines()[0], text)
    return page("commands", commands=commands)


def main() -> None:
    """Write the pages."""
    for path, text in {**pages(), COMMANDS: commands_page()}.items():
        path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    run_main(main, "python -m sandmould.cli.reference")
