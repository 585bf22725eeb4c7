"""Switches of the test suite, and its order."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import pytest

from sandmould.kernel_cache import cache_folder, is_own

KERNELS = cache_folder()
"""Compiled once for all tests."""
is_own(KERNELS)
CACHES = tempfile.TemporaryDirectory(prefix="caches_")
LONG = ("verification", "workflow")
"""Folders of the longest tests."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the switch that rewrites golden decks."""
    parser.addoption("--refresh-golden", action="store_true", help="rewrite the golden decks")


def _cache() -> str:
    """An empty folder for what is kept in the user's cache, but for compiled kernels."""
    folder = Path(tempfile.mkdtemp(dir=CACHES.name))
    (folder / "sandmould").mkdir()
    (folder / "sandmould" / KERNELS.name).symlink_to(KERNELS)
    return str(folder)


os.environ["XDG_CACHE_HOME"] = _cache()


@pytest.fixture
def unmeasured(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine whose speed is not known; other tests measure it once for all."""
    monkeypatch.setenv("XDG_CACHE_HOME", _cache())


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with long tests, so that short ones are left for the core that is free first."""

    def turn(item: pytest.Item) -> int:
        folder = item.path.relative_to(Path(__file__).parent).parts[0]
        return LONG.index(folder) if folder in LONG else len(LONG)

    items.sort(key=turn)
