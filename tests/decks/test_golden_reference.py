"""The reference engine's listing against a golden file; the solver's hash is left out of it."""

from __future__ import annotations

from pathlib import Path

import pytest

from sandmould.dem import source_hash
from sandmould.engines.bed_step import with_bed_step
from sandmould.engines.program import build_program
from sandmould.engines.reference.engine import write_deck
from sandmould.scenario.scenario import Scenario
from tests.hopper import hopper_scene
from tests.scenes import tube_scene

GOLDEN = Path(__file__).parent / "golden"
SCENES = {
    "reference_tube_2d": tube_scene(engine={"name": "reference"}),
    "reference_hopper": hopper_scene("reference"),
    "reference_step_of_bed": with_bed_step(
        tube_scene(engine={"name": "reference"}, time_step={"bed_fraction": 0.7}), 4e-5
    ),
}


@pytest.mark.parametrize(("name", "scene"), SCENES.items(), ids=SCENES)
def test_deck_equals_its_golden_file(
    name: str, scene: Scenario, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    program, golden = build_program(scene), GOLDEN / f"{name}.in"
    write_deck(program, {}, tmp_path, "test", "golden")
    text = (tmp_path / "deck.in").read_text(encoding="utf-8").replace(source_hash(), "HASH")
    if request.config.getoption("--refresh-golden"):
        golden.write_text(text, encoding="utf-8")
    assert text == golden.read_text(encoding="utf-8"), "pytest tests/decks --refresh-golden"
    rows = (tmp_path / "layers" / "layer_1.tsv").read_text(encoding="utf-8").splitlines()
    assert rows[0] == "class\tradius_m\tx_m\ty_m"
    assert len(rows) == 1 + program.counts[0]
