"""Measures of a run that bends a pattern: its shape, its load, the error of the loop."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from sandmould.analysis.deflection import deflection, farthest_corner
from sandmould.engines.snapshot import Snapshot
from sandmould.pattern_fe.coupling.body import StaticSolution
from sandmould.pattern_fe.coupling.convergence_log import CONVERGENCE_LOG, read_convergence_log
from sandmould.pattern_fe.coupling.foam_body import FoamBody
from sandmould.pattern_fe.coupling.gain_prediction import predicted_gain
from sandmould.pattern_fe.coupling.loop_verdict import LoopVerdict, classify_loop, stored_energy_j
from sandmould.pattern_fe.large_displacement import LoadNotReachedError
from sandmould.pattern_fe.loads import pressure_above_and_below_pa
from sandmould.pattern_fe.pattern import Pattern
from sandmould.pattern_fe.perimeter import Perimeter, distance_from_drawing
from sandmould.pattern_fe.scene import pattern_of, surroundings_of
from sandmould.pattern_fe.supports import AXES
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.runs.run_tables import read_costs
from sandmould.scenario.scenario import Scenario

Row = dict[str, Any]
ABOVE, BELOW = "pattern_pressure_above_pa", "pattern_pressure_below_pa"


class BentPattern:
    """The pattern of a run beside its drawing; made once, asked for every snapshot."""

    def __init__(self, scenario: Scenario) -> None:
        """Take the pattern of a scenario that has one."""
        config = scenario.pattern
        assert config is not None
        self._scenario, self._config = scenario, config
        self.pattern: Pattern = pattern_of(scenario)
        self.drawn: Perimeter = self.pattern.surface.outer
        """The surface that the sand meets, as drawn; in 2D a line."""
        held = self.pattern.space.node_m[self.pattern.fixed.any(axis=1)]
        if not len(held):
            held = self.pattern.space.node_m.mean(axis=0, keepdims=True)
        self._free = np.logical_not(self.drawn.held(self.pattern.fixed).any(axis=1))
        self.tip = farthest_corner(self.drawn.vertices_m, held)
        """Its vertex farthest from the supports, or from its middle where it has none."""
        around = surroundings_of(scenario, self.pattern)
        self.is_large = config.statics == "large"
        self._body = FoamBody(self.pattern, self.is_large, around)

    @property
    def reach_m(self) -> float:
        """Diagonal of the drawing."""
        return float(np.linalg.norm(np.ptp(self.drawn.vertices_m, axis=0)))

    def row(self, snapshot: Snapshot) -> Row:
        """Shape of a snapshot, and where the mean load of its record alone would bend the tip."""
        if snapshot.pattern_m is None:
            return {}
        drawn, now_m = self.drawn, snapshot.pattern_m
        bent = deflection(drawn.vertices_m, now_m, self.tip)
        away = distance_from_drawing(drawn, drawn.moved(now_m - drawn.vertices_m))
        row = {
            "pattern_tip_deflection_m": bent.tip_m,
            "pattern_largest_displacement_m": bent.largest_m,
            "pattern_distance_largest_m": away.largest_m,
            "pattern_distance_rms_m": away.rms_m,
        }
        if self._config.tolerance_m is not None:
            area_m2 = drawn.vertex_area_m2
            far = np.abs(away.vertex_m) > self._config.tolerance_m
            row["pattern_outside_tolerance_fraction"] = area_m2[far].sum() / area_m2.sum()
        if snapshot.pattern_load_n is not None:
            load_n = snapshot.pattern_load_n
            row[ABOVE], row[BELOW] = pressure_above_and_below_pa(drawn, load_n, self._free)
            row |= self._rest_row(load_n)
        return row | self._predicted

    @cached_property
    def _predicted(self) -> Row:
        """What the scenario alone tells of its loop in 2D; nothing of one without windows."""
        loop = self._config.loop
        if self._scenario.dimension == 3 or not loop.has_windows:
            return {}
        gain = predicted_gain(self._scenario, self.pattern, loop.window_s)
        return {"pattern_predicted_gain": gain.gain, "pattern_predicted_limit": gain.limit}

    def _rest_row(self, load_n: np.ndarray) -> Row:
        """Tip, stress and supports at rest under a load; the tip alone, NaN, without a rest."""
        solution, pattern = self.at_rest(load_n), self.pattern
        if solution is None:
            return {"pattern_tip_answered_m": np.nan}
        compression_pa = pattern.compression_pa(solution.nodes_m, self.is_large)
        row = {
            "pattern_tip_answered_m": -float(solution.displacement_m[self.tip, -1]),
            "pattern_von_mises_largest_pa": pattern.von_mises_pa(
                solution.nodes_m, self.is_large
            ).max(),
            "pattern_compression_largest_pa": compression_pa.max(),
        }
        if self._config.crush_strength_pa is not None:
            volume = pattern.space.weight.sum(axis=1)
            crushed = compression_pa > self._config.crush_strength_pa
            row["pattern_crushed_fraction"] = volume[crushed].sum() / volume.sum()
        touched_n = 0.0 if solution.contact_n is None else solution.contact_n.sum(axis=0)
        held_n = solution.reaction_n - touched_n
        return row | {
            f"pattern_support_{axis}_n": force_n
            for axis, force_n in zip(AXES, held_n, strict=False)
        }

    def at_rest(self, load_n: np.ndarray) -> StaticSolution | None:
        """The pattern at rest under a load of the sand; None where there is no rest."""
        if self.pattern.is_free:
            return None
        try:
            return self._body.solve(load_n)
        except LoadNotReachedError:
            return None


def add_loop(table: pd.DataFrame, folder: Path, reach_m: float) -> pd.DataFrame:
    """Add to the measures of a run what its log tells of the windows up to each, if it has one.

    Parameters
    ----------
    table : DataFrame
        Rows of ``measures.tsv`` in order of time.
    reach_m : float, m
        Arm that a moment left over is compared with.
    """
    log = convergence_log_of(folder)
    if log is None or "pattern_tip_deflection_m" not in table:
        return table
    filled_m = _filled_m(table)
    verdict = verdict_of(folder)
    return table.assign(
        **_by_snapshot(log, table["time_s"], reach_m),
        pattern_tip_filled_m=filled_m,
        pattern_tip_recovered_m=filled_m - table["pattern_tip_deflection_m"],
        pattern_outside_fraction=_outside_fraction(log, folder),
        pattern_loop="untouched" if verdict is None else verdict.state,
        pattern_loop_error_fraction=0.0 if verdict is None else verdict.error_fraction,
    )


def convergence_log_of(folder: Path) -> pd.DataFrame | None:
    """The convergence log of a run; None where it has none."""
    path = folder / CONVERGENCE_LOG
    log = read_convergence_log(path) if path.is_file() else None
    return None if log is None or log.empty else log


def verdict_of(folder: Path, until_s: float = np.inf) -> LoopVerdict | None:
    """Judge the loop of a run, or its part up to a time; None where nothing can be told."""
    log, outcome = convergence_log_of(folder), folder / "outcome.json"
    if log is None:
        return None
    stopped = np.isinf(until_s) and outcome.is_file() and (
        RunOutcome.read(outcome).outcome in (Outcome.COUPLING_DIVERGED, Outcome.NO_EQUILIBRIUM)
    )  # fmt: skip
    return classify_loop(log[log["time_s"] <= until_s], stopped)


def _by_snapshot(log: pd.DataFrame, time_s: pd.Series[float], reach_m: float) -> dict[str, Any]:
    """Columns of the log over the windows since the snapshot before, or the last known."""
    ends_s = time_s.dropna().to_numpy() * (1 + 1e-9)
    rows = log.assign(energy_j=stored_energy_j(log))
    if "residual_m" in log:
        load_n = log["load_n"].where(log["load_n"] > 0.0)
        rows["force_left"] = log["imbalance_n"] / load_n
        rows["moment_left"] = log["moment_left_n_m"] / load_n
    by = rows.groupby(np.searchsorted(ends_s, log["time_s"]))
    columns = {"pattern_work_j": by["work_j"].last(), "pattern_energy_j": by["energy_j"].mean()}
    columns["pattern_stored_fraction"] = columns["pattern_energy_j"] / columns["pattern_work_j"]
    if "residual_m" in log:
        columns |= {
            "pattern_residual_fraction": by["residual_m"].sum() / by["displacement_m"].sum(),
            "pattern_force_left_fraction": by["force_left"].max(),
            "pattern_moment_left_fraction": by["moment_left"].max() / reach_m,
            "pattern_factor": by["factor"].last(),
            "pattern_gain": by["gain"].last(),
            "pattern_windows": by["passes"].size().cumsum(),
            "pattern_passes": by["passes"].sum().cumsum(),
        }
    if "own_first_hz" in log:
        columns["pattern_frequency_fraction"] = by["first_hz"].last() / by["own_first_hz"].last()
    at = time_s.dropna().index
    return {
        name: pd.Series(values.reindex(range(len(at))).ffill().to_numpy(), at)
        for name, values in columns.items()
    }


def _filled_m(table: pd.DataFrame) -> float:
    """Deflection of the tip as vibration begins, or at the end of a run without vibration."""
    shaken = table[table["vibration_time_s"] >= 0.0]
    deflections_m = (shaken if len(shaken) else table.iloc[::-1])[
        "pattern_tip_deflection_m"
    ].dropna()
    return float(deflections_m.iloc[0]) if len(deflections_m) else np.nan


def _outside_fraction(log: pd.DataFrame, folder: Path) -> float:
    """Share of the wall time that went into the pattern's own part."""
    costs = read_costs([folder]).rows
    if "solve_s" not in log or "wall_s" not in costs:
        return np.nan
    return float(log["solve_s"].sum() / costs["wall_s"].iloc[-1])
