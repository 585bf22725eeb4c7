"""The rooms of the house as its files have them: lines, and imports from one to another."""

from __future__ import annotations

import ast
import re
import tomllib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

PACKAGE = "sandmould"
"""Its folders and modules are rooms of their own."""
FOLDERS = ("workflow", "benchmarks")
"""Rooms beside it."""
CODE = (".py", ".smk")
OTHERS = "peers"
"""Folder of programs that run in other tools' environments, as their users write them."""
CONTRACT = "imports point one way"
"""Name of the import contract between rooms."""


@dataclass(frozen=True)
class Room:
    """One room."""

    name: str
    """As the import contract has it, such as ``sandmould.dem``."""
    files: int
    lines: int


@dataclass(frozen=True)
class House:
    """All rooms."""

    rooms: dict[str, Room]
    imports: dict[tuple[str, str], int]
    """Number of import statements by the room that imports and the room it imports from."""
    floors: tuple[tuple[str, ...], ...]
    """Rooms by floor, the highest first."""

    @property
    def upward(self) -> list[tuple[str, str]]:
        """Imports that do not run down, between floors or within one."""
        level = {name: row for row, floor in enumerate(self.floors) for name in floor}
        return sorted(pair for pair in self.imports if level[pair[0]] >= level[pair[1]])


def read_house(root: Path) -> House:
    """Read rooms, imports and floors from a tree of the repository.

    Parameters
    ----------
    root : Path
        Holds ``pyproject.toml`` with the import contract, whose layers are the floors. Rooms
        outside the contract stand above it.

    Returns
    -------
    House

    Raises
    ------
    StopIteration
        When there is no such contract.
    SyntaxError
        When a file is no Python.
    """
    files = room_files(root)
    rooms = rooms_of(root)
    imports: Counter[tuple[str, str]] = Counter()
    for name, paths in files.items():
        for path in paths:
            for module in _imported(path):
                other = _room_of(module, rooms)
                if other is not None and other != name:
                    imports[name, other] += 1
    return House(rooms, dict(sorted(imports.items())), _floors(root, rooms))


def rooms_of(root: Path) -> dict[str, Room]:
    """Count files and lines of each room, blank lines and comments included."""
    return {
        name: Room(name, len(paths), sum(len(_text(path).splitlines()) for path in paths))
        for name, paths in room_files(root).items()
    }


def room_files(root: Path) -> dict[str, list[Path]]:
    """Files of code by room; a room without any is left out."""
    package = root / PACKAGE
    files = {
        f"{PACKAGE}.{path.stem}": [path] if path.is_file() else _code(path)
        for path in sorted(package.iterdir())
        if path.is_dir() or (path.suffix == ".py" and path.name != "__init__.py")
    }
    files |= {name: _code(root / name) for name in FOLDERS if (root / name).is_dir()}
    if "workflow" in files and (root / "Snakefile").is_file():
        files["workflow"].append(root / "Snakefile")
    return {name: paths for name, paths in files.items() if paths}


def _code(folder: Path) -> list[Path]:
    files = (path for path in folder.rglob("*") if path.suffix in CODE)
    return sorted(path for path in files if OTHERS not in path.relative_to(folder).parts)


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def _imported(path: Path) -> Iterator[str]:
    """Modules that a file imports, at its top or in a function."""
    text = _text(path)
    if path.suffix != ".py":
        # Snakemake's language is more than Python: its imports stand one a line.
        text = "\n".join(
            re.findall(r"^(?:from [\w.]+ import [\w, ]+|import [\w., ]+)$", text, re.M)
        )
    for node in ast.walk(ast.parse(text, str(path))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            if node.module == PACKAGE:
                yield from (f"{PACKAGE}.{alias.name}" for alias in node.names)
            else:
                yield node.module


def _room_of(module: str, rooms: dict[str, Room]) -> str | None:
    """The room that a module lies in; None for what is no part of the house."""
    parts = module.split(".")
    name = ".".join(parts[:2]) if parts[0] == PACKAGE else parts[0]
    return name if name in rooms else None


def _floors(root: Path, rooms: dict[str, Room]) -> tuple[tuple[str, ...], ...]:
    with (root / "pyproject.toml").open("rb") as file:
        contracts = tomllib.load(file)["tool"]["importlinter"]["contracts"]
    contract = next(each for each in contracts if each["name"] == CONTRACT)
    layers = [re.findall(r"[\w.]+", layer) for layer in contract["layers"]]
    named = {name for layer in layers for name in layer}
    above = [name for name in rooms if name not in named]
    floors = [above, *([name for name in layer if name in rooms] for layer in layers)]
    return tuple(tuple(floor) for floor in floors if floor)
