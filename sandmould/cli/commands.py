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

from sandmould.bad_input import BadInputError, Problem
from sandmould.cli.new import new
from sandmould.cli.study_file import shipped_studies, study_file

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


Adopt = Annotated[
    bool,
    typer.Option("--adopt", help="Take over results that belong to another file of its name."),
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


def _key_paths(start: str) -> list[str]:
    from sandmould.reference.keys import key_paths

    return key_paths(start)


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


app.command(epilog="Example: sandmould new tube --amplitude-mm 0.4 --frequency-hz 20 60")(new)


@app.command(epilog="Example: sandmould plan tube_demo --cores 4")
def plan(study: StudyFile, cores: Cores = None, adopt: Adopt = False) -> None:
    """Check a study, print its runs and their price; nothing starts."""
    from sandmould.study.plan.announcement import announce
    from sandmould.study.plan.build_plan import RESULTS, open_plan
    from sandmould.study.plan.trust import reading_help

    if adopt:
        _adopt(study)
    opened = open_plan(study)
    typer.echo(announce(opened, RESULTS, cores or _all_cores(), measure="engines"))
    if said := reading_help(opened.study, opened.runs):
        typer.echo(said)


@app.command(epilog="Example: sandmould run my_study.yaml")
def run(
    study: StudyFile,
    options: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[-- SNAKEMAKE'S OPTIONS]", help="Such as -- --workflow-profile slurm"
        ),
    ] = None,
    cores: Cores = None,
    adopt: Adopt = False,
    cluster: Annotated[
        bool,
        typer.Option(
            "--cluster", help="Submit the runs to Slurm; ./cluster.yaml says to which partition."
        ),
    ] = False,
    detach: Annotated[
        bool,
        typer.Option("--detach", help="The same by a small job, so that you can log out."),
    ] = False,
) -> None:
    """Compute a study, or what is missing of it; write its report."""
    from sandmould.execution.run_study import run_study

    if adopt:
        _adopt(study)
    profile = ["--workflow-profile", "slurm"] if cluster or detach else []
    given = [*_cores_option(cores), *profile, *(options or [])]
    if not detach:
        raise typer.Exit(run_study(study, given))
    from sandmould.execution.cluster.driver import submit_driver

    typer.echo(submit_driver(study, given))


@app.command(epilog="Example: sandmould demo --quick")
def demo(
    quick: Annotated[
        bool, typer.Option("--quick", help="A coarse one of a minute, to try the installation.")
    ] = False,
    cores: Cores = None,
) -> None:
    """Compute the demonstration: a coarse tube at a few settings."""
    from sandmould.execution.run_study import run_study

    study = study_file("tube_quick" if quick else "tube_demo")
    opening = "The installation works." if quick else ""
    raise typer.Exit(run_study(study, _cores_option(cores), opening))


@app.command(epilog="Example: sandmould again tube_demo/frequency_25_r1_45f4dc")
def again(
    runs: Annotated[
        list[str],
        typer.Argument(metavar="RUN...", help="Names of runs, or STUDY/RUN; any study's."),
    ],
    cores: Cores = None,
    later: Annotated[
        bool, typer.Option("--later", help="Leave computing them to the next run of the study.")
    ] = False,
) -> None:
    """Compute runs once more, such as failed ones."""
    from sandmould.execution.again import forget
    from sandmould.execution.run_study import run_study
    from sandmould.study.plan.build_plan import RESULTS

    studies = forget(runs, RESULTS)
    if not later:
        raise typer.Exit(max(run_study(study, _cores_option(cores)) for study in studies))
    for study in studies:
        typer.echo(f"sandmould run {study} computes them again.")


@app.command(epilog="Example: sandmould status my_study.yaml")
def status(
    study: StudyFile,
    cores: Cores = None,
    deep: Annotated[
        bool, typer.Option("--deep", help="Compare each file of each run with its hash, too.")
    ] = False,
) -> None:
    """Say where a study stands and what is left of it."""
    from sandmould.execution.status import status_text
    from sandmould.study.plan.build_plan import RESULTS, open_plan

    typer.echo(status_text(open_plan(study), RESULTS, cores or _all_cores(), deep))


