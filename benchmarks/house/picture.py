"""The picture of the house: floors as rows, rooms as boxes, imports as arrows."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

from benchmarks.house.rooms import House

WIDTH, FLOOR, BOX_WIDTH, BOX_HEIGHT = 12.0, 1.35, 2.1, 0.62
"""Inches of the picture, of a floor's height, and of a room's box."""
COLOURS = ("#1b6ca8", "#b5541c", "#2e7d4f", "#7a3e9d", "#a8871b", "#a81b4e", "#3f6f78", "#6b6b6b")
_TOP, _BOTTOM = 0.5 * BOX_HEIGHT, -0.5 * BOX_HEIGHT


def draw_house(house: House, path: Path) -> None:
    """Write the picture; its format is the file's suffix.

    An arrow leaves the lower edge of the room that imports and has its colour and the number of
    its import statements. The same house gives the same file.
    """
    places = _places(house)
    height = FLOOR * len(house.floors)
    with rc_context({"svg.hashsalt": "house", "svg.fonttype": "none", "font.size": 9}):
        figure = Figure(figsize=(WIDTH, height))
        axes = figure.add_axes((0, 0, 1, 1))
        axes.set(xlim=(0, WIDTH), ylim=(-height + FLOOR / 2, FLOOR / 2))
        axes.set_axis_off()
        colours = {name: COLOURS[i % len(COLOURS)] for i, name in enumerate(places)}
        _arrows(axes, house, places, colours)
        for name, (x, y) in places.items():
            _box(axes, x, y, colours[name])
            room = house.rooms[name]
            lines_text = f"{room.lines:,}".replace(",", " ")
            axes.text(x, y + 0.1, name.removeprefix("sandmould."), ha="center", va="center",
                      fontsize=11, fontweight="bold", zorder=5)  # fmt: skip
            axes.text(x, y - 0.14, f"{lines_text} lines", ha="center", va="center", zorder=5)
        figure.savefig(path, metadata={"Date": None} if path.suffix == ".svg" else None)


def _places(house: House) -> dict[str, tuple[float, float]]:
    """Middle of each room's box; a floor of one room stands aside in turn, so arrows pass it."""
    places = {}
    alone = 0
    for row, floor in enumerate(house.floors):
        for place, name in enumerate(floor):
            x = WIDTH * (place + 1) / (len(floor) + 1)
            if len(floor) == 1:
                x = WIDTH * (0.28, 0.62)[alone % 2]
                alone += 1
            places[name] = (x, -FLOOR * row)
    return places


def _arrows(
    axes: Axes, house: House, places: dict[str, tuple[float, float]], colours: dict[str, str]
) -> None:
    """Draw all imports; those that meet at a box are spread over its edge."""
    below: dict[str, list[str]] = defaultdict(list)
    above: dict[str, list[str]] = defaultdict(list)
    for upper, lower in house.imports:
        below[upper].append(lower)
        above[lower].append(upper)
    for (upper, lower), number in house.imports.items():
        start = (_port(upper, lower, below[upper], places), places[upper][1] + _BOTTOM)
        end = (_port(lower, upper, above[lower], places), places[lower][1] + _TOP)
        axes.add_patch(
            FancyArrowPatch(
                start,
                end,
                arrowstyle="-|>",
                mutation_scale=9,
                shrinkA=0,
                shrinkB=0,
                linewidth=0.6 + 0.35 * number**0.5,
                color=colours[upper],
                alpha=0.75,
                zorder=2,
            )
        )
        # Near its start, where arrows of one room are still apart by colour and place.
        along = 0.3 / max(start[1] - end[1], 0.3)
        x = start[0] + along * (end[0] - start[0])
        y = start[1] + along * (end[1] - start[1])
        plate = {"facecolor": "white", "edgecolor": "none", "pad": 0.6}
        axes.text(
            x, y, str(number), color=colours[upper], fontsize=8, ha="center", va="center",
            zorder=4, bbox=plate,
        )  # fmt: skip


def _port(
    name: str, other: str, others: list[str], places: dict[str, tuple[float, float]]
) -> float:
    """Where on a box's edge the arrow to or from another room stands."""

    def slope(room: str) -> float:
        (x, y), (x0, y0) = places[room], places[name]
        return (x - x0) / abs(y - y0)

    order = sorted(others, key=slope)
    return places[name][0] + BOX_WIDTH * ((order.index(other) + 1) / (len(order) + 1) - 0.5)


def _box(axes: Axes, x: float, y: float, colour: str) -> None:
    axes.add_patch(
        FancyBboxPatch(
            (x - BOX_WIDTH / 2, y - BOX_HEIGHT / 2),
            BOX_WIDTH,
            BOX_HEIGHT,
            boxstyle="round,pad=0,rounding_size=0.08",
            facecolor="white",
            edgecolor=colour,
            linewidth=1.6,
            zorder=3,
        )
    )
