"""The verb ``new``: a first study, by what a person knows of table, sand and part."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer


def new(
    name: Annotated[
        Literal["tube", "pocket", "part", "deck", "casting"],
        typer.Argument(
            metavar="NAME",
            help="tube: a hole that lies flat. pocket: one that opens down or up. part: one of "
            "foam, which sand bends. deck: a LAMMPS deck of your own. casting: it freezes.",
        ),
    ],
    file: Annotated[
        Path | None,
        typer.Argument(metavar="[FILE]", help="The study to write.", show_default="my_NAME.yaml"),
    ] = None,
    frequency_hz: Annotated[
        tuple[float, float] | None,
        typer.Option(
            metavar="FROM TO",
            help="Speeds of the table, in Hz: rpm divided by 60. Twice the same: one speed.",
        ),
    ] = None,
    acceleration_g: Annotated[
        float | None, typer.Option(help="It stays the same at every speed, in g.")
    ] = None,
    velocity_mm_s: Annotated[
        float | None, typer.Option(help="It stays the same at every speed, in mm/s.")
    ] = None,
    amplitude_mm: Annotated[
        float | None, typer.Option(help="It stays the same: half of the table's stroke, in mm.")
    ] = None,
    largest_acceleration_g: Annotated[
        float | None, typer.Option(help="Most that the table bears, in g: faster is left out.")
    ] = None,
    unbalance: Annotated[
        tuple[float, float] | None,
        typer.Option(
            metavar="KG_CM KG",
            help="They stay the same: working moment of all motors in kg cm, and mass of table, "
            "motors and empty flask.",
        ),
    ] = None,
    material: Annotated[str | None, typer.Option(help="Sand, or metal with its mould.")] = None,
    box_mm: Annotated[
        tuple[float, float] | None,
        typer.Option(metavar="WIDTH HEIGHT", help="Inside of the flask; of tube and pocket."),
    ] = None,
    hole_mm: Annotated[
        tuple[float, float] | None,
        typer.Option(metavar="WIDTH DEPTH", help="Of tube and pocket."),
    ] = None,
    opens: Annotated[
        Literal["down", "up"] | None,
        typer.Option(help="Side that the pocket is open to; one that opens sideways is a tube."),
    ] = None,
    drawing: Annotated[
        Path | None,
        typer.Option(help="Part or casting as STL in mm, or as STEP.", show_default="an example"),
    ] = None,
) -> None:
    """Write a short study with a comment on each line, to change it."""
    options = {k: v for k, v in locals().items() if v is not None and k not in ("name", "file")}
    from sandmould.reference.new_study import write_new_study
    from sandmould.runs.formatting import runs_text

    path = file or Path(f"my_{name}.yaml")
    path = path if path.suffix else path.with_suffix(".yaml")
    plan = write_new_study(name, path, options)
    typer.echo(
        f"{path}: {runs_text(len(plan.runs))}. Change what is not yours; each line says how."
    )
    typer.echo(f"sandmould plan {path} says what they take.")
