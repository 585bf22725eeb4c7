"""The file of a study that the command line gives by its path or by its name."""

from __future__ import annotations

import difflib
from pathlib import Path

from sandmould import SHIPPED
from sandmould.scenario.bad_input import BadInputError, Problem

STUDIES = SHIPPED / "config" / "studies"


def study_file(text: str) -> Path:
    """Find the file of a study.

    Parameters
    ----------
    text : str
        Path of a file, or the name of a study of ``config/studies``.

    Raises
    ------
    BadInputError
        When there is no such file; it gives the nearest names.
    """
    shipped = STUDIES / f"{text}.yaml"
    if text in shipped_studies():
        return shipped
    path = Path(text)
    if path.is_file():
        return path
    near = difflib.get_close_matches(path.stem, shipped_studies(), n=3, cutoff=0.5)
    names = ", ".join(near or shipped_studies())
    valid = f"the path of a study's file, or the name of a shipped study, such as {names}"
    raise BadInputError([Problem("STUDY", text, valid)])


def shipped_studies(start: str = "") -> list[str]:
    """Names of the studies of ``config/studies``, those that begin so."""
    return sorted(p.stem for p in STUDIES.glob("*.yaml") if p.stem.startswith(start))
