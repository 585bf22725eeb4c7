"""The folder of compiled code for each state of all kernels, found without loading Numba.

Numba notices a change in a kernel's own file, not in the files of what it calls. So the folder's
name is a hash of every source file that kernels can reach, of the versions of numba and llvmlite,
and of the processor: nodes of a cluster that share a home may differ in what they can run.

What numba keeps there is executed when it is read. So the folder must be one that nobody else can
write to.
"""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterable, Iterator
from importlib.metadata import version
from pathlib import Path

from sandmould.digest import SHORT, digest
from sandmould.user_cache import user_cache

_BY_OTHERS = stat.S_IWGRP | stat.S_IWOTH
_COMPILES = "sandmould.compiled"
"""Files that import it hold kernels."""
FOLDERS = ("sandmould", "sandmould/pattern_fe", "sandmould/analysis")
"""Folders of the house, two of them links; kernels elsewhere, in tests and benchmarks, may call
those in here."""
_IMPORT = re.compile(
    rb"^[ \t]*(?:from|import) (sandmould\b[\w.]*)(?: import (?:\(([^)]*)\)|([^\n(]*)))?",
    re.MULTILINE,
)


def _imported(text: bytes) -> Iterator[str]:
    """Names of modules of the house that a source file imports, with or without what from them."""
    for module, in_parentheses, bare in _IMPORT.findall(text):
        yield module.decode()
        for name in re.findall(rb"\w+", in_parentheses or bare):
            yield f"{module.decode()}.{name.decode()}"


def kernel_sources(root: Path) -> dict[str, bytes]:
    """Find the sources that compiled code depends on: files that compile, and all they import.

    Imports are followed since a kernel holds constants and named tuples of files that compile
    nothing.

    ``root``: folder of the packages.

    Returns
    -------
    dict of str to bytes
        Module name to text, in order of the names.
    """
    texts = {
        ".".join(path.relative_to(root).with_suffix("").parts).removesuffix(".__init__"): path
        for folder in FOLDERS
        for path in (root / folder).rglob("*.py")
    }
    modules = {name: path.read_bytes() for name, path in texts.items()}
    waiting = [name for name, text in modules.items() if _COMPILES in _imported(text)]
    reached = {_COMPILES}
    while waiting:
        name = waiting.pop()
        if name in modules and name not in reached:
            reached.add(name)
            waiting += _imported(modules[name])
    return {name: modules[name] for name in sorted(reached)}


def cache_key(sources: Iterable[bytes], versions: Iterable[str], processor: Iterable[str]) -> str:
    """Hash of all that machine code depends on.

    Parameters
    ----------
    sources : iterable of bytes
        Texts of the kernels and of what they import.
    versions : iterable of str
        Of numba and llvmlite.
    processor : iterable of str
        Its name and its features, as LLVM names them.
    """
    parts: list[str | bytes] = [*sources, *versions, *processor]
    return digest(*map(digest, parts))[:SHORT]


def cache_folder() -> Path:
    """Where the machine code of this state of the house lies on this processor."""
    from llvmlite import binding  # loads LLVM

    key = cache_key(
        kernel_sources(Path(__file__).parents[1]).values(),
        (version("numba"), version("llvmlite")),
        (binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten()),
    )
    return user_cache() / f"kernels-{key}"


def is_own(folder: Path) -> bool:
    """Make a folder and the one that it lies in, and say whether nobody else can write to them.

    ``folder``: one that others can write to is not used again, since it may hold what they have
    written.
    """
    above = folder.parent
    try:
        above.mkdir(parents=True, exist_ok=True)
        if above.stat().st_mode & _BY_OTHERS:
            above.chmod(stat.S_IRWXU)
        folder.mkdir(mode=stat.S_IRWXU, exist_ok=True)
        states = [each.stat() for each in (above, folder)]
    except OSError:
        return False
    return all(s.st_uid == os.getuid() and not s.st_mode & _BY_OTHERS for s in states)


def are_compiled(room: str) -> bool:
    """Whether kernels of a room, such as ``dem``, were compiled here before, maybe of other code.

    To find whether those of today were takes a tenth of a second.
    """
    return any(user_cache().glob(f"kernels-*/*.{room}.*/*.nbi"))
