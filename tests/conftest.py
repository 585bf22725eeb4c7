"""Switches of the test suite, and its order."""

from __future__ import annotations

from pathlib import Path

import pytest

LONG = ("verification", "workflow")
"""Folders of the longest tests."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the switch that rewrites golden decks."""
    parser.addoption("--refresh-golden", action="store_true", help="rewrite the golden decks")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with long tests, so that short ones are left for the core that is free first."""

    def turn(item: pytest.Item) -> int:
        folder = item.path.relative_to(Path(__file__).parent).parts[0]
        return LONG.index(folder) if folder in LONG else len(LONG)

    items.sort(key=turn)