@app.command(epilog="Example: sandmould tidy my_study.yaml --yes")
def tidy(
    study: StudyFile,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask first.")] = False,
) -> None:
    """Remove run folders that a study no longer lists."""
    from sandmould.execution.tidy import leftovers, remove
    from sandmould.runs.formatting import size_text
    from sandmould.study.plan.build_plan import RESULTS, open_plan

    opened = open_plan(study)
    found = leftovers(opened, RESULTS)
    for folder, why in found.kept.items():
        typer.echo(f"stays: {folder.name}, since {why}")
    if not found.removable:
        typer.echo(f"{opened.study.name}: no run folder to remove")
        return
    for folder in found.removable:
        typer.echo(f"  {folder.name}")
    number, size = len(found.removable), size_text(found.freed_bytes)
    if yes or typer.confirm(f"Remove {number} run folders and free {size}?"):
        remove(opened, RESULTS, found.removable)
        typer.echo(f"{number} run folders removed, {size} freed")


@app.command(epilog="Example: sandmould pack my_study.yaml -o runs.zip")
def pack(
    study: StudyFile,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="FILE", show_default="STUDY_runs.zip",
            help="File to write.",
        ),
    ] = None,
    last_state: Annotated[
        bool,
        typer.Option(
            "--last-state", help="Leave out exports and all snapshots but the last: no films."
        ),
    ] = False,
    outside_files: Annotated[
        bool,
        typer.Option(
            "--outside-files", help="Take copies of files from outside the study's folder along."
        ),
    ] = False,
) -> None:  # fmt: skip
    """Pack the finished runs of a study into one file."""
    from sandmould.execution.packs.pack import pack as pack_study
    from sandmould.study.plan.build_plan import RESULTS, open_plan

    plan = open_plan(study)
    typer.echo(
        pack_study(plan, RESULTS, output, last_state=last_state, outside_files=outside_files)
    )


@app.command(epilog="Example: sandmould unpack runs.zip")
def unpack(
    files: Annotated[
        list[Path], typer.Argument(metavar="FILE...", help="What sandmould pack wrote.")
    ],
) -> None:
    """Take packed runs into ./results."""
    from sandmould.execution.packs.unpack import unpack as unpack_runs
    from sandmould.study.plan.build_plan import RESULTS

    for file in files:
        typer.echo(unpack_runs(file, RESULTS))


@app.command(epilog="Example: sandmould measures tube_demo")
def measures(study: StudyFile) -> None:
    """List what runs of a study can be measured by, with units."""
    from sandmould.reference.reference import measures_text
    from sandmould.study.plan.load_study import open_study

    typer.echo(measures_text(open_study(study)))


@app.command(epilog="Example: sandmould keys scenario.vibration")
def keys(
    path: Annotated[
        str,
        typer.Argument(
            metavar="[PATH]", autocompletion=_key_paths, help="Such as scenario.vibration."
        ),
    ] = "",
) -> None:
    """Explain the keys of a study's file: unit, default, meaning."""
    from sandmould.reference.keys import keys_text

    typer.echo(keys_text(path))


@app.command(epilog="Example: sandmould doctor")
def doctor() -> None:
    """Say what the installation has, and what is missing."""
    from sandmould.reference.installation import doctor_text, findings
    from sandmould.study.plan.build_plan import RESULTS

    typer.echo(doctor_text(findings(RESULTS)))


@app.command(epilog="Example: sandmould show my_study.yaml -o scene.html")
def show(
    study: StudyFile,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="FILE",
            show_default="STUDY_scene.png, or STUDY_scene.html in 3D",
            help="A picture (.png, .svg) or a page (.html).",
        ),
    ] = None,
    run: Annotated[
        str | None,
        typer.Option(
            "--run", metavar="RUN", show_default="the first", help="Of runs that differ, which."
        ),
    ] = None,
) -> None:  # fmt: skip
    """Draw a scene of sand, or a casting, to scale before anything runs."""
    from sandmould.report.scene_page import draw_scene_file, usual_ending
    from sandmould.study.plan.drawn_run import drawn_run

    opened, shown = drawn_run(study, run)
    out = output or Path(f"{opened.name}_scene{usual_ending(shown.scenario)}")
    draw_scene_file(shown.scenario, opened.study.title or opened.name, shown.run, out)
    typer.echo(out)


