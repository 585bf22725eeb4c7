"""Write ``docs/architecture.md`` and its picture: ``python -m benchmarks.house.architecture``.

With ``--before COMMIT``, the rooms of an earlier commit are counted and kept for the page.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from benchmarks.frame.page import render
from benchmarks.house.picture import draw_house
from benchmarks.house.rooms import House, Room, read_house, rooms_at
from sandmould import ROOT

PAGE = ROOT / "docs" / "architecture.md"
PICTURE = "architecture.svg"
BEFORE = Path(__file__).with_name("rooms_before.json")
"""Rooms at the commit before they were built anew; a shallow clone does not have it."""


def page_text(house: House, before: dict[str, Any]) -> str:
    """Write the page.

    Parameters
    ----------
    house : House
    before : dict
        The ``commit`` and its ``rooms``, as ``BEFORE`` holds them.
    """
    earlier = {room["name"]: Room(**room) for room in before["rooms"]}
    values = {
        "house": house,
        "names": [name for floor in house.floors for name in floor],
        "earlier": earlier,
        "commit": before["commit"],
        "picture": PICTURE,
    }
    return render(Path(__file__).with_name("architecture.md.j2"), values)


def write_before(commit: str, path: Path = BEFORE) -> None:
    """Count the rooms at a commit of this clone and keep them."""
    rooms = [asdict(room) for room in rooms_at(ROOT, commit).values()]
    text = json.dumps({"commit": commit, "rooms": rooms}, indent=1)
    path.write_text(text + "\n", encoding="utf-8")


def main(arguments: Sequence[str] | None = None, page: Path = PAGE) -> int:
    """Write the page and its picture; status 1 where an import runs up."""
    parser = argparse.ArgumentParser(description="Write docs/architecture.md and its picture.")
    parser.add_argument("--before", metavar="COMMIT", help="count the rooms at COMMIT for the page")
    commit = parser.parse_args(arguments).before
    if commit:
        write_before(commit)
    house = read_house(ROOT)
    before = json.loads(BEFORE.read_text(encoding="utf-8"))
    page.write_text(page_text(house, before), encoding="utf-8")
    draw_house(house, page.with_name(PICTURE))
    print(page.relative_to(ROOT) if page.is_relative_to(ROOT) else page)
    for upper, lower in house.upward:
        print(f"{upper} imports {lower}, which does not lie below it", file=sys.stderr)
    return 1 if house.upward else 0


if __name__ == "__main__":
    sys.exit(main())
