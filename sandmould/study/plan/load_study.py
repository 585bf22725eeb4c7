"""Open a study: follow what it is based on, lay the files over each other, check the whole."""

from __future__ import annotations

import contextlib
import difflib
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from sandmould import ROOT, SHIPPED
from sandmould.bad_input import BadInputError, Problem, display_path
from sandmould.definition import certificate, comparing, own_measures, refinement, sweep
from sandmould.definition.study import Study
from sandmould.kinds.kind import Kind
from sandmould.kinds.registry import DEFAULT_KIND, KINDS, kind_named
from sandmould.scenario.quantity import NAME, units_at
from sandmould.scenario.reading import Origin, Tree, merge, read_yaml, validated
from sandmould.scenario.units import in_unit, unit_of

STUDIES = (SHIPPED / "config" / "studies", SHIPPED / "config" / "scenarios")
CALIBRATED = Path("results") / "materials"
"""Where studies write the sands that they calibrate."""
MATERIALS = (SHIPPED / "config" / "materials", CALIBRATED)
ROOT_KEY = "scenario"
"""Key of a study that its scene stands below."""
NEAREST = 3
_OF_SWEEP = ("sweep", "equivalence", "cross_check", "calibration", "refine", "certificate")
_FILE_KEY = (
    r"(\b(obstacles|cavities|shapes)(\.\d+)+\.file|\bpattern(\.\d+)*\.shape(\.\d+)*\.file"
    r"|\b(scenario|sweep\.keys|sweep\.points\.\d+)\.template"
    r"|\bscenario\.files\.\d+|\ballowed_folders\.\d+)(\.value)?$"
)


@dataclass(frozen=True)
class OpenStudy:
    """A study that was read whole and found sound."""

    name: str
    """Stem of its file; its results lie in ``results/<name>``."""
    path: Path
    study: Study
    tree: Tree
    """The merged files below the study, the scenario with all its defaults."""
    origin: Origin
    """File and source of each value, by key path from the study's root."""
    written: Mapping[str, str]
    """Names of files as the user wrote them, by those seen from ROOT."""

    @cached_property
    def scene_origin(self) -> Origin:
        """That of the scenario alone, without the many values of a sweep."""
        return self.origin.below(ROOT_KEY)

    @property
    def file(self) -> str:
        """Name of the study's file in messages."""
        return display_path(self.path)

    def as_written(self, problem: Problem) -> Problem:
        """A problem that shows a file's name as the user wrote it."""
        name = problem.value if isinstance(problem.value, str) else ""
        return replace(problem, value=self.written.get(name, problem.value))


@dataclass(frozen=True)
class StudyFile:
    """One file of a study or material as it was read."""

    path: Path
    name: str
    """In messages."""
    tree: Tree
    written: dict[str, str]


def open_study(path: Path, text: str | None = None) -> OpenStudy:
    """Read a study with all that it is based on, and check it.

    Raises
    ------
    BadInputError
        With one line a problem, each naming the file that holds the bad value.
    """
    return study_of(study_files(path, text))


def study_of(files: Sequence[StudyFile]) -> OpenStudy:
    """Check the whole of a study, from its files as of ``study_files``."""
    path, file_name = files[-1].path, files[-1].name
    kind = _kind(files)
    problems = [p for f in files for p in _wrong_units(kind.study, f)]
    origin = Origin(file={"": file_name})
    tree: Tree = {"scenario": kind.defaults}
    material = _material(files, kind)
    if material is not None and kind.material is not None:
        problems += _wrong_units(kind.material, material)
        _check_material(material, kind.material)
        tree = merge(tree, {"scenario": material.tree}, origin, material.name)
    for file in files:
        if "sweep" in file.tree:
            for section in _OF_SWEEP:
                tree.pop(section, None)
        tree = merge(tree, file.tree, origin, file.name)
    if problems:
        raise BadInputError(problems)
    study = validated(kind.study, tree, origin)
    problems = sweep.problems(study.sweep, study.scenario, study.replicates) or [
        *own_measures.problems(study.own_measures, study.sweep.swept),
        *comparing.problems(study),
        *study.problems(),
        *comparing.calibration_problems(study.calibration, study.sweep),
        *refinement.problems(
            study.refine, study.sweep, study.scenario, study.objective.better, study.replicates
        ),
        *certificate.problems(
            study.certificate, study.sweep, study.scenario, study.objective.better
        ),
    ]
    if problems:
        raise BadInputError([replace(p, file=origin.file_of(p.key)) for p in problems])
    written = {seen: name for file in files for seen, name in file.written.items()}
    return OpenStudy(path.stem, path, study, tree, origin, written)


