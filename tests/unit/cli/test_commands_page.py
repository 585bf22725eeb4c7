"""The page of commands is in step with the command."""

from __future__ import annotations

from sandmould.cli.reference import COMMANDS, commands_page


def test_page_is_in_step_with_the_command() -> None:
    refresh = "run `python -m sandmould.cli.reference` and commit the page"
    assert COMMANDS.read_text(encoding="utf-8") == commands_page(), refresh
    assert "NAME <tube|pocket|part|deck|casting>" in commands_page()
    assert "Example: sandmould compare" in commands_page()
