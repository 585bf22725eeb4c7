"""The reference engine's listing against a golden file; the solver's hash is left out of it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from sandmould.dem import source_hash
from sandmould.dem.contact_law import Law
from sandmould.engines.bed_step import with_bed_step
from sandmould.engines.program import build_program
from sandmould.engines.reference.engine import render_deck, write_deck
from sandmould.scenario.contact import SYMBOLS
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


SWITCHES = {
    "no_tension": "elastic",
    "rolling_axes": "all",
    "dashpot": "plain",
    "slip_normal": "full_step",
}
"""Each key of the law that is no number, at another value than its default."""


def without_hashes(text: str) -> str:
    return re.sub(r"; scenario \w+;", "; scenario HASH;", text.replace(source_hash(), "HASH"))


def listed(scene: Scenario) -> str:
    return render_deck(build_program(scene), {}, "test", "switches").text


@pytest.mark.parametrize(("name", "scene"), SCENES.items(), ids=SCENES)
def test_deck_equals_its_golden_file(
    name: str, scene: Scenario, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    program, golden = build_program(scene), GOLDEN / f"{name}.in"
    write_deck(program, {}, tmp_path, "test", "golden")
    text = without_hashes((tmp_path / "deck.in").read_text(encoding="utf-8"))
    if request.config.getoption("--refresh-golden"):
        golden.write_text(text, encoding="utf-8")
    assert text == golden.read_text(encoding="utf-8"), "pytest tests/decks --refresh-golden"
    rows = (tmp_path / "layers" / "layer_1.tsv").read_text(encoding="utf-8").splitlines()
    assert rows[0] == "class\tradius_m\tx_m\ty_m"
    assert len(rows) == 1 + program.counts[0]


def scene_in_space(**contact: str) -> Scenario:
    changes = {"box": {"depth_m": 0.05}, "fill": {"layers": [{"count": 60}]}}
    return tube_scene(engine={"name": "reference"}, dimension=3, contact=contact, **changes)


@pytest.mark.parametrize(("key", "value"), SWITCHES.items())
def test_a_switch_of_the_law_is_listed(key: str, value: str) -> None:
    before, after = listed(scene_in_space()), listed(scene_in_space(**{key: value}))
    changed = set(without_hashes(after).splitlines()) - set(without_hashes(before).splitlines())
    # Beside it the time step may be another.
    assert sum(f" {value} " in line for line in changed) == 1


def test_no_switch_of_the_law_is_forgotten() -> None:
    def law(**contact: str) -> dict[str, Any]:
        laws = scene_in_space(**contact).laws
        return laws.parameters(laws.grain_grain, 3, 1e-5)

    given = law()
    switched = [law(**{key: value}) for key, value in SWITCHES.items()]
    fields = {name for one in switched for name in one if one[name] != given[name]}
    assert fields == set(Law._fields) - SYMBOLS.keys()


def test_another_shape_is_another_deck() -> None:
    engine = {"name": "reference"}
    lower, higher = (tube_scene(engine=engine, box={"height_m": h}) for h in (0.08, 0.09))
    assert listed(lower) != listed(higher)
