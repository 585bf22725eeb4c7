"""A pattern that another program bends: the loop asks by files, and the run stops meanwhile."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sandmould.engines.session import EngineStop, Session
from sandmould.pattern_fe.coupling.body import StaticSolution
from sandmould.pattern_fe.coupling.exchange import (
    LOADS,
    PATTERN,
    SOLUTION,
    read_loads,
    read_solution,
    write_loads,
    write_pattern,
)
from sandmould.pattern_fe.pattern import Pattern
from sandmould.pattern_fe.surroundings import Surroundings
from sandmould.runs.outcome import Outcome

Array = NDArray[np.float64]
EXCHANGE = "exchange"
_SAME = 1e-6
"""Share of the largest force up to which loads are those that were solution: a run that goes on
from a checkpoint repeats windows, on LAMMPS to some digits."""


_INSIDE = 1e-3
"""Share of the extent by which a solution may be inside: other programs press by penalties."""


class FilesBody:
    """An ``ElasticBody`` behind a folder of files; see ``exchange``.

    A solution that is not there stops the run. Continued, it repeats the windows since its
    checkpoint, finds their solutions, and comes to the one that it waited for.
    """

    def __init__(
        self,
        pattern: Pattern,
        large: bool,
        folder: Path,
        session: Session,
        surroundings: Surroundings,
    ) -> None:
        """Write the pattern.

        Parameters
        ----------
        pattern : Pattern
        large : bool
            Whether displacements are large.
        folder : Path
            Of the files; made where it is missing.
        session : Session
            Whose step names them.
        surroundings : Surroundings
            What it can touch.
        """
        self._folder, self._session, self._surroundings = folder, session, surroundings
        self._outer = pattern.surface.outer
        self._last = (-1, 0)
        write_pattern(folder, pattern, large, surroundings)

    @property
    def vertices_m(self) -> Array:
        """Vertices of the outer line as drawn, (nv, 2) float64, m."""
        return self._outer.vertices_m

    def solve(self, load_n: Array) -> StaticSolution:
        """Write the loads and read the solution under them.

        Raises
        ------
        EngineStop
            Where there is none yet, or none that can be used.
        """
        name = self._name()
        loads, solution = (self._folder / f"{head}{name}.tsv" for head in (LOADS, SOLUTION))
        if not self._is_written(loads, load_n):
            solution.unlink(missing_ok=True)
            write_loads(loads, self._outer, load_n, self._session.time_s)
        if not solution.exists():
            detail = (
                f"{loads} has the loads up to {self._session.time_s:.4g} s, and {solution.name} is "
                f"not there: python -m pattern_fe.coupling.from_files {self._folder} writes it"
            )
            raise EngineStop(Outcome.AWAITS_PATTERN, detail)
        try:
            found = read_solution(solution, self._outer)
        except ValueError as fault:
            raise EngineStop(Outcome.AWAITS_PATTERN, str(fault)) from fault
        inside_m = self._surroundings.deepest_m(found.displacement_m)
        if inside_m > _INSIDE * self._surroundings.extent_m:
            detail = (
                f"{solution} leads {inside_m:.3g} m into floor, walls or obstacles; valid is a "
                f"pattern outside the planes and outlines of {self._folder / PATTERN}"
            )
            raise EngineStop(Outcome.AWAITS_PATTERN, detail)
        return found

    def _name(self) -> str:
        """The step, and the number of its iteration: a window may be repeated."""
        step, before = self._session.steps, self._last
        self._last = (step, before[1] + 1 if step == before[0] else 0)
        return f"{step:09d}_{self._last[1]}"

    def _is_written(self, loads: Path, load_n: Array) -> bool:
        try:
            written, _ = read_loads(loads, self._outer)
        except ValueError:
            return False
        return bool(np.allclose(written, load_n, rtol=0.0, atol=_SAME * np.abs(load_n).max()))
