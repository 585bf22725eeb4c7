"""One bed in one source tree, asked for times and memory line by line on standard input.

``python worker.py TREE BED.npz THREADS [MESH.npz]``: it imports from ``TREE`` alone, so that two
trees can be measured in turns. Lines are ``advance STEPS``, ``shake STEPS``, ``list TIMES``,
``touching`` and ``memory``.
"""

from __future__ import annotations

import argparse
import gc
import importlib
import json
import sys
import time
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

ACCELERATION_M_S2 = 1.5 * 9.81


def _status(what: str) -> int:
    """A line of the kernel's account of this process, bytes."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return next(1024 * int(line.split()[1]) for line in lines if line.startswith(what))


def _arrays(value: Any, name: str) -> Iterator[tuple[str, int]]:
    """Bytes of all arrays within named tuples."""
    if isinstance(value, np.ndarray):
        yield name, value.nbytes
    elif hasattr(value, "_fields"):
        for field in value._fields:
            yield from _arrays(getattr(value, field), f"{name} {field}".strip())


class _Worker:
    def __init__(self, tree: Path, bed_file: Path, threads: int, mesh_file: Path | None) -> None:
        sys.path.insert(0, str(tree))
        beds = importlib.import_module("benchmarks.engines.beds")
        if Path(str(beds.__file__)).parents[2] != tree:
            raise SystemExit(f"{beds.__file__} does not lie in {tree}")
        with np.load(bed_file, allow_pickle=False) as arrays:
            bed = beds.Bed(**{k: a[()] if a.ndim == 0 else a for k, a in arrays.items()})
        self.period_s = float(beds.PERIOD_S)
        few = beds.tiled(bed, min(bed.grains, 200))
        beds.solver_on(few).advance(np.zeros(12))  # compiled and loaded: not of the bed's memory
        gc.collect()
        self.empty = _status("VmRSS")
        begun = time.perf_counter()
        self.solver = beds.solver_on(bed, threads)
        if mesh_file:
            self._put_in(bed, mesh_file)
        self.began_s = time.perf_counter() - begun
        self.still = np.zeros(bed.dimension)

    def _put_in(self, bed: Any, mesh_file: Path) -> None:
        """Put a mesh among the grains, which then touch nothing yet."""
        with np.load(mesh_file, allow_pickle=False) as mesh:
            self.solver.surfaces.add_facets("pattern", mesh["vertices_m"], mesh["facets"])
        self.solver.place(bed.position_m, bed.velocity_m_s, bed.spin_rad_s)

    def _run(self, moved_m: np.ndarray) -> dict[str, Any]:
        wall, cpu = time.perf_counter(), time.process_time()
        self.solver.advance(moved_m)
        wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
        grains = self.solver.grains
        places = grains.position[np.argsort(grains.id)]
        return {"wall_s": wall, "cpu_s": cpu, "checksum": zlib.crc32(places.tobytes())}

    def advance(self, steps: int) -> dict[str, Any]:
        """Steps in a box at rest."""
        return self._run(np.zeros(steps + 2))

    def shake(self, steps: int) -> dict[str, Any]:
        """Steps in a box that shakes."""
        solver, omega = self.solver, 2.0 * np.pi / self.period_s
        times_s = (solver.steps - 1 + np.arange(steps + 2)) * solver.scene.dt
        grown = np.minimum(1.0, np.maximum(times_s, 0.0) * 4.0 / self.period_s)
        return self._run(grown * ACCELERATION_M_S2 / omega**2 * np.sin(omega * times_s))

    def list(self, times: int) -> dict[str, Any]:
        """Listings, each with the step that follows, and as many steps without."""
        cpu_s = []
        for listed in (True, False):
            begun = time.process_time()
            for _ in range(times):
                if listed:
                    self.solver._list(self.still)
                self.solver.advance(np.zeros(3))
            cpu_s.append(time.process_time() - begun)
        return {"cpu_s": (cpu_s[0] - cpu_s[1]) / times}

    def touching(self, _: int) -> dict[str, Any]:
        """Contacts of grains with surfaces."""
        return {"contacts": int(self.solver.moving.walls.history.used.sum())}

    def memory(self, _: int) -> dict[str, Any]:
        """Bytes between steps by array and as the kernel counts them, and the most in a listing."""
        gc.collect()
        resident = _status("VmRSS") - self.empty
        arrays = dict(_arrays(self.solver.moving, ""))
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
        self.solver._list(self.still)
        contacts, moving = self.solver.contacts, self.solver.moving
        return {
            "arrays": arrays,
            "resident": resident,
            "listing": _status("VmHWM") - self.empty,
            "listed": len(moving.pairs.other),
            "contacts": len(contacts.first),
        }


def main(tree: Path, bed_file: Path, threads: int, mesh_file: Path | None) -> None:
    """Answer each line."""
    worker = _Worker(tree, bed_file, threads, mesh_file)
    print(json.dumps({"began_s": worker.began_s}), flush=True)
    for line in sys.stdin:
        what, number = line.split()
        answer: Callable[[int], dict[str, Any]] = getattr(worker, what)
        print(json.dumps(answer(int(number))), flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tree", type=Path)
    parser.add_argument("bed", type=Path)
    parser.add_argument("threads", type=int)
    parser.add_argument("mesh", type=Path, nargs="?")
    main(*vars(parser.parse_args()).values())
