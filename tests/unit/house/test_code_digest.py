"""The hash of what computes: words change nothing, numbers, operators and fields do."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest

from sandmould import ROOT, dem, geometry, pattern_fe
from sandmould.casting import arpm, mps
from sandmould.digest import code_digest, code_identity
from sandmould.engines.registry import deck_sources
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from tests.scenes import tube_scene

SOURCE = '''"""A law."""

from typing import NamedTuple

LIMIT: float = 2.0
NAMES: list[str]
KERNEL = "sandmould.dem.law"


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
OF_LATER_PYTHONS = '''

def text(value, width=3):
    """Strings with values in them, whose trees differ from Python to Python."""
    "a" "b"
    head = "one " f"two {value!r:>{width}} three" " four {}" f"{value:0.3f}" f""
    return head + f"{value + 1:{width}.{width}e}" + u"é" + f"{f'{value}'}{{}}"


async def wait(queue, *, first: int = -0, second=1e-300, third=0x10, **rest):
    match queue:
        case [1, *others] if others:
            return [x async for x in queue if (y := x) is not None]
        case {"a": None} | None:
            pass
    try:
        return lambda a, /, b=2j, *c: (a, b"x", ..., *c)
    except* OSError as error:
        raise ValueError from error
'''
"""What the trees of Python 3.11, 3.12 and 3.13 may say in different ways."""
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
    ("sandmould.dem.law", "sandmould/kernels/law.py"),
    ("NAMES: list[str]", "NAMES: tuple[str, ...]"),
    ("    if twice:", "\n    if twice:"),
    ("import NamedTuple", "import NamedTuple, Any"),
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


def test_versions_and_every_file_count(state: str, tmp_path: Path) -> None:
    law, other = tmp_path / "law.py", tmp_path / "other.py"
    other.write_text("LIMIT = 3\n", encoding="utf-8")
    assert code_identity([[law]], "0.61") != code_identity([[law]], "0.62")
    assert code_digest([law, other]) == code_digest([other, law]) != state


def test_where_a_statement_stands_changes_nothing(state: str, tmp_path: Path) -> None:
    law, other = tmp_path / "law.py", tmp_path / "other.py"
    head, function = SOURCE.split("@cached")
    law.write_text(f"from other import force\n{head}", encoding="utf-8")
    other.write_text(f"from law import Law, LIMIT\n@cached{function}", encoding="utf-8")
    assert code_digest([law, other]) == state


def test_the_digest_is_the_same_on_every_python(tmp_path: Path) -> None:
    # frozen on Python 3.11, equal on 3.12 and 3.13: ast.dump gave three
    assert digest_of(SOURCE + OF_LATER_PYTHONS, tmp_path) == "3c88d9cc8dc0"


def test_code_with_the_same_digits_keeps_its_identity(
    state: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = code_identity([[tmp_path / "law.py"]], "0.61")
    now = digest_of(SOURCE.replace("total += total", "total *= 2"), tmp_path)
    assert code_identity([[tmp_path / "law.py"]], "0.61") != before
    monkeypatch.setattr("sandmould.digest.equal_code", lambda: {now: state})
    assert code_identity([[tmp_path / "law.py"]], "0.61") == before


def test_a_pattern_is_hashed_by_what_its_room_computes() -> None:
    sources = (ROOT / "sandmould" / "pattern_fe").rglob("*.py")
    assert pattern_fe.source_hash() == code_identity([sources])


@pytest.mark.parametrize(
    ("solver", "files"),
    [
        (arpm, ["casting/arpm/local_steps.py", "casting/arpm/material.py", "scenario/solids.py"]),
        (mps, ["casting/mps/pressure.py", "scenario/casting/flow.py"]),
        (dem, ["dem/contact_law.py", "dem/solver.py"]),
    ],
)
def test_a_solver_is_hashed_by_all_that_computes_for_it(solver: Any, files: list[str]) -> None:
    sources = solver.source_files()
    assert {ROOT / "sandmould" / name for name in files} <= set(sources)
    groups = [sources, geometry.source_files()] if solver is arpm else [sources]
    assert solver.source_hash() == code_identity(groups, version("numba"))


def test_a_drawing_is_hashed_by_what_reads_it() -> None:
    reading = set(geometry.source_files())
    (bracket,) = expand(open_study(ROOT / "config" / "studies" / "bracket_small.yaml"))
    assert reading <= set(deck_sources(bracket.scenario))
    assert not reading & set(deck_sources(tube_scene()))


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
    assert len(code_identity([(ROOT / "sandmould" / "dem").glob("*.py")])) == 12
