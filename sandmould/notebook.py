"""Studies from Python, such as a notebook: compute one, then read its results as tables.

``import sandmould; result = sandmould.run("tube_demo")``. It does what ``sandmould run`` does, in a
process of its own, and shows its lines as they come.
"""

from __future__ import annotations

import base64
import contextlib
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property
from html import escape
from pathlib import Path
from typing import Any

import pandas as pd

from sandmould.bad_input import BadInputError, Problem
from sandmould.cli.study_file import study_file
from sandmould.drawing.figures import draw_layers
from sandmould.engines.snapshot import Snapshot, stored_snapshots
from sandmould.execution.again import forget
from sandmould.execution.cluster.queue import live_jobs
from sandmould.execution.status import run_statuses
from sandmould.reference.dictionary import study_text, write_study_file
from sandmould.runs.columns import RUN
from sandmould.scenario.quantity import NAME
from sandmould.scenario.scenario import Scenario
from sandmould.study.collect import Collected, read_collected
from sandmould.study.plan.announcement import known_prices
from sandmould.study.plan.build_plan import RESULTS, Plan, checked_plan, open_plan
from sandmould.study.plan.plan_files import VERDICT_FILE, plan_rows, read_run
from sandmould.study.plan.price import study_s


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


@dataclass(frozen=True, init=False)
class Result:
    """What a study has left in its folder of results."""

    folder: Path

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        """Read what is there, such as ``Result("results/tube_demo")``.

        Raises
        ------
        BadInputError
            Where no results of a study lie there.
        """
        object.__setattr__(self, "folder", Path(folder).absolute())
        if not (self.folder / VERDICT_FILE).is_file():
            valid = f"the folder of a study that was computed, which has its {VERDICT_FILE}"
            raise BadInputError([Problem("folder", str(folder), valid)])

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

    def write_report(self) -> Page:
        """Write the report again from the tables.

        Raises
        ------
        OSError, ValueError
            When results are missing or cannot be read.
        """
        from sandmould.report.page import write_report  # with all that draws

        write_report(self.folder, self.report.path)
        return self.report

    def film(self) -> Page:
        """The report at its film of sand."""
        return Page(self.folder / "report.html", "#film")

    def series(self, run: str) -> pd.DataFrame:
        """What a run recorded over time, a row a record; units stand in the names.

        Parameters
        ----------
        run : str
            Its name, one of ``runs``.

        Raises
        ------
        BadInputError
            Where there is no such run, or it recorded nothing.
        """
        try:
            return pd.read_csv(self._place(run) / "series.tsv", sep="\t")
        except (OSError, ValueError) as error:
            raise BadInputError([Problem("run", run, f"one with a record ({error})")]) from error

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
        axes = "xz" if snapshot.position_m.shape[1] == 2 else "xyz"
        table = pd.DataFrame(
            {name: getattr(snapshot, name) for name in ("id", "layer", "radius_m")}
        )
        table[[f"{axis}_m" for axis in axes]] = snapshot.position_m
        table[[f"{axis}_m_s" for axis in axes]] = snapshot.velocity_m_s
        table.attrs["time_s"] = snapshot.time_s
        return table

    def show(self, run: str | None = None, time_s: float | None = None) -> Picture:
        """Draw the grains of a run, coloured by layer of fill; parameters as in ``grains``.

        The first run is drawn unless one is named. A 3D scene is cut open.
        """
        run = self.runs[0] if run is None else run
        snapshot = self._snapshot(run, time_s)
        scenario = read_run(self._place(run) / "scenario.yaml").scenario
        assert isinstance(scenario, Scenario)
        (address,) = draw_layers([snapshot], scenario, scenario.box.height_m)
        return Picture(base64.b64decode(address.partition(",")[2]))

    def _place(self, run: str) -> Path:
        if run not in self.runs:
            valid = f"one of result.runs, such as {self.runs[0]}"
            raise BadInputError([Problem("run", run, valid)])
        return self.folder / "runs" / run

    def _snapshot(self, run: str, time_s: float | None) -> Snapshot:
        stored = stored_snapshots(self._place(run))
        upto = [each for each in stored if time_s is None or each.times_s()[0] <= time_s]
        if not upto:
            if not stored:
                raise BadInputError([Problem("run", run, "a run of sand, which has snapshots")])
            valid = f"at least {stored[0].times_s()[0]:g} s"
            raise BadInputError([Problem("time_s", time_s, valid)])
        return upto[-1].load()

    @cached_property
    def _collected(self) -> Collected:
        return read_collected(self.folder)

    def _repr_html_(self) -> str:
        page = os.path.relpath(self.folder / "report.html")
        return f'<p>{escape(self.verdict)} <a href="{escape(page)}">report</a></p>'


