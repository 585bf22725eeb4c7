"""The reference engine's listing against a golden file; the solver's hash is left out of it."""

from __future__ import annotations

from pathlib import Path

import pytest

from sandmould.dem import source_hash
from sandmould.engines.program import build_program
from sandmould.engines.reference.engine import write_deck
from tests.scenes import tube_scene

GOLDEN = Path(__file__).parent / "golden" / "reference_tube_2d.in"


def test_deck_equals_its_golden_file(tmp_path: Path, request: pytest.FixtureRequest) -> None:
    program = build_program(tube_scene(engine={"name": "reference"}))
    write_deck(program, {}, tmp_path, "test", "golden")
    text = (tmp_path / "deck.in").read_text(encoding="utf-8").replace(source_hash(), "HASH")
    if request.config.getoption("--refresh-golden"):
        GOLDEN.write_text(text, encoding="utf-8")
    assert text == GOLDEN.read_text(encoding="utf-8"), "pytest tests/decks --refresh-golden"
    rows = (tmp_path / "layers" / "layer_1.tsv").read_text(encoding="utf-8").splitlines()
    assert rows[0] == "class\tradius_m\tx_m\ty_m"
    assert len(rows) == 1 + program.counts[0]
