"""Studies from Python, such as a notebook: compute one, then read its results as tables.

``import sandmould; result = sandmould.run("tube_demo")``. It does what ``sandmould run`` does, in a
process of its own, and shows its lines as they come.
"""

from __future__ import annotations

import base64
import os
import re
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from html import escape
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from sandmould.cli.study_file import study_file
from sandmould.engines.snapshot import Snapshot
from sandmould.engines.snapshot_file import stored_snapshots
from sandmould.report.figures import draw_layers
from sandmould.runs.columns import RUN
from sandmould.scenario.bad_input import BadInputError, Problem
from sandmould.scenario.quantity import NAME
from sandmould.scenario.scenario import Scenario
from sandmould.study.collect import Collected, read_collected
from sandmould.study.plan.build_plan import RESULTS, open_plan
from sandmould.study.plan.plan_files import VERDICT_FILE, read_run

AXES = ("x", "z"), ("x", "y", "z")
"""Names of the coordinates in 2D and in 3D; z is up."""


@dataclass(frozen=True)
class Picture:
    """A picture that a notebook shows by itself."""

    png: bytes = field(repr=False)

    def save(self, path: Path | str) -> Path:
        """Write it to a file."""
        out = Path(path)
        out.write_bytes(self.png)
        return out

    def _repr_png_(self) -> bytes:
        return self.png


@dataclass(frozen=True)
class Page:
    """A part of a report that a notebook shows in a frame."""

    path: Path
    part: str = ""

    def _repr_html_(self) -> str:
        address = f"{os.path.relpath(self.path)}{self.part}"
        return f'<iframe src="{escape(address)}" width="100%" height="700"></iframe>'


@dataclass(frozen=True)
class Result:
    """What a study has left in its folder of results."""

    folder: Path

    @cached_property
    def verdict(self) -> str:
        """The report's first sentence."""
        return (self.folder / VERDICT_FILE).read_text(encoding="utf-8").strip()

    @property
    def summary(self) -> pd.DataFrame:
        """A row a run: swept keys, outcome, measures and cost; units stand in the names."""
        return self._collected.summary

    @property
    def curves(self) -> pd.DataFrame:
        """A row a record of a run: measures over time."""
        return self._collected.curves

    @property
    def runs(self) -> list[str]:
        """Names of the runs."""
        return [str(run) for run in self.summary[RUN]]

    @property
    def report(self) -> Page:
        """The report."""
        return Page(self.folder / "report.html")

    def film(self) -> Page:
        """The report at its film of sand."""
        return Page(self.folder / "report.html", "#film")

    def grains(self, run: str, time_s: float | None = None) -> pd.DataFrame:
        """The grains of a run of sand, a row each.

        Parameters
        ----------
        run : str
            Its name, one of ``runs``.
        time_s : float, s, optional
            The last record up to it; the last of all unless given.

        Returns
        -------
        DataFrame
            ``id``, ``layer``, ``radius_m``, coordinates (``x_m``, ``z_m``, in 3D also ``y_m``) and
            velocities (``x_m_s`` ...) in the frame of the box. ``attrs["time_s"]`` is its time.

        Raises
        ------
        BadInputError
            Where there is no such run, or no record up to that time.
        """
        snapshot = self._snapshot(run, time_s)
        axes = AXES[snapshot.position_m.shape[1] - 2]
        columns: dict[str, Any] = {
            "id": snapshot.id, "layer": snapshot.layer, "radius_m": snapshot.radius_m
        }  # fmt: skip
        for i, axis in enumerate(axes):
            columns |= {f"{axis}_m": snapshot.position_m[:, i]}
        for i, axis in enumerate(axes):
            columns |= {f"{axis}_m_s": snapshot.velocity_m_s[:, i]}
        table = pd.DataFrame(columns)
        table.attrs["time_s"] = snapshot.time_s
        return table

    def show(self, run: str | None = None, time_s: float | None = None) -> Picture:
        """Draw the grains of a run, coloured by layer of fill; parameters as in ``grains``.

        The first run is drawn unless one is named. A 3D scene is cut open.
        """
        run = self.runs[0] if run is None else run
        snapshot = self._snapshot(run, time_s)
        scenario = read_run(self.folder / "runs" / run / "scenario.yaml").scenario
        assert isinstance(scenario, Scenario)
        (address,) = draw_layers([snapshot], scenario, scenario.box.height_m)
        return Picture(base64.b64decode(address.partition(",")[2]))

    def _snapshot(self, run: str, time_s: float | None) -> Snapshot:
        if run not in self.runs:
            raise BadInputError(
                [Problem("run", run, f"one of result.runs, such as {self.runs[0]}")]
            )
        stored = stored_snapshots(self.folder / "runs" / run)
        upto = [each for each in stored if time_s is None or each.times_s()[0] <= time_s]
        if not upto:
            valid = (
                f"at least {stored[0].times_s()[0]:g} s"
                if stored
                else "a run with snapshots of sand"
            )
            raise BadInputError([Problem("time_s", time_s, valid)])
        return upto[-1].load()

    @cached_property
    def _collected(self) -> Collected:
        return read_collected(self.folder)

    def _repr_html_(self) -> str:
        page = os.path.relpath(self.folder / "report.html")
        return f'<p>{escape(self.verdict)} <a href="{escape(page)}">report</a></p>'


def run(
    study: str | os.PathLike[str] | Mapping[str, Any], *, name: str = "", cores: int | None = None
) -> Result:
    """Compute a study, or what is missing of it, and read its results.

    Parameters
    ----------
    study : str, path or mapping
        Name of a shipped study, a study's file, or what such a file holds.
    name : str
        Of a study that is given as a mapping. Its title where it has none. It is written to
        ``<name>.yaml``, so that the command can go on with it.
    cores : int, optional
        All of the machine unless given.

    Returns
    -------
    Result
        Runs that failed are in its summary with their outcome.

    Raises
    ------
    BadInputError
        Before anything starts.
    RuntimeError
        Where it was stopped, or broke outside its runs.
    """
    path = _written(study, name) if isinstance(study, Mapping) else study_file(os.fspath(study))
    folder = RESULTS / open_plan(path).study.name
    command = [sys.executable, "-m", "sandmould.cli", "run", str(path)]
    command += [] if cores is None else ["--cores", str(cores)]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        assert process.stdout is not None
        last = ""
        for line in process.stdout:
            print(line, end="", flush=True)
            last = line.strip() or last
    if not (folder / VERDICT_FILE).is_file() or process.returncode > 1:
        raise RuntimeError(f"{path} did not end: {last}")
    return Result(folder.absolute())


def _written(study: Mapping[str, Any], name: str) -> Path:
    """A study as a file in the working folder; one that holds another study stays as it is."""
    if not re.fullmatch(NAME, name):
        raise BadInputError([Problem("name", name, "small letters, digits and _, a letter first")])
    path = Path(f"{name}.yaml")
    # the title of the study that it rests on asks another question
    titled = {"title": name, **study}
    text = yaml.safe_dump(titled, sort_keys=False, allow_unicode=True)
    if path.is_file() and yaml.safe_load(path.read_text(encoding="utf-8")) != titled:
        valid = f"another name: {path} holds another study"
        raise BadInputError([Problem("name", name, valid)])
    path.write_text(text, encoding="utf-8")
    return path
