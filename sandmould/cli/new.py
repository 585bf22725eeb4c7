"""The verb ``new``, which has many options: each answers one question."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer


def new(
    file: Annotated[
        Path, typer.Argument(metavar="[FILE]", help="The study to write.", show_default=True)
    ] = Path("my_study.yaml"),
    yes: Annotated[
        bool, typer.Option("--yes", "-y", help="Ask nothing: defaults and options.")
    ] = False,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace a file that is there.")
    ] = False,
    hold: Annotated[
        Literal["acceleration", "velocity", "displacement", "unbalance"] | None,
        typer.Option(help="What stays the same when the frequency changes. It decides most."),
    ] = None,
    acceleration_g: Annotated[float | None, typer.Option(help="Acceleration held, in g.")] = None,
    velocity_mm_s: Annotated[str | None, typer.Option(help="Velocity held, in mm/s.")] = None,
    amplitude_mm: Annotated[
        str | None,
        typer.Option(help="Amplitude (half of peak to peak), in mm; with --hold displacement."),
    ] = None,
    moment_kg_m: Annotated[
        float | None, typer.Option(help="Unbalance: mass times eccentricity, in kg m.")
    ] = None,
    moving_mass_kg: Annotated[
        float | None, typer.Option(help="Unbalance: mass of table and empty flask, in kg.")
    ] = None,
    mount_frequency_hz: Annotated[
        float | None, typer.Option(help="Unbalance: natural frequency on the mounts, in Hz.")
    ] = None,
    flask_depth_mm: Annotated[
        str | None, typer.Option(help="Unbalance: depth of the flask, in mm.")
    ] = None,
    lowest_hz: Annotated[float | None, typer.Option(help="Lowest frequency, in Hz.")] = None,
    highest_hz: Annotated[float | None, typer.Option(help="Highest frequency, in Hz.")] = None,
    settings: Annotated[int | None, typer.Option(help="Number of frequencies.")] = None,
    direction: Annotated[
        Literal["vertical", "horizontal"] | None, typer.Option(help="Direction of the vibration.")
    ] = None,
    most_g: Annotated[
        float | None,
        typer.Option(help="Acceleration that the table bears, in g; no setting goes above it."),
    ] = None,
    duration_s: Annotated[
        float | None, typer.Option(help="Duration of the vibration, in s.")
    ] = None,
    width_mm: Annotated[str | None, typer.Option(help="Inner width of the box, in mm.")] = None,
    height_mm: Annotated[str | None, typer.Option(help="Inner height of the box, in mm.")] = None,
    cavity: Annotated[
        Literal["tube", "hole_up", "hole_down", "none"] | None,
        typer.Option(help="Hole to fill; tube is a blind horizontal hole."),
    ] = None,
    opening_mm: Annotated[str | None, typer.Option(help="Width of the hole, in mm.")] = None,
    cavity_depth_mm: Annotated[str | None, typer.Option(help="Depth of the hole, in mm.")] = None,
    hole_height_mm: Annotated[
        str | None, typer.Option(help="Height of the hole's middle over the floor, in mm.")
    ] = None,
    sand_height_mm: Annotated[
        str | None, typer.Option(help="Height of the sand over the floor, in mm.")
    ] = None,
    material: Annotated[str | None, typer.Option(help="Sand, a name in config/materials.")] = None,
    size_scale: Annotated[
        float | None, typer.Option(help="Size of a computed grain over a real one.")
    ] = None,
    wave_speed_m_s: Annotated[
        float | None, typer.Option(help="Wave speed of the sand, in m/s.")
    ] = None,
    engine: Annotated[str | None, typer.Option(help="Engine, a name of sandmould doctor.")] = None,
    replicates: Annotated[int | None, typer.Option(help="Repeats of each setting.")] = None,
) -> None:
    """Write a study: it asks for drive, box, hole and sand."""
    given = {n: v for n, v in locals().items() if n not in ("file", "yes", "overwrite")}
    from sandmould.cli.questions import answers
    from sandmould.reference.new_answers import remarks
    from sandmould.reference.new_study import refuse_present, write_new_study

    if not overwrite:
        refuse_present(file)
    found = answers(given, ask=not yes)
    plan = write_new_study(file, found)
    typer.echo(f"{file}: {len(plan.runs)} runs")
    for line in remarks(found):
        typer.echo(line)
    typer.echo(f"sandmould show {file} draws it, sandmould plan {file} prints its price.")
