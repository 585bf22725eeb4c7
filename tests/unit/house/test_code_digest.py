"""The hash of what computes: words change nothing, numbers, operators and fields do."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest

import pattern_fe
from sandmould import ROOT, dem
from sandmould.casting.arpm import computation as arpm
from sandmould.casting.mps import computation as mps
from sandmould.digest import code_digest
from sandmould.engines.registry import deck_sources
from tests.scenes import tube_scene

SOURCE = '''"""A law."""

from typing import NamedTuple

LIMIT: float = 2.0
NAMES: list[str]


class Law(NamedTuple):
    """Parameters."""

    stiffness: float = 1.0
    """N/m."""
    damped: bool = False

    def __len__(self) -> int:
        """Two."""
        count: int = 2
        return count


@cached(size=4)
def force(law: Law, overlap: float = 0.5, *more: float, twice: bool = False) -> float:
    """Force of a contact."""
    # Hooke's law
    total: float = law.stiffness * overlap
    rate: float

    def inner(x: float) -> float:
        """Nothing yet."""

    if twice:
        total += total  # again
    return min(total, LIMIT)
'''
WORDS = [
    ('"""A law."""', '"""Another law."""'),
    ('"""A law."""\n', ""),
    ("# Hooke's law", "# Hooke 1678"),
    ("    # Hooke's law\n", ""),
    ("  # again", ""),
    ('    """Force of a contact."""\n', ""),
    ('        """Nothing yet."""', "        pass"),
    ('"""N/m."""', '"""N/m, of the spring."""'),
    ('    """N/m."""\n', ""),
    ("law: Law,", "law: object,"),
    ("law: Law,", "law,"),
    ("*more: float", "*more: int"),
    ("twice: bool", "twice: int"),
    ("twice: bool = False) -> float:", "twice: bool = False):"),
    ("total: float = law", "total = law"),
    ("total: float = law", "total: int = law"),
    ("rate: float", "rate: int"),
    ("count: int", "count: float"),
    ("LIMIT: float", "LIMIT"),
    ("NAMES: list[str]", "NAMES: tuple[str, ...]"),
    ("    if twice:", "\n    if twice:"),
    ("min(total, LIMIT)", "min(\n        total,\n        LIMIT,\n    )"),
]
CODE = [
    ("LIMIT: float = 2.0", "LIMIT: float = 2.5"),
    ("LIMIT: float = 2.0", "LIMITS: float = 2.0"),
    ("law.stiffness * overlap", "law.stiffness + overlap"),
    ("overlap: float = 0.5", "overlap: float = 0.6"),
    ("overlap: float = 0.5", "overlap: float"),
    ("stiffness: float = 1.0", "stiffness: float = 1"),
    ("stiffness: float = 1.0", "stiffness: int = 1.0"),
    ("    stiffness: float = 1.0\n", ""),
    ("damped: bool = False", "damping: bool = False"),
    ("damped: bool = False", "damped = False"),
    ("    damped: bool = False", "    damped: bool = False\n    clipped: bool = False"),
    ("@cached(size=4)", "@cached(size=8)"),
    ("@cached(size=4)\n", ""),
    ("count: int = 2", "count: int = 3"),
    ("    rate: float\n", ""),
    ("if twice:", "if not twice:"),
    ("import NamedTuple", "import NamedTuple, Any"),
    ("min(total", "max(total"),
]


@pytest.fixture
def state(tmp_path: Path) -> str:
    return digest_of(SOURCE, tmp_path)


def digest_of(text: str, folder: Path) -> str:
    (folder / "law.py").write_text(text, encoding="utf-8")
    return code_digest([folder / "law.py"])


def changed(old: str, new: str) -> str:
    assert SOURCE.count(old) == 1, old
    text = SOURCE.replace(old, new)
    compile(text, "law.py", "exec")
    return text


@pytest.mark.parametrize(("old", "new"), WORDS)
def test_words_change_nothing(old: str, new: str, state: str, tmp_path: Path) -> None:
    assert digest_of(changed(old, new), tmp_path) == state


@pytest.mark.parametrize(("old", "new"), CODE)
def test_what_computes_changes_it(old: str, new: str, state: str, tmp_path: Path) -> None:
    assert digest_of(changed(old, new), tmp_path) != state


def test_versions_and_every_file_count(tmp_path: Path) -> None:
    state = digest_of(SOURCE, tmp_path)
    other = tmp_path / "empty.py"
    other.write_text("", encoding="utf-8")
    law = tmp_path / "law.py"
    states = {state, code_digest([law], "0.61"), code_digest([law, other])}
    assert len(states) == 3
    assert code_digest([law, other]) == code_digest([other, law])


def test_a_pattern_is_hashed_by_what_its_room_computes() -> None:
    assert pattern_fe.source_hash() == code_digest((ROOT / "pattern_fe").rglob("*.py"))


@pytest.mark.parametrize(
    ("solver", "files"),
    [
        (arpm, ["casting/arpm/local_steps.py", "casting/arpm/material.py", "scenario/outline.py"]),
        (mps, ["casting/mps/pressure.py", "scenario/flow.py"]),
        (dem, ["dem/contact_law.py", "dem/solver.py"]),
    ],
)
def test_a_solver_is_hashed_by_all_that_computes_for_it(solver: Any, files: list[str]) -> None:
    sources = solver.source_files()
    assert {ROOT / "sandmould" / name for name in files} <= set(sources)
    assert solver.source_hash() == code_digest(sources, version("numba"))


def engine_files(name: str, **changes: Any) -> set[str]:
    scenario = tube_scene(engine={"name": name}, **changes)
    ours = (path for path in deck_sources(scenario) if path.suffix == ".py")
    return {path.relative_to(ROOT / "sandmould").as_posix() for path in ours}


def test_a_run_is_hashed_by_the_code_beside_its_deck() -> None:
    every = {"engines/driver.py", "engines/staged_session.py", "scenario/placement.py"}
    lammps = engine_files("lammps", background_damping={"form": "none"})
    isotropic = engine_files("lammps", background_damping={"form": "nonviscous_isotropic"})
    assert every | {"engines/lammps/session.py"} <= lammps
    assert "engines/lammps/callback.py" not in lammps
    assert {"engines/lammps/callback.py", "dem/surface_contacts.py"} <= isotropic
    assert every | {"engines/reference/moved_solver.py"} <= engine_files("reference")
    assert every | {"engines/liggghts/process.py"} <= engine_files("liggghts")


def test_a_whole_room_is_hashed() -> None:
    assert len(code_digest((ROOT / "sandmould" / "dem").glob("*.py"))) == 12
