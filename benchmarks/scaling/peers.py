"""The same sweep with other tools: what a run costs, what happens when one fails, and after a kill.

All tools are given the same job of no worth, ``peers/sweep/one_run.py``; what a user writes for
each lies in a folder beside it. Sandmould has no job without sand: its runs are those of the
stand-in.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

from benchmarks.scaling.study import LINKED, timed
from sandmould import ROOT
from sandmould.runs.outcome import Outcome, RunOutcome

HERE = Path(__file__).parents[1] / "peers" / "sweep"
PYTHON = ROOT / ".venv-peers" / "bin" / "python"
SNAKEMAKE = (sys.executable, "-m", "snakemake", "--quiet", "all", "--cores", "{cores}")
FAILS_HZ = 22
REPLICATES = 5
SHARE_AT_KILL = 0.4


@dataclass(frozen=True)
class Tool:
    """How a tool is driven."""

    name: str
    folder: str
    plan: Sequence[str]
    """Command before the first run; ``{points}`` stands for the number of frequencies."""
    run: Sequence[str]
    again: Sequence[Sequence[str]]
    """Commands after it was killed, as its documentation has them."""
    outcomes: str
    """Pattern of what a run that is done leaves."""

    def command(self, words: Sequence[str], points: int, cores: int) -> list[str]:
        """A command with its numbers filled in."""
        return [word.format(points=points, cores=cores) for word in words]


def tools() -> tuple[Tool, ...]:
    """Tools that are installed here, ours first."""
    own = (*SNAKEMAKE, "--configfile", "sweep.yaml")
    plain = (*SNAKEMAKE, "--keep-going")
    flow = (str(PYTHON), "project.py", "run", "--parallel", "{cores}")
    batch = ("yade-batch", "-j", "{cores}", "runs.table", "sim.py")
    installed = [
        Tool("sandmould", "sandmould", (), own, (own,), "results/sweep/runs/*/outcome.json"),
        Tool(
            "Snakemake with Paramspace", "paramspace", (sys.executable, "plan.py", "{points}"),
            plain, ((*plain, "--unlock"), (*plain, "--rerun-incomplete")), "results/**/*.json",
        ),
    ]  # fmt: skip
    if PYTHON.exists():
        plan = (str(PYTHON), "plan.py", "{points}")
        installed.append(
            Tool(
                "signac with signac-flow", "signac", plan, flow, (flow,), "workspace/*/result.json"
            )
        )
    if shutil.which("yade-batch"):
        plan = (sys.executable, "plan.py", "{points}")
        installed.append(Tool("yade-batch", "yade", plan, batch, (batch,), "results/*.json"))
    return tuple(installed)


def written_lines(tool: Tool) -> int:
    """Lines that the user writes, without empty ones and remarks."""
    texts = [p.read_text(encoding="utf-8") for p in sorted((HERE / tool.folder).iterdir())]
    lines = [line.strip() for text in texts for line in text.splitlines()]
    return sum(bool(line) and not line.startswith("#") for line in lines)


class Trial:
    """A tool's sweep in a folder of its own."""

    def __init__(self, folder: Path, tool: Tool, points: int, cores: int) -> None:
        self.folder, self.tool, self.points, self.cores = folder, tool, points, cores
        self.runs = points * REPLICATES
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(HERE / tool.folder, folder)
        shutil.copy(HERE / "one_run.py", folder)
        if tool.folder == "sandmould":
            for name in LINKED:
                (folder / name).symlink_to(ROOT / name)
            study = folder / "sweep.yaml"
            text = study.read_text(encoding="utf-8")
            study.write_text(text.replace("number: 20", f"number: {points}"), encoding="utf-8")
        self.environment = os.environ | {
            "STARTED": str(folder / "started"),
            "PYTHONPATH": str(ROOT) if tool.folder == "sandmould" else "",
            "PATH": f"{(PYTHON if tool.folder == 'signac' else Path(sys.executable)).parent}:"
            + os.environ["PATH"],
        }
        if tool.plan:
            self._call(tool.plan)

    def done(self) -> dict[str, int]:
        """Runs that have ended well, with the time of what they left."""
        outcomes = [p for p in self.folder.glob(self.tool.outcomes) if _ended_well(p)]
        return {str(p): p.stat().st_mtime_ns for p in outcomes}

    def whole(self) -> dict[str, float]:
        """Cost of all runs from nothing to the table."""
        command = self.tool.command(self.tool.run, self.points, self.cores)
        cost = timed(command, self.folder, self.environment)
        return {"wall_s": cost.wall_s / self.runs, "cpu_s": cost.cpu_s / self.runs}

    def failing(self) -> dict[str, Any]:
        """Let some runs fail, then mend what made them fail and go on."""
        self._break()
        status = self._call(self.tool.run)
        before = self.done()
        self._mend()
        again = self._call(self.tool.run)
        after = self.done()
        return {
            "others_done": len(before),
            "status": status,
            "then_done": len(after),
            "then_status": again,
            "redone": sum(after.get(run) != time_ns for run, time_ns in before.items()),
        }

    def killed(self) -> dict[str, Any]:
        """Kill all processes when some runs are done, and go on."""
        command = self.tool.command(self.tool.run, self.points, self.cores)
        process = subprocess.Popen(
            command, cwd=self.folder, env=self.environment, start_new_session=True,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        while len(before := self.done()) < SHARE_AT_KILL * self.runs and process.poll() is None:
            time.sleep(0.01)
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        before = self.done()
        status = [self._call(words) for words in self.tool.again][-1]
        after = self.done()
        return {
            "done_at_kill": len(before),
            "status": status,
            "then_done": len(after),
            "redone": sum(after.get(run) != time_ns for run, time_ns in before.items()),
        }

    def _call(self, words: Sequence[str]) -> int:
        command = self.tool.command(words, self.points, self.cores)
        return subprocess.run(
            command, cwd=self.folder, env=self.environment, capture_output=True
        ).returncode

    def _break(self) -> None:
        """Make the runs of one point fail; ours by a guard that no contact passes."""
        self.environment["FAIL_HZ"] = str(FAILS_HZ)
        if self.tool.folder == "sandmould":
            self._guarded(1e-9)

    def _mend(self) -> None:
        self.environment.pop("FAIL_HZ")
        if self.tool.folder == "sandmould":
            self._guarded(0.4)

    def _guarded(self, first: float) -> None:
        values = [first, *(0.5 + n / 1000 for n in range(self.points - 1))]
        study = self.folder / "sweep.yaml"
        lines = study.read_text(encoding="utf-8").splitlines()
        place = next(n for n, line in enumerate(lines) if line.startswith("sweep:"))
        lines[place] = f"sweep: {{keys: {{guard.largest_overlap_fraction: {values}}}}}"
        study.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _ended_well(path: Path) -> bool:
    """Whether what a run left says that it is done; ours leave an outcome when they fail, too."""
    if path.name != "outcome.json":
        return True
    return RunOutcome.read(path).outcome is Outcome.FINISHED


def peers(folder: Path, runs: int, cores: int) -> dict[str, Any]:
    """Compare all tools that are installed.

    Parameters
    ----------
    folder : Path
        Takes a folder a trial.
    runs : int
        Of the sweep, a multiple of the replicates.
    cores : int
    """
    points = runs // REPLICATES
    rows: dict[str, dict[str, Any]] = {}
    for tool in tools():
        trial = Trial(folder / tool.folder, tool, points, cores)
        row: dict[str, Any] = {"lines": written_lines(tool), "commands_after_kill": len(tool.again)}
        row["whole"] = trial.whole()
        row["failing"] = Trial(folder / tool.folder, tool, points, cores).failing()
        row["killed"] = Trial(folder / tool.folder, tool, points, cores).killed()
        rows[tool.name] = row
    return {"runs": runs, "cores": cores, "tools": rows, "job_cpu_s": _job_cpu_s(folder),
            "versions": versions()}  # fmt: skip


def _job_cpu_s(folder: Path) -> dict[str, float]:
    """What the job alone costs, without a tool, and with the start of Yade."""
    environment = os.environ | {"STARTED": str(folder / "started")}
    plain = [sys.executable, str(HERE / "one_run.py"), "50", "1", "out.json"]
    cpu_s = {"plain": timed(plain, folder, environment).cpu_s}
    if yade := shutil.which("yade"):
        shutil.copy(HERE / "one_run.py", folder)
        command = [yade, "-n", "-x", str(HERE / "yade" / "sim.py")]
        cpu_s["yade"] = timed(command, folder, environment).cpu_s
    return cpu_s


def versions() -> dict[str, str]:
    """Versions of the peers that are installed."""
    installed = {"Snakemake": metadata.version("snakemake")}
    if PYTHON.exists():
        question = (
            "from importlib.metadata import version as v; print(v('signac'), v('signac-flow'))"
        )
        answer = subprocess.run([str(PYTHON), "-c", question], capture_output=True, text=True)
        installed["signac"], installed["signac-flow"] = answer.stdout.split()
    if yade := shutil.which("yade"):
        answer = subprocess.run([yade, "--version"], capture_output=True, text=True)
        installed["Yade"] = " ".join((answer.stdout + answer.stderr).split()[-1:])
    return installed
