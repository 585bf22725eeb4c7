"""The pattern's part of a loop by files: ``python -m pattern_fe.coupling.from_files FOLDER``."""

from __future__ import annotations

from pathlib import Path

from sandmould.module_main import run_main
from sandmould.pattern_fe.coupling.exchange import (
    LOADS,
    SOLUTION,
    read_loads,
    read_pattern,
    write_solution,
)
from sandmould.pattern_fe.coupling.foam_body import FoamBody
from sandmould.pattern_fe.large_displacement import LoadNotReachedError


def solve_all(folder: Path) -> list[Path]:
    """Bend the pattern of a folder under every file of loads that has no solution yet.

    Parameters
    ----------
    folder : Path
        Holds what ``exchange`` describes.

    Returns
    -------
    list of Path
        Solutions that were written.

    Raises
    ------
    ValueError
        With one sentence on the file that cannot be used.
    LoadNotReachedError
        When large displacements find no rest under the loads.
    """
    pattern, large, surroundings = read_pattern(folder)
    body, outer, written = FoamBody(pattern, large, surroundings), pattern.surface.outer, []
    for loads in sorted(folder.glob(f"{LOADS}*.tsv")):
        path = folder / loads.name.replace(LOADS, SOLUTION)
        if path.exists():
            continue
        load_n, time_s = read_loads(loads, outer)
        write_solution(path, outer, body.solve(load_n), time_s)
        written.append(path)
    return written


def main(folder: str) -> None:
    """StaticSolution, and say which files are new."""
    try:
        written = solve_all(Path(folder))
    except (ValueError, LoadNotReachedError) as fault:
        raise SystemExit(str(fault)) from fault
    print(f"{folder}: {len(written)} answers written")


if __name__ == "__main__":
    run_main(main, "python -m pattern_fe.coupling.from_files FOLDER-OF-AN-EXCHANGE", (1,))
