"""Pattern, loads and displacements in files: what two programs need that couple without meeting.

``pattern.yaml`` names the foam, its supports, its mesh ``pattern.vtu``, and the planes (floor and
walls) and outlines (obstacles, solid inside) that it must not enter. Each ``loads_*.tsv``
holds the sand's mean forces of a window, ``answer_*.tsv`` of the same name the surface that they
bend. Columns carry their units; what holds for the whole table stands in lines of ``# key: value``
above it. Numbers are written so that they read back the same.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import yaml
from numpy.typing import NDArray
from pydantic import AfterValidator, ConfigDict, Field
from pydantic_core import PydanticCustomError

from sandmould.bad_input import BadInputError
from sandmould.geometry.geometry import Scene, Wall
from sandmould.geometry.outline import Outline
from sandmould.pattern_fe.coupling.body import StaticSolution
from sandmould.pattern_fe.loads import vertex_pressure_pa
from sandmould.pattern_fe.material import Foam
from sandmould.pattern_fe.mesh_file import read_mesh, write_mesh
from sandmould.pattern_fe.pattern import Pattern
from sandmould.pattern_fe.perimeter import Perimeter
from sandmould.pattern_fe.supports import Supports
from sandmould.pattern_fe.surroundings import Surroundings
from sandmould.runs.files import write_text
from sandmould.scenario.quantity import Section
from sandmould.scenario.reading import Origin, read_yaml, validated

Array = NDArray[np.float64]
Values = Mapping[str, float]
PATTERN = "pattern.yaml"
MESH = "pattern.vtu"
LOADS = "loads_"
SOLUTION = "answer_"
_PLACE = ("x_m", "y_m")
_FORCE = ("force_x_n", "force_y_n", "pressure_pa")
_MOVED = ("displacement_x_m", "displacement_y_m")
_TOUCHED = ("contact_x_n", "contact_y_n")
"""Forces of what the pattern touches; other programs may leave them out."""
_WHOLE = ("energy_j", "reaction_x_n", "reaction_y_n", "moment_left_n_m")
_NEAR = 1e-6
"""Share of the drawing's extent by which a vertex may be off: other programs write fewer digits."""

_Point = tuple[float, float]


def _of_length_1(normal: _Point) -> _Point:
    if abs(math.hypot(*normal) - 1.0) > _NEAR:
        raise PydanticCustomError("normal", "a direction of length 1")
    return normal


class _Plane(Section):
    """A floor or wall that the pattern must not enter."""

    point_m: _Point
    normal: Annotated[_Point, AfterValidator(_of_length_1)]


class _PatternFile(Section):
    """What ``pattern.yaml`` holds; another program may add keys of its own."""

    model_config = ConfigDict(extra="ignore")

    mesh: str
    order: int
    thickness_m: float
    young_modulus_pa: float
    poisson_ratio: float
    density_kg_m3: float
    clamped: tuple[str, ...]
    resting: tuple[str, ...]
    statics: Literal["linear", "large"]
    planes: tuple[_Plane, ...]
    outlines_m: tuple[Annotated[tuple[_Point, ...], Field(min_length=3)], ...]


def write_pattern(
    folder: Path, pattern: Pattern, large: bool, surroundings: Surroundings | None = None
) -> None:
    """Write what a pattern in 2D is made of and how it is held.

    Parameters
    ----------
    folder : Path
    pattern : Pattern
    large : bool
        Whether displacements are large.
    surroundings : Surroundings, optional
        What it can touch; nothing unless given.
    """
    folder.mkdir(exist_ok=True)
    write_mesh(folder / MESH, pattern.space.mesh)
    foam, supports = pattern.foam, pattern.supports
    section: dict[str, Any] = {
        "mesh": MESH,
        "order": pattern.space.order,
        "thickness_m": pattern.space.thickness_m,
        "young_modulus_pa": foam.young_pa,
        "poisson_ratio": foam.poisson,
        "density_kg_m3": foam.density_kg_m3,
        "clamped": list(supports.clamped),
        "resting": list(supports.resting),
        "statics": "large" if large else "linear",
        "planes": [],
        "outlines_m": [],
    }
    if surroundings is not None:
        section["planes"] = [
            {"point_m": wall.point_m.tolist(), "normal": wall.normal.tolist()}
            for wall in surroundings.walls
        ]
        section["outlines_m"] = [line.tolist() for line in surroundings.outlines_m()]
    (folder / PATTERN).write_text(yaml.safe_dump(section, sort_keys=False), encoding="utf-8")


def read_pattern(folder: Path) -> tuple[Pattern, bool, Surroundings]:
    """Read what ``write_pattern`` wrote: pattern, whether displacements are large, surroundings.

    Raises
    ------
    ValueError
        When a file or a key is missing, or the pattern cannot be computed.
    """
    path = folder / PATTERN
    try:
        tree = read_yaml(path, str(path))
        if missing := [key for key in _PatternFile.model_fields if key not in tree]:
            valid = "what the sand's run wrote"
            raise ValueError(f"{path} has no key '{missing[0]}'; valid is {valid}")
        file = validated(_PatternFile, tree, Origin({"": str(path)}))
    except BadInputError as error:
        raise ValueError(str(error)) from error
    walls = tuple(
        Wall(f"plane_{i}", np.array(plane.point_m), np.array(plane.normal))
        for i, plane in enumerate(file.planes)
    )
    outlines = tuple(
        Outline(f"outline_{i}", np.array(line)) for i, line in enumerate(file.outlines_m)
    )
    foam = Foam(file.young_modulus_pa, file.poisson_ratio, file.density_kg_m3)
    supports = Supports(file.clamped, file.resting)
    mesh = read_mesh(folder / file.mesh)
    pattern = Pattern(mesh, supports, foam, file.order, file.thickness_m)
    return pattern, file.statics == "large", pattern.surrounded(Scene(2, walls, (), (), outlines))


