"""The verbs of ``sandmould``.

A verb is one function with typed parameters: its docstring is the help, and what it calls is
imported in its body, so that no verb waits for the imports of another.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from sandmould.cli.study_file import shipped_studies, study_file
from sandmould.scenario.bad_input import BadInputError, Problem

StudyFile = Annotated[
    Path,
    typer.Argument(
        metavar="STUDY",
        parser=study_file,
        autocompletion=shipped_studies,
        help="A study's file, or the name of a shipped study, such as tube_demo.",
    ),
]
Cores = Annotated[
    int | None,
    typer.Option(min=1, show_default="all", help="Cores of this machine that share the runs."),
]


class _Verbs(TyperGroup):
    """Verbs that say what is wrong with an input in one sentence a problem."""

    def invoke(self, ctx: Any) -> Any:
        """Call a verb; status 1 after bad input."""
        try:
            return super().invoke(ctx)
        except BadInputError as error:
            typer.echo(error, err=True)
            raise typer.Exit(1) from None
        except OSError as error:
            if error.filename is None:  # no file of the user's: a fault of ours or of the machine
                raise
            typer.echo(f"{error.filename}: {error.strerror}", err=True)
            raise typer.Exit(1) from None


app = typer.Typer(
    name="sandmould",
    cls=_Verbs,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"sandmould {version('sandmould')}")
        raise typer.Exit


@app.callback()
def sandmould(
    _version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Print it and end."),
    ] = False,
) -> None:
    """Sand moulds for lost-foam casting: plan, run and report studies; results go to ./results."""


@app.command()
def plan(study: StudyFile, cores: Cores = None) -> None:
    """Check a study, print its runs and their price; nothing starts."""
    from sandmould.study.plan.build_plan import RESULTS, announce, open_plan

    typer.echo(announce(open_plan(study), RESULTS, cores or _all_cores(), measure=True))


@app.command()
def run(
    study: StudyFile,
    options: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[-- SNAKEMAKE'S OPTIONS]", help="Such as -- --workflow-profile slurm"
        ),
    ] = None,
    cores: Cores = None,
) -> None:
    """Compute a study, or what is missing of it; write its report."""
    from sandmould.study.run_study import run_study

    of_cores = [] if cores is None else ["--cores", str(cores)]
    raise typer.Exit(run_study(study, [*of_cores, *(options or [])]))


@app.command()
def status(study: StudyFile, cores: Cores = None) -> None:
    """Say where a study stands and what is left of it."""
    from sandmould.study.plan.build_plan import RESULTS, open_plan
    from sandmould.study.status import status_text

    typer.echo(status_text(open_plan(study), RESULTS, cores or _all_cores()))


@app.command()
def measures(study: StudyFile) -> None:
    """List what runs of a study can be measured by, with units."""
    from sandmould.study.plan.load_study import open_study
    from sandmould.study.reference import measures_text

    typer.echo(measures_text(open_study(study)))


@app.command()
def report(study: StudyFile) -> None:
    """Write the report of a study again from its results."""
    from sandmould.report.page import write_report
    from sandmould.study.plan.build_plan import RESULTS

    folder = RESULTS / study.stem
    if not (folder / "runs.tsv").is_file():
        valid = f"a study with results: sandmould run {study.stem} comes first"
        raise BadInputError([Problem("STUDY", study.stem, valid)])
    page = folder / "report.html"
    try:
        write_report(folder, page)
    except (OSError, ValueError) as error:
        valid = f"a folder of results that can be read ({error})"
        raise BadInputError([Problem("results", str(folder), valid)]) from error
    typer.echo(f"The report: {page}")


def _all_cores() -> int:
    return os.cpu_count() or 1
