"""Switches of the test suite."""

from __future__ import annotations

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the switch that rewrites golden decks."""
    parser.addoption("--refresh-golden", action="store_true", help="rewrite the golden decks")