def _kind(files: Sequence[StudyFile]) -> Kind[Any]:
    """Kind of the study: that of the study which it is based on."""
    kind = DEFAULT_KIND
    for n, file in enumerate(files):
        below, kind = kind, kind_named(file.tree.get("kind", kind.name), file.name)
        if n and kind is not below:
            valid = f"{below.name}, the kind of {files[n - 1].name}, which this study is based on"
            raise BadInputError([Problem("kind", kind.name, valid, file.name)])
    return kind


def study_files(path: Path, text: str | None = None) -> list[StudyFile]:
    """The study's file and all it is based on, the deepest base first; as of ``open_study``."""
    if not re.fullmatch(NAME, path.stem):
        valid = "small letters, digits and _, a letter first, such as tube_demo.yaml"
        raise BadInputError([Problem("file name", path.name, valid, display_path(path))])
    files = [_read(path, text)]
    while (name := files[0].tree.get("based_on")) is not None:
        above = files[0]
        folders = (above.path.parent, *STUDIES)
        seen = [f.path.resolve() for f in files]
        places = _places(name, folders)
        new = [p for p in places if p.resolve() not in seen]
        if not new:
            if places:
                chain = " on ".join(f.path.stem for f in reversed(files))
                valid = f"a study that does not lead back here ({chain} on {name})"
            else:
                valid = _valid_base(str(name), folders)
            raise BadInputError([Problem("based_on", name, valid, above.name)])
        files.insert(0, _read(new[0]))
    return files


def _material(files: Sequence[StudyFile], kind: Kind[Any]) -> StudyFile | None:
    """The material that the last file to name one names, of a kind that has materials."""
    stated = [f for f in files if "material" in f.tree]
    if kind.material is None or not stated or (name := stated[-1].tree["material"]) is None:
        return None
    folders = (stated[-1].path.parent, *MATERIALS)
    places = _places(name, folders)
    if places and set((found := _read(places[0])).tree) & set(kind.material.model_fields):
        return found
    names = ", ".join(materials(kind.material)) or "there is none yet"
    valid = f"the name of a material of kind {kind.name}: {names}"
    raise BadInputError([Problem("material", name, valid, stated[-1].name)])


def _check_material(material: StudyFile, model: type[BaseModel]) -> None:
    """Check a material by itself, so that a message has the key as its own file has it."""
    alone = Origin(file={"": material.name})
    validated(model, merge({}, material.tree, alone, material.name), alone)


def materials(model: type[BaseModel]) -> list[str]:
    """Names of the materials that a kind of study can use."""
    names = set()
    for path in _yaml_files(MATERIALS):
        with contextlib.suppress(BadInputError):
            _check_material(_read(path), model)
            names.add(path.stem)
    return sorted(names)


def _read(path: Path, text: str | None = None) -> StudyFile:
    name, written = display_path(path), dict[str, str]()
    tree = _named_from_root(read_yaml(path, name, text), path.parent, written)
    return StudyFile(path, name, tree, written)


def _named_from_root(tree: Any, folder: Path, written: dict[str, str], key: str = "") -> Any:
    """A file's tree with the files that it names as seen from itself named as seen from ROOT.

    So a run finds them from any working directory; what counts of them is name and content.
    ``written`` keeps their names as they stand there.
    """
    if isinstance(tree, dict):
        return {n: _named_from_root(v, folder, written, f"{key}.{n}") for n, v in tree.items()}
    if isinstance(tree, list):
        # the values of a swept key stand at the key, entries of other lists below it
        keys = [key if re.search(_FILE_KEY, key) else f"{key}.{i}" for i in range(len(tree))]
        return [_named_from_root(v, folder, written, k) for v, k in zip(tree, keys, strict=True)]
    if isinstance(tree, str) and re.search(_FILE_KEY, key):
        seen = from_root(folder / tree)
        written[seen] = tree
        return seen
    return tree


