"""The bent pattern of a run in files, as a foundry measures it."""

from __future__ import annotations

from pathlib import Path

from sandmould.kinds.sand.bending import BentPattern
from sandmould.kinds.sand.moments import Moment, list_moments
from sandmould.pattern_fe.export import write_solid, write_stl, write_surface
from sandmould.scenario.scenario import Scenario


def shape_moments(moments: tuple[Moment, ...]) -> dict[str, Moment]:
    """Snapshots after filling and at the end of a run, as far as it came."""
    shaken = [m for m in moments if m.vibration_time_s >= 0.0]
    chosen = {"filled": shaken[0]} if shaken else {}
    return chosen | ({"final": moments[-1]} if moments else {})


def write_bent(scenario: Scenario, run_folder: Path, out: Path) -> None:
    """Write the pattern after filling and at the end: the solid as STL, the surface as VTK."""
    out.mkdir(exist_ok=True)
    bent = BentPattern(scenario)
    for name, moment in shape_moments(list_moments(run_folder)).items():
        snapshot = moment.load()
        if snapshot.pattern_m is None:
            continue
        moved_m = snapshot.pattern_m - bent.drawn.vertices_m
        pattern = bent.pattern
        stl = out / f"pattern_{name}.stl"
        write_stl(stl, pattern.space, pattern.surface, pattern.spread(moved_m))
        write_surface(stl.with_suffix(".vtu"), bent.drawn, moved_m, snapshot.pattern_load_n)


def write_solids(scenario: Scenario, moments: tuple[Moment, ...], out: Path) -> None:
    """Write the whole pattern with its stress at the end of every stage (.vtu).

    It is at rest under the mean load of the record, or bent as its surface is where it has no rest.
    """
    bent = BentPattern(scenario)
    last = {snapshot.stage: snapshot for snapshot in (moment.load() for moment in moments)}
    for stage, snapshot in last.items():
        if snapshot.pattern_m is None or snapshot.pattern_load_n is None:
            continue
        rest = bent.at_rest(snapshot.pattern_load_n)
        moved_m = snapshot.pattern_m - bent.drawn.vertices_m
        nodes_m = bent.pattern.spread(moved_m) if rest is None else rest.nodes_m
        stress = {
            "von_mises_pa": bent.pattern.von_mises_pa(nodes_m, bent.is_large),
            "compression_pa": bent.pattern.compression_pa(nodes_m, bent.is_large),
        }
        write_solid(out / f"pattern_{stage}.vtu", bent.pattern.space, nodes_m, stress)