Progress = Callable[[int, int, str], object]
"""Is told how many runs are at their end, of how many, and the line on the one that ended."""
_ENDED = re.compile(r"\[(\d+)/(\d+)\] (.*)")
"""A line of the command on a run that has ended."""
Study = str | os.PathLike[str] | Mapping[str, Any]
"""Name of a shipped study, a study's file, or what such a file holds."""


def run(
    study: Study,
    *,
    name: str = "",
    cores: int | None = None,
    folder: str | os.PathLike[str] = ".",
    quiet: bool = False,
    progress: Progress | None = None,
) -> Result:
    """Compute a study, or what is missing of it, and read its results.

    Parameters
    ----------
    study : str, path or mapping
        Name of a shipped study, a study's file, or what such a file holds.
    name : str
        Of a study that is given as a mapping. Its title where it has none. It is written to
        ``<name>.yaml`` in the folder, so that the command can go on with it. A changed mapping
        replaces the file; a file that was written by hand stays as it is.
    cores : int, optional
        All of the machine unless given.
    folder : str or path
        Where ``results`` lies; the working folder unless given.
    quiet : bool
        Print nothing.
    progress : callable, optional
        Called when a run has ended, with the number of those at their end, that of all, and the
        line that tells of it: ``progress(3, 28, "frequency_25_r3_45f4dc done, ...")``.

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
    place = Path(folder).absolute()
    path, text = _file_and_text(study, name, place)
    with _within(place):
        checked_plan(path, text)
        if text is not None:
            write_study_file(path, text)
    return _run(path, place, cores, quiet, progress)


def again(
    *runs: str,
    cores: int | None = None,
    folder: str | os.PathLike[str] = ".",
    quiet: bool = False,
    progress: Progress | None = None,
) -> list[Result]:
    """Compute runs once more, such as failed ones, and what else their studies lack.

    Parameters
    ----------
    *runs : str
        Names of runs, or ``study/run``.
    cores, folder, quiet, progress
        As of ``run``.

    Returns
    -------
    list of Result
        One a study.

    Raises
    ------
    BadInputError, RuntimeError
        As of ``run``; where a run is unknown, nothing is forgotten.
    """
    place = Path(folder).absolute()
    with _within(place):
        studies = [path.absolute() for path in forget(runs, RESULTS)]
    return [_run(path, place, cores, quiet, progress) for path in studies]


def status(study: Study, *, name: str = "study", folder: str | os.PathLike[str] = ".") -> (
    pd.DataFrame
):  # fmt: skip
    """See where the runs of a study stand.

    Parameters
    ----------
    study, name, folder
        As of ``run``.

    Returns
    -------
    DataFrame
        A row a run, the fills that runs share first: ``run``, ``state`` (done, failed, running,
        stopped or waiting), ``said`` (how far it is, or why it failed), ``cpu_s``, ``share`` (of
        one that has begun) and ``wall_s`` (of one that is done).

    Raises
    ------
    BadInputError
        With one sentence a problem.
    """
    with _opened(study, name, folder) as opened:
        found = run_statuses(opened, RESULTS, opened.lacks(RESULTS), live_jobs())
    return pd.DataFrame([asdict(each) for each in found.values()])


def _run(
    path: Path, place: Path, cores: int | None, quiet: bool, progress: Progress | None
) -> Result:
    """Have the command compute a study whose file is there."""
    command = [sys.executable, "-m", "sandmould.cli", "run", str(path)]
    command += [] if cores is None else ["--cores", str(cores)]
    with subprocess.Popen(
        command, cwd=place, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        assert process.stdout is not None
        last = ""
        try:
            for line in process.stdout:
                if not quiet:
                    print(line, end="", flush=True)
                last = line.strip() or last
                if progress and (ended := _ENDED.match(line)):
                    progress(int(ended[1]), int(ended[2]), ended[3])
        except KeyboardInterrupt:
            process.terminate()  # a notebook interrupts this process alone
            process.wait()
            raise
    results = place / RESULTS / path.stem
    if not _has_ended(process.returncode, path, results):
        why = f"stopped by signal {-process.returncode}" if process.returncode < 0 else last
        raise RuntimeError(
            f"{path.stem} did not end ({why}). Call it again to go on with what is missing."
        )
    return Result(results)


def plan(
    study: Study,
    *,
    name: str = "study",
    cores: int | None = None,
    folder: str | os.PathLike[str] = ".",
) -> pd.DataFrame:
    """Check a study and foretell what it takes; nothing is computed or written.

    Parameters
    ----------
    study, name, cores, folder
        As of ``run``.

    Returns
    -------
    DataFrame
        A row a run: swept keys, replicate, seed, part of the study, work (such as
        ``grain_steps``) and ``wall_time_s``. ``attrs["wall_time_s"]`` is that of the whole study
        on these cores, ``attrs["price"]`` what it rests on.

    Raises
    ------
    BadInputError
        With one sentence a problem.
    """
    with _opened(study, name, folder) as opened:
        prices = known_prices(opened, RESULTS)
    runs = [*opened.fills, *opened.runs]
    table = pd.DataFrame(plan_rows(runs, prices))
    pieces = [prices.piece(each) for each in runs]
    table.attrs["wall_time_s"] = study_s(pieces, cores or os.cpu_count() or 1)
    table.attrs["price"] = prices.basis(runs)
    return table


@contextlib.contextmanager
def _opened(study: Study, name: str, folder: str | os.PathLike[str]) -> Iterator[Plan]:
    """The plan of a study that is not written, in the folder of its results."""
    place = Path(folder).absolute()
    path, text = _file_and_text(study, name, place)
    with _within(place):
        yield open_plan(path, text=text)


def _file_and_text(study: Study, name: str, folder: Path) -> tuple[Path, str | None]:
    """A study's file, and its text where that is to be written first."""
    if isinstance(study, Mapping):
        if not re.fullmatch(NAME, name):
            valid = "small letters, digits and _, a letter first, such as name='my_study'"
            raise BadInputError([Problem("name", name, valid)])
        # The title of the study that it rests on asks another question.
        return folder / f"{name}.yaml", study_text({"title": name, **study})
    if not isinstance(study, str | os.PathLike):
        valid = "the name of a shipped study, the path of a study's file, or a dictionary"
        raise BadInputError([Problem("study", study, valid)])
    return study_file(os.fspath(study)).absolute(), None


@contextlib.contextmanager
def _within(folder: Path) -> Iterator[None]:
    """Be in a folder, since results are owned by files as seen from there."""
    if not folder.is_dir():
        raise BadInputError([Problem("folder", str(folder), "a folder that is there")])
    with contextlib.chdir(folder):
        yield


def _has_ended(status: int, path: Path, results: Path) -> bool:
    """Whether the command came to its end: a status of 1 is also that of failed runs."""
    if status not in (0, 1) or not (results / VERDICT_FILE).is_file():
        return False
    with contextlib.chdir(results.parents[1]):
        return status == 0 or not open_plan(path).lacks(RESULTS)
