"""The file of a study that the command line gives by its path or by its name."""

from __future__ import annotations

import difflib
from pathlib import Path

from sandmould import SHIPPED
from sandmould.bad_input import BadInputError, Problem

STUDIES = SHIPPED / "config" / "studies"


def study_file(text: str) -> Path:
    """Find the file of a study.

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
    if path.suffix in (".yaml", ".yml"):
        sentence = f"there is no such file in {path.parent.resolve()}"
        sentence += f" (did you mean the shipped study {' or '.join(near)}?)" if near else ""
        raise BadInputError([Problem("STUDY", text, "a study's file", path.name, sentence)])
    names = ", ".join(near or ["tube_demo"])
    own = f", such as {text}.yaml" if Path(f"{text}.yaml").is_file() else ""
    valid = (
        f"the path of a study's file{own}, or the name of a shipped study, such as {names}; "
        f"all of them lie in {STUDIES}"
    )
    raise BadInputError([Problem("STUDY", text, valid)])


def shipped_studies(start: str = "") -> list[str]:
    """Names of the studies of ``config/studies``, those that begin so."""
    return sorted(p.stem for p in STUDIES.glob("*.yaml") if p.stem.startswith(start))