@app.command(epilog="Example: sandmould export tube_demo/frequency_25_r1_45f4dc")
def export(
    runs: Annotated[
        list[str],
        typer.Argument(metavar="RUN...", help="Names of measured runs, STUDY/RUN, or folders."),
    ],
) -> None:
    """Draw the end of runs, and write files for ParaView and OVITO."""
    from sandmould.execution.again import run_folders
    from sandmould.execution.simulate import export_run
    from sandmould.study.plan.batches import is_done
    from sandmould.study.plan.build_plan import RESULTS, writing

    folders, problems = run_folders(runs, RESULTS)
    problems += [Problem("RUN", f.name, "a run at its end") for f in folders if not is_done(f)]
    if problems:
        raise BadInputError(problems)
    for folder in folders:
        with writing(folder):
            export_run(folder)
        typer.echo(folder)


@app.command(epilog="Example: sandmould report my_study.yaml")
def report(
    study: StudyFile,
    xlsx: Annotated[
        bool,
        typer.Option("--xlsx", help="Write report.xlsx too: settings and runs in mm, Hz, g, °C."),
    ] = False,
) -> None:
    """Write the report of a study again from its results."""
    from sandmould.execution.screen.ending import last_line
    from sandmould.report.page import write_report
    from sandmould.study.plan.build_plan import RESULTS, changed_since
    from sandmould.study.plan.ownership import check_owner
    from sandmould.study.plan.plan_files import SPREADSHEET, SUMMARY

    folder = RESULTS / study.stem
    check_owner(study, folder)
    if not (folder / "runs.tsv").is_file():
        valid = f"a study with results: sandmould run {study.stem} comes first"
        raise BadInputError([Problem("STUDY", study.stem, valid)])
    if not (folder / SUMMARY).is_file():
        valid = f"a folder with {SUMMARY}, which is missing: sandmould run {study.stem} writes it"
        raise BadInputError([Problem("results", str(folder), valid)])
    page, said = folder / "report.html", changed_since(study, folder)
    try:
        if xlsx:
            from sandmould.report.spreadsheet import write_spreadsheet

            write_spreadsheet(folder, folder / SPREADSHEET)
        write_report(folder, page)
    except (ValueError, FileNotFoundError) as error:
        valid = f"a folder of results that can be read ({error})"
        raise BadInputError([Problem("results", str(folder), valid)]) from error
    if said:
        typer.echo(said)
    typer.echo(last_line(folder))


@app.command(epilog="Example: sandmould compare tube_frequency tube_frequency_stroke")
def compare(
    studies: Annotated[
        list[str],
        typer.Argument(
            metavar="STUDY...",
            autocompletion=shipped_studies,
            help="Finished studies, or their folders of results.",
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="FILE", show_default="A_B_compared.html",
            help="The page; its picture lies beside it as .svg.",
        ),
    ] = None,
) -> None:  # fmt: skip
    """Put finished studies side by side: table, picture and page."""
    from sandmould.report.comparison import read_comparison, write_comparison
    from sandmould.study.plan.build_plan import RESULTS

    folders = [
        next((path for path in (Path(each), RESULTS / each) if path.is_dir()), None)
        or RESULTS / study_file(each).stem
        for each in studies
    ]
    compared = read_comparison(folders)
    out = output or Path(
        "_".join([*(folder.resolve().name for folder in folders), "compared.html"])
    )
    picture = write_comparison(compared, out)
    typer.echo(compared.text())
    typer.echo(f"\n{out}\n{picture}")


def _adopt(study: Path) -> None:
    """Let results belong to a study that is sound."""
    from sandmould.study.plan.build_plan import RESULTS
    from sandmould.study.plan.load_study import open_study
    from sandmould.study.plan.ownership import write_owner

    write_owner(study, RESULTS / open_study(study).name)


def _cores_option(cores: int | None) -> list[str]:
    return [] if cores is None else ["--cores", str(cores)]


def _all_cores() -> int:
    return os.cpu_count() or 1