def from_root(path: Path) -> str:
    """Name of a file as seen from ROOT."""
    return Path(os.path.relpath(path, ROOT)).as_posix()


def _places(name: Any, folders: tuple[Path, ...]) -> list[Path]:
    """Files of a name; none when the name is no name at all."""
    if not isinstance(name, str) or not re.fullmatch(NAME, name):
        return []
    return [p for folder in folders if (p := folder / f"{name}.yaml").is_file()]


def _valid_base(name: str, folders: tuple[Path, ...]) -> str:
    """What a study can be based on: the nearest names, and where all of them lie."""
    of_study = {key for kind in KINDS.values() for key in kind.study.model_fields}
    places = {path.stem: path for path in _yaml_files(folders)}
    near = []
    for stem in difflib.get_close_matches(name, places, n=NEAREST, cutoff=0.6):
        with contextlib.suppress(BadInputError):
            if set(read_yaml(places[stem], stem)) <= of_study:
                near.append(stem)
    here, *shipped = map(display_path, folders)
    hint = f" (did you mean {', '.join(near)}?)" if near else ""
    # A shipped study may lie in a folder that is searched anyway.
    listed = " and ".join(dict.fromkeys([here, *shipped]))
    return f"the name of a study or scenario{hint}; they lie in {listed}"


def _yaml_files(folders: tuple[Path, ...]) -> Iterator[Path]:
    """Files of some folders whose stem is a name."""
    found = (path for folder in folders for path in sorted(folder.glob("*.yaml")))
    return (path for path in found if re.fullmatch(NAME, path.stem))


def _wrong_units(model: type[BaseModel], file: StudyFile) -> list[Problem]:
    """Units that contradict the key's own."""
    problems = []
    for key, value, unit in _units(file.tree):
        declared = _declared_units(model, key)
        if declared and unit_of(str(unit)) not in declared:
            valid = f"the unit of the key, {' or '.join(declared)}"
            valid += f": {told}" if (told := in_unit(value, unit, declared)) else ""
            problems.append(Problem(f"{key}.unit", unit, valid, file.name))
    return problems


def _units(tree: Any, key: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Every value and its unit that a file states, with the key path they stand at."""
    if isinstance(tree, dict) and {"value", "unit"} <= set(tree):
        yield key, tree["value"], tree["unit"]
    elif isinstance(tree, dict | list):
        for name, value in tree.items() if isinstance(tree, dict) else enumerate(tree):
            yield from _units(value, f"{key}.{name}" if key else str(name))


def _declared_units(model: type[BaseModel], key: str) -> list[str]:
    # The values of a swept key have its unit.
    return units_at(model, re.sub(r"^sweep\.(keys|points\.\d+)\.", "scenario.", key))


def at_later_key(
    problem: Problem,
    files: Sequence[StudyFile],
    misfits: Callable[[Sequence[StudyFile]], set[str]],
) -> Problem:
    """Tell a misfit at the key that changed, where the key that it was found at did not.

    ``files``: as of ``study_files``; ``misfits``: keys of the misfits that some files alone have.
    """
    of_material = not problem.key.startswith("scenario.") and problem.file not in {
        file.name for file in files
    }
    if of_material or problem.sentence:
        return problem
    number = len(files) - 1
    while number and problem.key in misfits(files[:number]):
        number -= 1
    file, below = files[number], files[:number]
    if not number or problem.file == file.name:
        return problem
    brought = _brought(
        file.tree, lambda tree: problem.key in misfits([*below, replace(file, tree=tree)])
    )
    if brought is None:
        return problem
    where = f"{problem.key} of {problem.file}, here {problem.value}"
    return Problem(*brought, f"one with which {where}, is {problem.valid}", file.name)


def _brought(tree: Tree, brings: Callable[[Tree], bool]) -> tuple[str, Any] | None:
    """The deepest key, with its value, that brings a misfit by itself."""
    for name, value in tree.items():
        if brings({name: value}):
            inner = None
            # what has a kind, or a value and its unit, is one
            if isinstance(value, dict) and not {"kind", "value"} & set(value):
                inner = _brought(value, lambda part, name=name: brings({name: part}))  # type: ignore[misc]
            return (f"{name}.{inner[0]}", inner[1]) if inner else (name, value)
    return None
