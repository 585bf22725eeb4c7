"""Studies of any number of short runs on a stand-in engine, in a folder of their own.

The stand-in is the reference engine with a score of grains: its loop takes a tenth of a second of a
core, and all else is what any run does. No code is swapped.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sandmould import ROOT
from sandmould.runs.hashing import scenario_hash
from sandmould.runs.manifest import MANIFEST_FILE, read_manifest, save_manifest
from sandmould.study.plan.build_plan import open_plan

REPLICATES = 5
FIRST_HZ, STEP_HZ = 20.0, 0.04
SHARED: dict[str, Any] = {"wall_s": 10.0, "least": 2}
"""As ``profiles/default`` shares jobs."""
LINKED = ("Snakefile", "workflow", "templates", "config", "profiles")
_STUDY = """\
based_on: tube
title: A sweep of short runs
scenario:
  engine: {{name: reference}}
  sand: {{size_scale: 12, size_classes: 3, disc_thickness_m: 0.1}}
  fill: {{layers: [{{count: 20}}]}}
  time_step: {{fraction: 0.8}}
  vibration: [{{frequency_hz: 50, acceleration_g: 1.5, duration_s: 0.06}}]
  record: {{snapshot_every_s: 0.2}}
sweep: {{keys: {{vibration.0.frequency_hz: {frequencies}}}}}
replicates: {replicates}
"""


@dataclass(frozen=True)
class ProcessCost:
    """What a process and all that it started and saw end took."""

    wall_s: float
    cpu_s: float
    peak_memory_bytes: int
    """Of the process itself."""


class Place:
    """A folder with links to the repository's parts, where results lie apart from all others."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        for name in LINKED:
            if not (folder / name).is_symlink():
                (folder / name).symlink_to(ROOT / name)

    def empty(self) -> None:
        """Remove what was measured here before."""
        for name in ("results", ".snakemake"):
            shutil.rmtree(self.folder / name, ignore_errors=True)

    def study(self, runs: int, more_points: int = 0) -> Path:
        """Write the study of so many runs, with some more points when it is extended."""
        points = max(1, runs // REPLICATES) + more_points
        frequencies = [round(FIRST_HZ + STEP_HZ * n, 2) for n in range(points)]
        path = self.folder / f"sweep_{runs}.yaml"
        replicates = min(runs, REPLICATES)
        text = _STUDY.format(frequencies=frequencies, replicates=replicates)
        path.write_text(text, encoding="utf-8")
        return path

    def results(self, runs: int) -> Path:
        """Folder of a study's results."""
        return self.folder / "results" / f"sweep_{runs}"

    def python(self, *arguments: str) -> ProcessCost:
        """Run this Python in the folder and say what it cost."""
        return timed([sys.executable, *arguments], self.folder)

    def snakemake(self, study: Path, *options: str, shared: bool) -> ProcessCost:
        """Run the workflow: with jobs shared as the default profile has it, or three jobs a run."""
        config = [] if shared else ["--config", "batch_wall_s=0"]
        command = ["-m", "snakemake", "--configfile", study.name, "--quiet", "all"]
        return self.python(*command, *config, *options)


def timed(
    command: Sequence[str], folder: Path, environment: Mapping[str, str] | None = None
) -> ProcessCost:
    """Run a command in a folder and say what it cost.

    Raises
    ------
    SystemExit
        When it fails, with what it printed last.
    """
    printed = folder / "printed"
    begun, peak = time.perf_counter(), 0
    with printed.open("wb") as file:
        process = subprocess.Popen(
            command, cwd=folder, stdout=file, stderr=file,
            env=environment or os.environ | {"PYTHONPATH": str(ROOT)},
        )  # fmt: skip
        # Not process.wait(): the kernel tells what a process took to whom waits for it in this way.
        while not (ended := os.wait4(process.pid, os.WNOHANG))[0]:
            peak = max(peak, _peak_bytes(process.pid))
            time.sleep(0.02)
    wall_s = time.perf_counter() - begun
    process.returncode = os.waitstatus_to_exitcode(ended[1])
    if process.returncode:
        raise SystemExit(f"{' '.join(command)} failed:\n{printed.read_text()[-3000:]}")
    return ProcessCost(wall_s, ended[2].ru_utime + ended[2].ru_stime, peak)


def _peak_bytes(pid: int) -> int:
    """Most memory that a living process has had resident, without that of its children."""
    try:
        status = Path(f"/proc/{pid}/status").read_text(encoding="utf-8")
    except OSError:
        return 0
    lines = [line for line in status.splitlines() if line.startswith("VmHWM")]
    return 1024 * int(lines[0].split()[1]) if lines else 0


def graft(place: Place, study: Path, source: Path) -> int:
    """Give every run of a planned study the products of a finished one, as hard links.

    Parameters
    ----------
    place : Place
    study : Path
        Planned, with the folders of its runs.
    source : Path
        ``results/<study>`` of a finished study of the same kind.

    Returns
    -------
    int
        Number of files linked.
    """
    folder = place.folder / "results" / study.stem
    finished = [p for p in sorted((source / "runs").iterdir()) if (p / "outcome.json").exists()]
    products = [
        [p.relative_to(run) for p in run.rglob("*") if p.is_file() and p.name != "scenario.yaml"]
        for run in finished
    ]
    plan, linked = open_plan(study), 0
    for number, run in enumerate(plan.runs):
        like, target = number % len(finished), folder / "runs" / run.run
        for below in {product.parent for product in products[like]}:
            (target / below).mkdir(parents=True, exist_ok=True)
        for product in products[like]:
            os.link(finished[like] / product, target / product)
            linked += 1
        # Its origin is its own: else it would be computed again.
        manifest = read_manifest(target)
        own = manifest["origin"] | {"scenario_sha256": scenario_hash(run.scenario)}
        (target / MANIFEST_FILE).unlink()
        save_manifest(target, manifest | {"origin": own})
    # Products are older than the plan; links share their times, so the plan is dated back.
    oldest = min(p.stat().st_mtime for p in (source / "runs").rglob("*") if p.is_file())
    for path in (*folder.glob("runs/*/scenario.yaml"), folder / "runs.tsv", folder / "study.yaml"):
        os.utime(path, (oldest - 1, oldest - 1))
    (folder / "batches").mkdir()
    for batch in plan.batches(**SHARED):
        (folder / "batches" / f"{batch.name}.done").touch()
    return linked
