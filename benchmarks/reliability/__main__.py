"""What becomes of a study when processes are killed and disks fail.

``python -m benchmarks.reliability`` kills small studies of all kinds at random moments, cuts their
checkpoints short, fills their disk, makes it read-only and starts them twice at once, and writes
docs/developers/reliability.md. Each study is then called again by the same command and compared
with one that
nothing happened to.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.frame import SCRATCH, Benchmark, BenchmarkRun, render
from benchmarks.reliability import faults

WORK = SCRATCH / "reliability"


@dataclass(frozen=True)
class Faults:
    """How much is done to how many studies."""

    kinds: tuple[str, ...]
    kills: int
    torn: int
    seed: int = 1


WHOLE = Faults(tuple(faults.KINDS), kills=6, torn=2)
A_LITTLE = Faults(("casting",), kills=1, torn=0)
_CHECKPOINTS = ("sand", "sand_fill", "pattern")
"""Studies that leave checkpoints within seconds."""


def kills(run: BenchmarkRun) -> dict[str, Any]:
    """Every kind of study, killed at random moments."""
    how = run.extent
    return {
        kind: run.parts.get(f"kills of {kind}",
                            partial(faults.killed, kind, WORK, how.kills, how.seed))
        for kind in how.kinds
    }  # fmt: skip


def torn(run: BenchmarkRun) -> dict[str, Any]:
    """Checkpoints cut short."""
    how = run.extent
    return {
        kind: faults.torn(kind, WORK, how.torn, how.seed)
        for kind in how.kinds
        if kind in _CHECKPOINTS
    }


def disks(run: BenchmarkRun) -> dict[str, Any]:
    """A full disk, and one that cannot be written."""
    kind = run.extent.kinds[0]
    return {
        "full": faults.full_disk(kind, WORK, size="200k"),
        "read-only": faults.read_only(kind, WORK),
    }


def twice(run: BenchmarkRun) -> dict[str, Any]:
    """Two drivers on one study."""
    return {kind: faults.two_drivers(kind, WORK) for kind in run.extent.kinds[:1]}


def page(results: dict[str, Any]) -> str:
    """The page of the documentation."""
    return render(Path(__file__).with_name("page.md.j2"), {**results, "names": faults.KINDS})


BENCHMARK = Benchmark(
    __file__,
    __doc__,
    parts={"kills": kills, "torn": torn, "disks": disks, "twice": twice},
    pages={"developers/reliability.md": page},
    extent=WHOLE,
    quick=A_LITTLE,
    arrange=lambda measured, run: {
        **measured,
        "origin": {key: run.origin[key] for key in ("commit", "machine", "versions")},
        "took_s": round(run.took_s),
    },
)

if __name__ == "__main__":
    BENCHMARK.command()
