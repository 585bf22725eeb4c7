"""Write ``docs/developers/architecture.md`` and its picture: ``make architecture``.

With ``--before COMMIT``, the rooms of an earlier commit are counted and kept for the page.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from benchmarks.frame.page import render
from benchmarks.house.picture import draw_house
from benchmarks.house.rooms import House, Room, read_house, rooms_at
from sandmould import ROOT

PAGE = ROOT / "docs" / "developers" / "architecture.md"
PICTURE = "architecture.svg"
BEFORE = Path(__file__).with_name("rooms_before.json")
"""Rooms at the commit before they were built anew; a shallow clone does not have it."""
CHANGES = Path(__file__).with_name("changes.json")
"""Files that a change touched, measured on trial branches."""


@dataclass(frozen=True)
class Change:
    """What one addition costs in files."""

    change: str
    """Such as 'a measure in the report'."""
    before: str
    """What it took before, in words."""
    after: tuple[str, ...]
    """Files written by hand, as a trial had them; none before it was measured."""


def page_text(house: House, before: dict[str, Any], changes: Sequence[Change]) -> str:
    """Write the page.

    Parameters
    ----------
    house : House
    before : dict
        The ``commit`` and its ``rooms``, as ``BEFORE`` holds them.
    changes : sequence of Change
    """
    earlier = {room["name"]: Room(**room) for room in before["rooms"]}
    values = {
        "house": house,
        "names": [name for floor in house.floors for name in floor],
        "earlier": earlier,
        "commit": before["commit"],
        "changes": changes,
        "picture": PICTURE,
    }
    return render(Path(__file__).with_name("architecture.md.j2"), values)


def read_changes(path: Path = CHANGES) -> list[Change]:
    """Read what changes cost.

    Raises
    ------
    OSError, ValueError
        When the file cannot be read.
    """
    trees = json.loads(path.read_text(encoding="utf-8"))
    return [Change(tree["change"], tree["before"], tuple(tree["after"])) for tree in trees]


def write_before(commit: str, path: Path = BEFORE) -> None:
    """Count the rooms at a commit of this clone and keep them."""
    rooms = [asdict(room) for room in rooms_at(ROOT, commit).values()]
    text = json.dumps({"commit": commit, "rooms": rooms}, indent=1)
    path.write_text(text + "\n", encoding="utf-8")


def main(arguments: Sequence[str] | None = None, page: Path = PAGE) -> int:
    """Write the page and its picture; status 1 where an import runs up."""
    parser = argparse.ArgumentParser(description="Write architecture.md and its picture.")
    parser.add_argument("--before", metavar="COMMIT", help="count the rooms at COMMIT for the page")
    commit = parser.parse_args(arguments).before
    if commit:
        write_before(commit)
    house = read_house(ROOT)
    before = json.loads(BEFORE.read_text(encoding="utf-8"))
    page.write_text(page_text(house, before, read_changes()), encoding="utf-8")
    draw_house(house, page.with_name(PICTURE))
    print(page.relative_to(ROOT) if page.is_relative_to(ROOT) else page)
    for upper, lower in house.upward:
        print(f"{upper} imports {lower}, which does not lie below it", file=sys.stderr)
    return 1 if house.upward else 0


if __name__ == "__main__":
    sys.exit(main())
