"""What a run leaves behind, moved into place last; the outcome after all else."""

from __future__ import annotations

import contextlib
import os
import resource
import shutil
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from sandmould.runs.checkpoint_folders import END_CHECKPOINT
from sandmould.runs.manifest import OUTCOME_FILE, files_below, write_manifest
from sandmould.runs.outcome import RunOutcome


@dataclass
class Cost:
    """The cost row of a run; continued runs add up."""

    engine: str
    ranks: int
    time_step_s: float
    time_step_fraction: float
    version: str = ""
    grains: int = 0
    steps: int = 0
    grain_steps: float = 0.0
    wall_s: float = 0.0
    engine_wall_s: float = 0.0
    cpu_s: float = 0.0
    """Of the first rank."""
    peak_memory_bytes: int = 0
    """Of the first rank."""
    largest_overlap_fraction: float = 0.0
    bed_limit_s: float | None = None
    """Exact critical step of the filled bed, where the run takes its step from it; of the shaken
    bed where it has begun again."""
    least_limit_s: float | None = None
    """Least one of the shaken bed, over the moments at which it was found."""
    limit_moments: int = 0
    begun_again: int = 0
    """Times that it has begun again from its fill, with a shorter step."""
    fill: str = ""
    """Fill that it shares, whose own cost counts apart."""

    def row(self) -> dict[str, Any]:
        """Values by name, as a continued run takes them up."""
        return asdict(self)

    def columns(self) -> dict[str, Any]:
        """Columns of the cost row in ``products.json`` and their values."""
        rate = self.grain_steps / self.engine_wall_s if self.engine_wall_s > 0 else 0.0
        columns = {**self.row(), "grain_steps_per_s": rate}
        absent = {
            "bed_limit_s": None,
            "least_limit_s": None,
            "limit_moments": 0,
            "begun_again": 0,
            "fill": "",
        }
        return {k: v for k, v in columns.items() if k not in absent or v != absent[k]}


@dataclass(frozen=True)
class Computed:
    """What the computation of a run came to."""

    outcome: RunOutcome
    cost: Cost
    is_root: bool
    """Whether this process writes the products."""


def cpu_time_s() -> float:
    """Processor time of this process and of the engines it has started and seen end."""
    return sum(os.times()[:4])


def note_spent(study_folder: Path, spent_s: float) -> None:
    """Write down what a process has spent, with children that do not do so themselves."""
    with contextlib.suppress(OSError), (study_folder / SPENT_FILE).open("a") as file:
        file.write(f"{spent_s:.2f}\n")


def noted_s(study_folder: Path) -> float:
    """What all that ended have spent."""
    with contextlib.suppress(OSError, ValueError):
        lines = (study_folder / SPENT_FILE).read_text(encoding="ascii").splitlines()
        return sum(float(line) for line in lines)
    return 0.0


def peak_memory_bytes() -> int:
    """Largest resident memory of this process and of the largest engine it has seen end."""
    whose = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    return sum(resource.getrusage(who).ru_maxrss for who in whose) * 1024


SPENT_FILE = "spent_s.txt"
"""In ``results/<study>``: processor time of each of its processes that ended, a line each."""
LAST_WORK = "last_work"
"""Folder of what a failed run leaves besides its products, its last checkpoint above all."""
TABLE_PERIODS = "table.tsv"
"""What a vibrating table on mounts did in each period."""
SAND_TABLES = (
    "series.tsv", "loads.tsv", "snapshots.npz", TABLE_PERIODS, "pattern.tsv", "pattern_shapes.f8"
)  # fmt: skip
"""What a run of sand writes on and on; a run that begins with a shared fill takes up the fill's."""
SAND_PRODUCTS = (*SAND_TABLES, "engine.log", "pattern.log", END_CHECKPOINT)


def finish(
    folder: Path,
    products: Sequence[str],
    outcome: RunOutcome,
    cost: Cost,
    provenance: dict[str, Any],
) -> None:
    """Move a run's products from its work folder into place.

    A finished run's work folder is removed, a failed one's renamed: asked for again, that run
    begins anew, since its tables are no longer beside its checkpoint. Where it comes from, its cost
    and sizes and hashes of all products are written down in ``products.json``.

    ``products``: files and folders of ``folder/work`` that are kept.
    """
    work = folder / "work"
    for name in products:
        target = folder / name
        if target.is_dir():
            shutil.rmtree(target)
        if (work / name).exists():
            os.replace(work / name, target)
    sizes = files_below(folder, tuple(products))
    write_manifest(folder, "computed", sizes, provenance, cost.columns(), outcome=outcome.text)
    shutil.rmtree(folder / LAST_WORK, ignore_errors=True)
    if outcome.outcome == 0:
        shutil.rmtree(work)
    else:
        os.replace(work, folder / LAST_WORK)
    outcome.write(folder / OUTCOME_FILE)
