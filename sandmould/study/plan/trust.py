"""What a study may read and execute that is not shipped: its folders, its word for a program."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from sandmould import ROOT
from sandmould.bad_input import BadInputError, Problem, display_path
from sandmould.definition.run import Run
from sandmould.kinds.kind import AnyScenario
from sandmould.kinds.registry import kind_named
from sandmould.runs.formatting import listed
from sandmould.study.plan.load_study import OpenStudy, from_root


def outside(study: OpenStudy, scenario: AnyScenario) -> list[Problem]:
    """Files of a user's program that lie where the study does not allow; links are followed.

    ``scenario``: that of any point, since files can be swept.

    Problems have their keys from the study's root.
    """
    program = kind_named(study.study.kind).planning.program
    if program is None:
        return []
    own = study.path.parent
    folders = [own, program.shipped, *(ROOT / name for name in study.study.more_folders)]
    allowed = [folder.resolve() for folder in folders]
    valid = (
        f"a file below the study's folder ({display_path(own.resolve())}) or below one of its "
        "allowed_folders"
    )
    return [
        study.as_written(Problem(f"scenario.{key}", from_root(path), valid))
        for key, path in program.files(scenario).items()
        if not any(path.resolve().is_relative_to(folder) for folder in allowed)
    ]


def carried(study: OpenStudy, scenario: AnyScenario) -> dict[str, str]:
    """Files from outside the study's folder that a run takes into its own: name there, name here.

    Those that are shipped are left out; links are followed.
    """
    program = kind_named(study.study.kind).planning.program
    if program is None:
        return {}
    known = [study.path.parent.resolve(), program.shipped.resolve()]
    return {
        f"{program.copied}/{path.name}": study.written.get(from_root(path), str(path))
        for path in program.files(scenario).values()
        if not any(path.resolve().is_relative_to(folder) for folder in known)
    }


def may_run(study: OpenStudy, runs: Sequence[Run]) -> bool:
    """Whether the user has allowed what the runs would execute, or all of it is shipped."""
    return study.study.trusts_program or not _foreign(study, runs)


def check_trust(study: OpenStudy, runs: Sequence[Run]) -> None:
    """See that the user has allowed what the runs would execute.

    Raises
    ------
    BadInputError
    """
    if not may_run(study, runs):
        foreign = _foreign(study, runs)
        valid = (
            f"true, once you have read the deck. This one is not shipped ({listed(foreign)}): it "
            "is a program that can read and change your files. sandmould plan names lines to look "
            f"at. To run it, write trust_deck: true in {study.file}"
        )
        raise BadInputError([Problem("trust_deck", False, valid, study.file)])


def check_places(study: OpenStudy) -> None:
    """See that no folder's name would be more than a name to a shell or to an engine.

    Snakemake hands a job's command to Slurm in double quotes, where a shell executes ``$(...)``;
    engines put variables, times and ranks in place of ``$``, ``*`` and ``%``.

    Raises
    ------
    BadInputError
    """
    places = {"STUDY": study.path.absolute(), "working folder": Path.cwd(), "installation": ROOT}
    problems = [
        Problem(key, str(path), f"a path without quotes, {' '.join(_SPECIAL)} and line breaks")
        for key, path in places.items()
        if not str(path).isprintable() or set(str(path)) & {*_SPECIAL, "'", '"'}
    ]
    if problems:
        raise BadInputError(problems)


def check_letters(runs: Sequence[Run]) -> None:
    """See that LAMMPS can read the names of its files, if any run needs it.

    In a working folder with other letters than ASCII a run fails while it is computed, with
    "'utf-8' codec can't decode byte".

    Raises
    ------
    BadInputError
    """
    engines = {getattr(getattr(run.scenario, "engine", None), "name", "") for run in runs}
    here = str(Path.cwd())
    if "lammps" in engines and not here.isascii():
        valid = "a folder of ASCII letters alone, since LAMMPS reads no other names"
        raise BadInputError([Problem("working folder", here, valid)])


_SPECIAL = "$`\\*%"


def reading_help(study: OpenStudy, runs: Sequence[Run]) -> str:
    """What a person should know of a program before running it; empty where all is shipped."""
    program = kind_named(study.study.kind).planning.program
    foreign = _foreign(study, runs)
    if program is None or not foreign:
        return ""
    points = {str(run.parameters): run.scenario for run in runs}
    beyond = {name for run in runs for name in carried(study, run.scenario).values()}
    taken = [f"{name} (from outside the study's folder, taken into results)" for name in beyond]
    lines = [*program.to_read(list(points.values())), *sorted(taken)] or ["none was found"]
    trusted = study.study.trusts_program
    return "\n".join(
        [
            f"This study runs a program: {listed(foreign)}. Lines to look at before you run it:",
            *(f"  {line}" for line in lines),
            *(
                [f"{taken}{listed(sorted(beyond), most=20)}. Packs leave them out."]
                if beyond
                else []
            ),
            "The list helps to read it and protects from nothing (docs/trust.md).",
            f"{study.file} allows it to run (trust_deck: true)."
            if trusted
            else f"To run it, write trust_deck: true in {study.file}.",
        ]
    )


def _foreign(study: OpenStudy, runs: Sequence[Run]) -> list[str]:
    """Why what the runs execute is not shipped: each reason once."""
    program = kind_named(study.study.kind).planning.program
    if program is None:
        return []
    reasons = (program.foreign(run.scenario) for run in runs)
    return list(dict.fromkeys(reason for reason in reasons if reason))
