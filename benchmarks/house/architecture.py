"""Write ``docs/developers/architecture.md`` and its picture: ``make architecture``."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from benchmarks.frame.page import render
from benchmarks.house.picture import draw_house
from benchmarks.house.rooms import House, Room, read_house
from sandmould import ROOT
from sandmould.module_main import run_main

PAGE = ROOT / "docs" / "developers" / "architecture.md"
PICTURE = "architecture.svg"
BEFORE = Path(__file__).with_name("rooms_before.json")
"""Rooms at the commit before they were built anew, counted in the same way."""


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


def main(page: Path = PAGE) -> int:
    """Write the page and its picture; status 1 where an import runs up."""
    house = read_house(ROOT)
    before = json.loads(BEFORE.read_text(encoding="utf-8"))
    page.write_text(page_text(house, before), encoding="utf-8")
    draw_house(house, page.with_name(PICTURE))
    print(page.relative_to(ROOT) if page.is_relative_to(ROOT) else page)
    for upper, lower in house.upward:
        print(f"{upper} imports {lower}, which does not lie below it", file=sys.stderr)
    return 1 if house.upward else 0


if __name__ == "__main__":
    run_main(main, "python -m benchmarks.house.architecture")
