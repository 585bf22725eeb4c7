"""The one cache of compiled code: no kernel goes on computing what its sources no longer say."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
from llvmlite import binding

from sandmould import ROOT, kernel_cache
from sandmould.kernel_cache import (
    FOLDERS,
    are_compiled,
    cache_folder,
    cache_key,
    is_own,
    kernel_sources,
)
from sandmould.pattern_fe.inner_forces import _BY_DIMENSION


@pytest.fixture
def house(tmp_path: Path) -> Path:
    """A copy of all rooms with a cache of its own, where sources may be edited."""
    target = tmp_path / "house" / "sandmould"
    shutil.copytree(ROOT / "sandmould", target, ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path / "house"


def alone_in(house: Path) -> dict[str, str]:
    """Environment in which a copy of the rooms is imported."""
    return os.environ | {
        "PYTHONPATH": str(house),
        "XDG_CACHE_HOME": str(house / "cache"),
        "PYTHONDONTWRITEBYTECODE": "1",
    }


def printed(house: Path, script: str, *given: str) -> str:
    """What a script prints that imports the rooms of a copy."""
    command = [sys.executable, "-c", script, *given]
    ran = subprocess.run(command, env=alone_in(house), cwd=house, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    return ran.stdout.strip()


DEM = """
import numpy as np
from sandmould.dem.contact_law import Law
from sandmould.dem.moving_state import _pair_up
table = np.zeros((1, 1, 3))
_pair_up(np.ones(1), np.array([2.0]), Law(1.0, 1.0, 0.0, 0.5, 0.0, 0.0, True, False), table)
print(table[0, 0, 0])
"""
ARPM = """
import numpy as np
from sandmould.casting.arpm.marching import HeatSystem, _stage
none = np.zeros(0, np.int64)
rows = np.array([[1.0, 9.0, 9.0, 9.0, 9.0]])
system = HeatSystem(none, none.astype(np.int32), np.zeros(0), np.zeros(1, np.int64), rows, 1.0)
temperature = np.zeros(1)
_stage(np.array([0.0, 0.0, 1.0, 0.0]), 1.0, np.ones(1), np.zeros(1), np.zeros(1), np.zeros(1),
       np.ones(1), system, temperature)
print(temperature[0])
"""


@pytest.mark.parametrize(
    ("script", "callee", "old", "new", "numbers"),
    [
        (DEM, "sandmould/dem/contact_law.py", "2.0 * law.damping_ratio",
         "4.0 * law.damping_ratio", ("1.0", "2.0")),
        (ARPM, "sandmould/casting/arpm/material.py", "return reference + enthalpy",
         "return 10.0 + enthalpy", ("3.0", "12.0")),
    ],
    ids=["dem", "arpm"],
)  # fmt: skip
def test_an_edited_callee_is_compiled_again(
    house: Path, script: str, callee: str, old: str, new: str, numbers: tuple[str, str]
) -> None:
    before = printed(house, script)
    text = (house / callee).read_text(encoding="utf-8")
    assert text.count(old) == 1
    (house / callee).write_text(text.replace(old, new), encoding="utf-8")
    assert (before, printed(house, script)) == numbers


SLOW = """
import sys, time
from numba.core.caching import IndexDataCacheFile
from pathlib import Path
save_index = IndexDataCacheFile._save_index
def slowly(self, overloads):
    if "grow" in self._index_name:
        Path(f"saving_{sys.argv[1]}").touch()
        time.sleep(1.0)
    save_index(self, overloads)