def write_loads(path: Path, outer: Perimeter, load_n: Array, time_s: float) -> None:
    """Write mean forces of a window and their pressures, eq. (56), per area as drawn.

    Parameters
    ----------
    path : Path
    outer : Perimeter
        Line that the sand meets, as drawn.
    load_n : (nv, 2) float64, N
    time_s : float
        End of the window.
    """
    pressure_pa = vertex_pressure_pa(outer, load_n)
    rows = np.column_stack([outer.vertices_m, load_n, pressure_pa])
    _write(path, {"time_s": time_s}, (*_PLACE, *_FORCE), rows)


def read_loads(path: Path, outer: Perimeter) -> tuple[Array, float]:
    """Read what ``write_loads`` wrote: forces (nv, 2) in N, and the time in s.

    Raises
    ------
    ValueError
        When the file is damaged, or belongs to another pattern.
    """
    whole, rows = _read(path, ("time_s",), (*_PLACE, *_FORCE), outer)
    return rows[:, 2:4], whole["time_s"]


def write_solution(path: Path, outer: Perimeter, solution: StaticSolution, time_s: float) -> None:
    """Write where loads bend the line; arguments as ``write_loads``."""
    energetic = (solution.energy_j, *solution.reaction_n, solution.moment_left_n_m)
    whole = {"time_s": time_s} | dict(zip(_WHOLE, energetic, strict=True))
    contact_n = solution.contact_n
    touched = np.zeros_like(outer.vertices_m) if contact_n is None else contact_n
    rows = np.column_stack([outer.vertices_m, solution.displacement_m, touched])
    _write(path, whole, (*_PLACE, *_MOVED, *_TOUCHED), rows)


def read_solution(path: Path, outer: Perimeter) -> StaticSolution:
    """Read what ``write_solution`` or another program wrote; errors as ``read_loads``."""
    whole, rows = _read(path, _WHOLE, (*_PLACE, *_MOVED, *_TOUCHED), outer, len(_TOUCHED))
    reaction_n = np.array([whole["reaction_x_n"], whole["reaction_y_n"]])
    contact_n = rows[:, 4:] if rows[:, 4:].any() else None
    return StaticSolution(
        rows[:, 2:4], whole["energy_j"], reaction_n, whole["moment_left_n_m"], contact_n
    )


def _write(path: Path, whole: Values, columns: tuple[str, ...], rows: Array) -> None:
    """Write a table: where it is, it is whole."""
    head = [f"# {name}: {float(value)!r}" for name, value in whole.items()]
    lines = ("\t".join(map(repr, row)) for row in rows.tolist())
    write_text(path, "\n".join([*head, "\t".join(columns), *lines]) + "\n")


def _read(
    path: Path, keys: tuple[str, ...], columns: tuple[str, ...], outer: Perimeter, more: int = 0
) -> tuple[dict[str, float], Array]:
    """Read a table whose first columns are the vertices of a line; the last few may be missing."""
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
        head = [line[1:].split(":", 1) for line in lines if line.startswith("#")]
        whole = {pair[0].strip(): float(pair[1]) for pair in head if len(pair) == 2}
        names, *body = [line.split("\t") for line in lines if not line.startswith("#")]
        rows = np.array(body, dtype=np.float64)
    except OSError as error:
        raise ValueError(f"{path} cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise ValueError(f"{path} is not a whole table of numbers ({error})") from error
    missing = [key for key in keys if key not in whole]
    if missing:
        raise ValueError(f"{path} has no line '# {missing[0]}: value' above its table")
    if tuple(names) not in (columns, columns[: len(columns) - more]):
        raise ValueError(f"{path} has columns {', '.join(names)}; valid are {', '.join(columns)}")
    _check_rows(path, rows, outer)
    return whole, rows


def _check_rows(path: Path, rows: Array, outer: Perimeter) -> None:
    drawn_m = outer.vertices_m
    if len(rows) != len(drawn_m):
        raise ValueError(f"{path} has {len(rows)} vertices; valid are the pattern's {len(drawn_m)}")
    if not np.isfinite(rows).all():
        row = int(np.argmin(np.isfinite(rows).all(axis=1)))
        raise ValueError(f"{path} has a number that is not finite at vertex {row}")
    off_m = np.abs(rows[:, :2] - drawn_m).max(axis=1)
    if off_m.max() > _NEAR * np.ptp(drawn_m, axis=0).max():
        row = int(off_m.argmax())
        (x, y), (drawn_x, drawn_y) = rows[row, :2], drawn_m[row]
        raise ValueError(
            f"{path} has vertex {row} at ({x:.6g}, {y:.6g}) m; "
            f"valid is where it is drawn, ({drawn_x:.6g}, {drawn_y:.6g}) m"
        )
