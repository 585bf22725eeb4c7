"""What whole sweeps cost with an older version and with this one, in turns on one machine.

``python -m benchmarks.sweeps --old FOLDER`` writes docs/developers/scaling.md. FOLDER is a checkout
of the
older version with its own ``.venv``, such as one that ``git worktree add`` makes and
``make quick`` sets up. ``--part thousand_runs`` runs a thousand short runs with both, once:
some 1 700 s of a core with a version that starts a process for each run, 200 s with a worker.
``--part same_answer_on_slurm`` wants Debian's slurmd and a machine without other work.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from argparse import ArgumentParser
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import yaml

from benchmarks.frame import SCRATCH, Benchmark, BenchmarkRun, children_s, render
from sandmould import ROOT
from sandmould.runs.run_tables import read_costs
from sandmould.statistics.agreement import sweep_part
from sandmould.statistics.verdict import compare_settings
from sandmould.study.collect import read_summary
from tests.workflow.slurm_node import SlurmNode

CORES = 2
ON_CORES = ["--cores", str(CORES)]
ON_SLURM = [
    "--", "--workflow-profile", "slurm", "--config", "batch_wall_s=300", f"batch_cores={CORES}",
    "--default-resources", "mem_mb=500", "runtime=30",
]  # fmt: skip
"""The profile as shipped, told the cores of its node."""
STUDIES = ("sweep", "certified", "short_runs")
FREQUENCY = "vibration.0.frequency_hz"
_TUBE: dict[str, Any] = {"engine": {"name": "reference"}, "time_step": {"fraction": 0.8}}
_SHAKE: dict[str, Any] = {"frequency_hz": 50, "acceleration_g": 1.5}


def _study(scenario: Mapping[str, Any], hz: list[float], **top: Any) -> dict[str, Any]:
    return {
        "based_on": "tube", "scenario": {**_TUBE, **scenario},
        "sweep": {"keys": {FREQUENCY: hz}}, **top,
    }  # fmt: skip


def _stand_in(runs: int, replicates: int = 5) -> dict[str, Any]:
    """Short runs: those of docs/developers/workflow_cost.md."""
    scenario = {
        "sand": {"size_scale": 12, "size_classes": 3, "disc_thickness_m": 0.1},
        "fill": {"layers": [{"count": 20}]},
        "vibration": [{**_SHAKE, "duration_s": 0.06}],
        "record": {"snapshot_every_s": 0.2},
    }
    hz = [20.0 + 0.04 * n for n in range(runs // replicates)]
    return _study(scenario, hz, replicates=replicates)


def _sweep(scale: float, duration_s: float, replicates: int) -> dict[str, Any]:
    """A sweep like ``tube_frequency``: eight frequencies in equal ratios, 1.5 g held."""
    scenario = {
        "sand": {"size_scale": scale, "disc_thickness_m": 0.1},
        "vibration": [{**_SHAKE, "duration_s": duration_s}],
    }
    return _study(scenario, [15, 21, 29, 40, 55, 77, 107, 150], replicates=replicates)


def _certified(scale: float, duration_s: float, replicates: int) -> dict[str, Any]:
    """One like ``tube_certified``: an amplitude held, a round, and two controls."""
    held = {**_SHAKE, "hold": "displacement", "reference_frequency_hz": 50}
    scenario = {
        "sand": {"size_scale": scale, "disc_thickness_m": 0.1},
        "vibration": [{**held, "duration_s": duration_s}],
    }
    del held["frequency_hz"]
    return _study(
        scenario, [25, 35, 50, 70, 100, 140], replicates=replicates,
        equivalence={"margins": {"tube_fill_fraction": 0.03}},
        refine={"rounds": 1, "runs": 6, "interval": {FREQUENCY: 20}},
        certificate={"controls": ["hold", "bed_depth"]},
    )  # fmt: skip


def _until_known(
    scale: float, duration_s: float, half_width: float, **time_step: float
) -> dict[str, Any]:
    """Two fillings of each frequency, then more where none is ruled out."""
    study = _sweep(scale, duration_s, 2)
    study["scenario"]["time_step"] = {"fraction": 0.8, **time_step}
    return study | {
        "refine": {"adds": "replicates", "rounds": 20, "runs": 8, "half_width": half_width}
    }


WHOLE: dict[str, Any] = {
    "turns": 2,
    "same_answer": {"scale": 6.0, "duration_s": 2.0, "replicates": 5},
    "sweep": _sweep(6, 2.0, 2),
    "certified": _certified(8, 1.0, 3),
    "short_runs": _stand_in(100),
    "thousand_runs": _stand_in(1000),
    "one_run": _stand_in(30),
    "one_run_turns": 3,
    "report": _stand_in(42, 3),
    "report_turns": 3,
}
LITTLE: dict[str, Any] = {
    "turns": 1,
    "same_answer": {"scale": 12.0, "duration_s": 0.1, "replicates": 3},
    "sweep": _sweep(12, 0.1, 1),
    "certified": _certified(12, 0.1, 2),
    "short_runs": _stand_in(10),
    "thousand_runs": _stand_in(20),
    "one_run": _stand_in(5),
    "one_run_turns": 1,
    "report": _stand_in(4, 2),
    "report_turns": 1,
}


def _measured(
    python: Path, root: Path, study: Path, slurm: SlurmNode | None = None
) -> dict[str, float]:
    """Run a study from nothing to its report with one version; what that took and left.

    On Slurm jobs are no children of this process: the time of all cores is taken, that of other
    work too.
    """
    shutil.rmtree(study.parent / "results", ignore_errors=True)
    shutil.rmtree(study.parent / ".snakemake", ignore_errors=True)
    taken_s = children_s if slurm is None else _machine_s
    before_s, begun = taken_s(), time.perf_counter()
    ran = subprocess.run(
        [python, "-m", "sandmould.cli", "run", study.name, *(ON_SLURM if slurm else ON_CORES)],
        cwd=study.parent, capture_output=True, text=True,
        env=(slurm.environment if slurm else os.environ) | {"PYTHONPATH": str(root)},
    )  # fmt: skip
    wall_s, core_s = time.perf_counter() - begun, taken_s() - before_s
    folder = study.parent / "results" / study.stem
    if ran.returncode and not (folder / "report.html").exists():
        raise SystemExit(f"{study} failed with {root}:\n{ran.stdout[-2000:]}{ran.stderr[-2000:]}")
    costs = read_costs([*folder.glob("runs/*"), *folder.glob("fills/*")]).rows
    return {
        "core_s": core_s,
        "wall_s": wall_s,
        "runs": sum(1 for _ in folder.glob("runs/*")),
        "grain_steps": float(costs["grain_steps"].sum()),
        "loop_wall_s": float(costs["engine_wall_s"].sum()),
        "loop_core_s": float((costs["cpu_s"] * costs["engine_wall_s"] / costs["wall_s"]).sum()),
        "files": sum(path.is_file() for path in folder.rglob("*")),
        "bytes": sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()),
    }


def _machine_s() -> float:
    """Time that the cores of this machine have worked."""
    user, nice, system, *_ = Path("/proc/stat").read_text().split()[1:]
    return (int(user) + int(nice) + int(system)) / os.sysconf("SC_CLK_TCK")


def _in_turns(name: str, run: BenchmarkRun, turns: int = 0) -> dict[str, Any]:
    """Rows of the old and the new version, turn by turn; kernels are compiled before.

    Parameters
    ----------
    name : str
    run : BenchmarkRun
    turns : int
        As the call's extent has it unless given.
    """
    versions = _versions(run)
    rows: dict[str, list[dict[str, float]]] = {version: [] for version in versions}
    folder = SCRATCH / "sweeps"
    for version, root in versions.items():
        for turn, study in (("warm_up", LITTLE["short_runs"]), ("study", run.extent[name])):
            place = folder / f"{name}_{version}_{turn}"
            place.mkdir(parents=True, exist_ok=True)
            (place / f"{name}.yaml").write_text(yaml.safe_dump(study), encoding="utf-8")
        warm_up = folder / f"{name}_{version}_warm_up" / f"{name}.yaml"
        _measured(_python(root), root, warm_up)
    for number in range(turns or run.extent["turns"]):
        for version, root in versions.items():
            study = folder / f"{name}_{version}_study" / f"{name}.yaml"
            rows[version].append(_measured(_python(root), root, study))
            print(name, number, version, rows[version][-1], flush=True)
    return {"study": run.extent[name], "rows": rows, "commits": _commits(versions)}


def _same_answer(run: BenchmarkRun, slurm: SlurmNode | None = None) -> dict[str, Any]:
    """What the same half width between the two best settings costs, old and new."""
    versions, extent = _versions(run), run.extent["same_answer"]
    size = extent["scale"], extent["duration_s"]
    rows: dict[str, dict[str, Any]] = {}
    steps: dict[str, dict[str, float]] = {"old": {}, "new": {}}
    if slurm is None:
        steps["new_step"] = {"bed_fraction": 0.7}
    for name, time_step in steps.items():
        root = versions["old" if name == "old" else "new"]
        study = _sweep(*size, extent["replicates"])
        if name != "old":
            study = _until_known(*size, rows["old"]["half_width"], **time_step)
        file = SCRATCH / "sweeps" / f"same_{name}" / "same.yaml"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(yaml.safe_dump(study), encoding="utf-8")
        rows[name] = _measured(_python(root), root, file, slurm)
        rows[name] |= _answer(file.parent / "results" / file.stem)
        print(name, rows[name], flush=True)
    return {"rows": rows, **extent, "commits": _commits(versions)}


def _same_answer_on_slurm(run: BenchmarkRun) -> dict[str, Any]:
    """The same on a Slurm of one node, this machine, while nothing else works on it."""
    with tempfile.TemporaryDirectory() as folder:
        slurm = SlurmNode(Path(folder))
        slurm.start()
        try:
            return _same_answer(run, slurm)
        finally:
            slurm.stop()


def _answer(folder: Path) -> dict[str, Any]:
    """The best setting, and how well its difference from the next is known."""
    verdict = compare_settings(sweep_part(read_summary(folder)), [FREQUENCY], "tube_fill_fraction")
    assert verdict.best is not None
    assert verdict.runner_up is not None
    low, high = verdict.ci
    return {"best": verdict.best.label, "next": verdict.runner_up.label,
            "difference": verdict.difference, "half_width": (high - low) / 2}  # fmt: skip


def _versions(run: BenchmarkRun) -> dict[str, Path]:
    return {"old": Path(run.options.old).resolve(), "new": ROOT}


def _first_step(run: BenchmarkRun) -> dict[str, Any]:
    """Wall time from the command to the first step of the first short run, in turns.

    The first turn, which compiles and measures the machine, does not count.
    """
    versions = _versions(run)
    rows: dict[str, list[float]] = {version: [] for version in versions}
    study = SCRATCH / "sweeps" / "first_step" / "first_step.yaml"
    study.parent.mkdir(parents=True, exist_ok=True)
    study.write_text(yaml.safe_dump(LITTLE["short_runs"]), encoding="utf-8")
    for number in range(4):
        for version, root in versions.items():
            wall_s = _begun_s(_python(root), root, study)
            rows[version] += [wall_s] if number else []
    return {"wall_s": rows, "load": round(os.getloadavg()[0], 1), "commits": _commits(versions)}


def _begun_s(python: Path, root: Path, study: Path) -> float:
    folder = study.parent / "results" / study.stem
    shutil.rmtree(folder, ignore_errors=True)
    begun = time.perf_counter()
    started = subprocess.Popen(
        [python, "-m", "sandmould.cli", "run", study.name, *ON_CORES],
        cwd=study.parent, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        env=os.environ | {"PYTHONPATH": str(root)},
    )  # fmt: skip
    while not any(folder.glob("*/*/work/series.tsv")):
        time.sleep(0.003)
    wall_s = time.perf_counter() - begun
    started.terminate()
    started.wait()
    return round(wall_s, 2)


def _one_run(run: BenchmarkRun) -> dict[str, Any]:
    """Core time of a run inside a worker, in turns; the first turn, which compiles, is left out."""
    versions = _versions(run)
    rows: dict[str, list[float]] = {version: [] for version in versions}
    for number in range(run.extent["one_run_turns"] + 1):
        for version, root in versions.items():
            folder = SCRATCH / "sweeps" / f"one_run_{version}"
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir(parents=True)
            (folder / "one.yaml").write_text(yaml.safe_dump(run.extent["one_run"]))
            ran = subprocess.run(
                [_python(root), Path(__file__).with_name("one_run.py"), "one.yaml"],
                cwd=folder, capture_output=True, text=True, check=True,
                env=os.environ | {"PYTHONPATH": str(root)},
            )  # fmt: skip
            rows[version] += [float(ran.stdout.split()[-1])] if number else []
    return {"core_s": rows, "load": round(os.getloadavg()[0], 1), "commits": _commits(versions)}


def _report(run: BenchmarkRun) -> dict[str, Any]:
    """Core time of ``sandmould report``: tables, page and figures of finished runs, in turns."""
    versions = {"new": ROOT} if run.options.old == ROOT else _versions(run)
    study = run.extent["report"]
    rows: dict[str, list[float]] = {version: [] for version in versions}
    files = {}
    for version, root in versions.items():
        files[version] = SCRATCH / "sweeps" / f"report_{version}" / "report.yaml"
        files[version].parent.mkdir(parents=True, exist_ok=True)
        files[version].write_text(yaml.safe_dump(study), encoding="utf-8")
        _measured(_python(root), root, files[version])
    for _ in range(run.extent["report_turns"]):
        for version, root in versions.items():
            before_s = children_s()
            subprocess.run(
                [_python(root), "-m", "sandmould.cli", "report", "report.yaml"],
                cwd=files[version].parent, capture_output=True, check=True,
                env=os.environ | {"PYTHONPATH": str(root)},
            )  # fmt: skip
            rows[version].append(round(children_s() - before_s, 2))
    runs = len(study["sweep"]["keys"][FREQUENCY]) * study["replicates"]
    load = round(os.getloadavg()[0], 1)
    return {"runs": runs, "core_s": rows, "load": load, "commits": _commits(versions)}


def _python(root: Path) -> Path:
    own = root / ".venv" / "bin" / "python"
    return own if own.exists() else Path(sys.executable)


def _commits(versions: Mapping[str, Path]) -> dict[str, str]:
    command = ["git", "describe", "--always", "--dirty"]
    return {
        version: subprocess.run(command, cwd=root, capture_output=True, text=True).stdout.strip()
        for version, root in versions.items()
    }


def _compared(found: Mapping[str, Any]) -> dict[str, Any]:
    """Medians of a study that ran in turns, beside all of its rows."""
    rows = found["rows"]
    medians = {
        version: {key: median(row[key] for row in rows[version]) for key in rows[version][0]}
        for version in rows
    }
    return {**found, **medians, "turns": len(rows["new"])}


def page(results: dict[str, Any]) -> str:
    """The page of the results."""
    studies = {name: _compared(results[name]) for name in STUDIES}
    values = {"studies": studies, "commits": results["sweep"]["commits"], **results["origin"]}
    values["same"] = results["same_answer"]
    values["on_slurm"] = results.get("same_answer_on_slurm")
    values["first"] = results["first_step"]
    one_run = results["one_run"]
    medians = {version: median(rows) for version, rows in one_run["core_s"].items()}
    values["one_run"] = {**one_run, "median": medians}
    values["thousand"] = _compared(results["thousand_runs"])
    values["remark"] = results.get("remark", "")
    return render(Path(__file__).with_name("page.md.j2"), values)


def _add_options(parser: ArgumentParser) -> None:
    older = "checkout of the older version with its .venv; this one unless given"
    parser.add_argument("--old", metavar="FOLDER", default=ROOT, help=older)


BENCHMARK = Benchmark(
    __file__,
    __doc__,
    by_default=(*STUDIES, "same_answer", "first_step", "one_run", "origin"),
    parts={
        **{name: partial(_in_turns, name) for name in STUDIES},
        "same_answer": _same_answer,
        "same_answer_on_slurm": _same_answer_on_slurm,
        "first_step": _first_step,
        "one_run": _one_run,
        "thousand_runs": partial(_in_turns, "thousand_runs", turns=1),
        "report": _report,
        "origin": lambda run: run.origin,
    },
    pages={"developers/scaling.md": page},
    extent=WHOLE,
    quick=LITTLE,
    add_options=_add_options,
)  # fmt: skip

if __name__ == "__main__":
    BENCHMARK.command()