IndexDataCacheFile._save_index = slowly
"""
GROW = """
import sys
sys.path.insert(0, ".")
from grow import grow
from numba import types
grow.compile((getattr(types, sys.argv[1]),))
print(*(str(s[0]) for s in grow.signatures), sum(grow.stats.cache_hits.values()))
"""


def test_two_processes_that_keep_a_function_at_once_do_not_mix_it_up(house: Path) -> None:
    kernel = "from sandmould.compiled import njit\n@njit()\ndef grow(x):\n    return x + 1\n"
    (house / "grow.py").write_text(kernel, encoding="utf-8")
    command = [sys.executable, "-c", SLOW + GROW]
    first = subprocess.Popen([*command, "float64"], env=alone_in(house), cwd=house)
    while not (house / "saving_float64").exists():
        assert first.poll() is None
        time.sleep(0.01)
    subprocess.run([*command, "int64"], env=alone_in(house), cwd=house, check=True)
    assert first.wait() == 0
    assert [printed(house, GROW, kind) for kind in ("float64", "int64")] == [
        "float64 1",
        "int64 1",
    ]


def test_what_is_compiled_is_kept_for_the_next_process(
    house: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    printed(house, ARPM)
    kept = {path: path.stat().st_mtime_ns for path in (house / "cache").rglob("*.nbc")}
    assert kept
    printed(house, ARPM)
    assert {path: path.stat().st_mtime_ns for path in (house / "cache").rglob("*.nbc")} == kept
    monkeypatch.setenv("XDG_CACHE_HOME", str(house / "cache"))
    assert (are_compiled("arpm"), are_compiled("dem")) == (True, False)
    # A copy of the same sources in another place, such as an installed wheel, finds it too.
    other = house.rename(house.with_name("other"))
    printed(other, ARPM)
    files = {path.relative_to(other / "cache"): path for path in (other / "cache").rglob("*.nbc")}
    assert {house / "cache" / name: path.stat().st_mtime_ns for name, path in files.items()} == kept


def test_kernels_of_one_source_are_kept_under_names_of_their_own() -> None:
    """With one name a process that loads one and compiles the other can mix up their symbols."""
    names = {kernel.py_func.__qualname__ for kernel in _BY_DIMENSION.values()}  # type: ignore[attr-defined]
    assert len(names) == len(_BY_DIMENSION)


def test_the_key_tells_processors_and_versions_apart() -> None:
    given = ([b"kernel"], ("0.61", "0.44"), ("znver4", "+avx512f"))
    others = [
        ([b"kernels"], *given[1:]),
        ([b"ker", b"nel"], *given[1:]),
        (given[0], ("0.62", "0.44"), given[2]),
        (given[0], ("0.61", "0.45"), given[2]),
        (*given[:2], ("skylake", "+avx512f")),
        (*given[:2], ("znver4", "-avx512f")),
    ]
    assert cache_key(*given) == cache_key(*given)
    assert len({cache_key(*each) for each in [given, *others]}) == 1 + len(others)


@pytest.mark.parametrize("of_llvm", ["get_host_cpu_name", "get_host_cpu_features"])
def test_another_processor_has_another_folder(
    of_llvm: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = cache_folder()
    other = SimpleNamespace(flatten=lambda: "+other") if "features" in of_llvm else "other"
    monkeypatch.setattr(binding, of_llvm, lambda: other)
    assert cache_folder() != here


@pytest.mark.parametrize("package", ["numba", "llvmlite"])
def test_another_version_has_another_folder(package: str, monkeypatch: pytest.MonkeyPatch) -> None:
    here = cache_folder()
    known = kernel_cache.version
    monkeypatch.setattr(
        kernel_cache, "version", lambda name: "0.0" if name == package else known(name)
    )
    assert cache_folder() != here


def test_the_folder_lies_where_caches_belong(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_folder().parent == tmp_path / "sandmould"


def test_a_relative_place_is_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    # it would lie in the folder worked in, which may hold results from elsewhere
    monkeypatch.setenv("XDG_CACHE_HOME", "results/cache")
    assert cache_folder().parent == Path.home() / ".cache" / "sandmould"


def test_the_folder_is_made_for_oneself_alone(tmp_path: Path) -> None:
    folder = tmp_path / "cache" / "sandmould" / "kernels-1"
    before = os.umask(0)
    try:
        assert is_own(folder)
    finally:
        os.umask(before)
    assert [p.stat().st_mode & 0o777 for p in (folder, folder.parent)] == [0o700, 0o700]


@pytest.mark.parametrize("mode", [0o777, 0o775, 0o1777])
def test_a_folder_that_others_write_to_is_not_used(tmp_path: Path, mode: int) -> None:
    folder = tmp_path / "sandmould" / "kernels-1"
    folder.mkdir(parents=True)
    folder.chmod(mode)
    assert not is_own(folder)
    assert not is_own(folder)  # it may hold what they wrote


@pytest.mark.parametrize("whose", ["kernels-1", ""])
def test_a_folder_of_another_user_is_not_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, whose: str
) -> None:
    folder = tmp_path / "sandmould" / "kernels-1"
    folder.mkdir(parents=True)
    theirs = (tmp_path / "sandmould" / whose).stat()
    real = Path.stat

    def stat(path: Path, **options: bool) -> os.stat_result:
        state = real(path, **options)
        if os.path.samestat(state, theirs):
            return os.stat_result((*state[:4], os.getuid() + 1, *state[5:10]))
        return state

    monkeypatch.setattr(Path, "stat", stat)
    assert not is_own(folder)


@pytest.mark.parametrize("of_others", [True, False])
def test_without_such_a_folder_nothing_is_kept(house: Path, of_others: bool) -> None:
    place = house / "cache"
    if of_others:
        folder = place / "sandmould" / cache_folder().name  # of the same sources
        folder.mkdir(parents=True)
        folder.chmod(0o777)
    else:
        place.write_text("a file")
    script = (
        "from numba.core.caching import NullCache; from sandmould.casting.arpm import marching;"
        "print(isinstance(marching._stage._cache, NullCache))"
    )
    assert printed(house, script) == "True"


def test_every_kernel_of_the_house_is_compiled_in_this_one_way() -> None:
    sources = kernel_sources(ROOT)
    for folder in FOLDERS:
        for path in (ROOT / folder).rglob("*.py"):
            text = path.read_text(encoding="utf-8")
            if path.name == "compiled.py":
                continue
            assert "CACHE_DIR" not in text, path
            assert not re.search(r"^from numba import .*\b(njit|jit|cfunc|vectorize)\b", text, re.M)
            if re.search(r"@njit|cfunc\(", text):
                assert text.encode() in sources.values(), path
    assert {"sandmould.casting.mps.particles", "sandmould.dem.vectors"} <= set(sources)
