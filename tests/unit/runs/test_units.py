"""Units as a person reads them."""

from __future__ import annotations

from sandmould import ROOT
from sandmould.runs.formatting import unit_of

OF_SECTIONS = ("initial_k", "sieve")
"""Keys that hold several values."""


def test_the_unit_of_every_key_is_told_as_declared() -> None:
    """The page of keys is made from the declarations."""
    rows = [
        [cell.strip(" `") for cell in line.split("|")]
        for line in (ROOT / "docs" / "keys.md").read_text(encoding="utf-8").splitlines()
        if line.startswith("| `")
    ]
    plain = str.maketrans({"²": "2", "³": "3"})
    wrong = {}
    for _, key, declared, *_ in rows:
        unit = {"-": "", "1": "", "deg": "°"}.get(declared, declared)
        # the unit of another key or column stands in no name
        if key in OF_SECTIONS or unit.startswith("of the ") or key in ("casting", "mould"):
            continue
        if unit_of(key).translate(plain) != unit:
            wrong[key] = declared, unit_of(key)
    assert len(rows) > 300
    assert not wrong
