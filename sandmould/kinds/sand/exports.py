"""The picture of a run of sand and its snapshots for other programs, made when asked for."""

from __future__ import annotations

import tempfile
from pathlib import Path

from matplotlib.figure import Figure

from sandmould.analysis.export import solids_to_vtk, to_ovito, to_vtk
from sandmould.analysis.plots import draw_by_layer, draw_scene
from sandmould.engines.snapshot import scene_at
from sandmould.kinds.sand.moments import MOMENTS, list_moments, nearest
from sandmould.runs.files import replaced, write_zip
from sandmould.scenario.scenario import Scenario


def write_picture(scenario: Scenario, folder: Path, out: Path) -> None:
    """Draw the last snapshot of a run by layer; the empty scene where there is none."""
    figure = Figure(figsize=(6, 4.5), dpi=150)
    ax = figure.add_axes((0.12, 0.12, 0.84, 0.8))  # a layout of its own would draw all twice
    moments = list_moments(folder)
    last = moments[-1].load() if moments else None
    scene = scenario.scene if last is None else scene_at(scenario, last)
    draw_scene(scene, ax, scenario.box.height_m)
    if last is not None:
        draw_by_layer(last, ax)
    figure.savefig(out)


def write_exports(scenario: Scenario, folder: Path, out: Path) -> None:
    """Pack the snapshots at the moments for ParaView (``.vtu``) and OVITO (``.dump``)."""
    moments = list_moments(folder)
    if not moments:
        return
    last_s = moments[-1].vibration_time_s
    with tempfile.TemporaryDirectory() as name, replaced(out) as partial:
        written = Path(name)
        if scenario.scene.solids:
            solids_to_vtk(scenario.scene, written / "solids.vtu")
        for moment in {nearest(moments, f * last_s) for f in MOMENTS.values()}:
            snapshot = moment.load()
            to_vtk(snapshot, written / f"{moment.stored.name}.vtu")
            to_ovito(snapshot, written / f"{moment.stored.name}.dump")
        if scenario.pattern is not None:
            from sandmould.kinds.sand.bent_files import write_solids  # scikit-fem: few need it

            write_solids(scenario, moments, written)
        write_zip(partial, {path.name: path for path in written.iterdir()})
