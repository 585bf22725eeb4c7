"""Rounds of a study from two machines: one goes on from the other, or ours stay."""

from __future__ import annotations

from pathlib import Path

from sandmould.runs.files import replaced
from sandmould.study.rounds.round_log import ROUNDS_FILE, RoundLog, log_of


def merge_rounds(text: bytes, folder: Path) -> str:
    """Take rounds that go on from those of a folder, or where it has none.

    Parameters
    ----------
    text : bytes
        Of a ``rounds.json``.
    folder : Path
        ``results/<study>``.

    Returns
    -------
    str
        What became of them, where a person should know.

    Raises
    ------
    ValueError
        When the text is no list of rounds.
    """
    theirs = log_of(text)
    path = folder / ROUNDS_FILE
    if path.is_file():
        ours = log_of(path.read_bytes())
        if _goes_on(ours, theirs):
            return ""
        if not _goes_on(theirs, ours):
            return f"its rounds chose other runs than those of {path}, which stay"
    with replaced(path) as partial:
        partial.write_bytes(text)
    return ""


def _goes_on(log: RoundLog, earlier: RoundLog) -> bool:
    """Whether rounds begin with all earlier ones."""
    number = len(earlier.rounds)
    same = log.basis == earlier.basis and log.rounds[:number] == earlier.rounds
    more = len(log.rounds) > number or earlier.ended in ("", log.ended)
    return same and more and earlier.certified_hz in ((), log.certified_hz)
