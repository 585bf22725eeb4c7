"""What a file says of a value's source stays a remark of the deck, on every engine."""

from __future__ import annotations

import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from sandmould.engines.deck import Deck, remark
from sandmould.engines.lammps import render as lammps
from sandmould.engines.liggghts import render as liggghts
from sandmould.engines.liggghts.process import executable
from sandmould.engines.program import build_program
from sandmould.engines.reference.engine import write_deck
from sandmould.scenario.scenario import Scenario
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from tests.decks.test_deck_by_hand import LMP
from tests.liggghts_scenes import liggghts_scene, needs_liggghts
from tests.scenes import tube_scene

HOSTILE = (
    "mine\nshell touch hit",
    "mine\r\nshell touch hit",
    "mine\x0bshell touch hit\x0cshell touch hit",
    "mine\u2028shell touch hit\x85shell touch hit",
    "mine &",
    "mine &\t",
    'mine """',
    "mine\n#--- end: header ---\n#--- block: box ---\nshell touch hit",
    "${gravity} $(1/0) `touch hit` $(touch hit) '",
    "x" * 5000,
)


class _Same(dict[str, str]):
    """One source for every key."""

    def __init__(self, source: str) -> None:
        super().__init__()
        self._source = source

    def __contains__(self, key: object) -> bool:
        return True

    def __getitem__(self, key: str) -> str:
        return self._source


def _decks(sources: Mapping[str, str], name: str, folder: Path) -> dict[str, Deck]:
    """Decks of small scenes; a name stands for those of run and study."""
    on_lammps, on_liggghts = build_program(tube_scene()), build_program(liggghts_scene())
    write_deck(build_program(_reference()), sources, folder, name, name)
    return {
        "lammps": lammps.render_deck(on_lammps, sources, name, name),
        "liggghts": liggghts.render_deck(on_liggghts, sources, name, name),
        "reference": Deck.read(folder / "deck.in"),
    }


def _reference() -> Scenario:
    scene = tube_scene()
    return scene.model_copy(
        update={"engine": scene.engine.model_copy(update={"name": "reference"})}
    )


@pytest.mark.parametrize("source", HOSTILE, ids=range(len(HOSTILE)))
def test_a_source_adds_no_command_and_hides_none(source: str, tmp_path: Path) -> None:
    plain = _decks(_Same("mine"), "run", tmp_path)
    for engine, deck in _decks(_Same(source), source, tmp_path).items():
        assert deck.commands == plain[engine].commands
        assert list(deck.blocks) == list(plain[engine].blocks)
        before = plain[engine].text.splitlines()
        for line, as_plain in zip(deck.text.splitlines(), before, strict=True):
            assert line.rstrip().endswith("&") == as_plain.rstrip().endswith("&")
            assert line.count('"""') == as_plain.count('"""')
            assert len(line) < 2048


@pytest.mark.parametrize("engine", ["lammps", pytest.param("liggghts", marks=needs_liggghts)])
def test_the_engine_itself_runs_none(engine: str, tmp_path: Path) -> None:
    command = LMP if engine == "lammps" else str(executable())
    texts = [
        _decks(_Same(source), source, tmp_path)[engine].blocks["header"].text for source in HOSTILE
    ]
    # each header is read by an engine that knows nothing yet, and to its end
    deck = "".join(f"clear\n{text}print 'header {n}'\n" for n, text in enumerate(texts))
    (tmp_path / "hostile.in").write_text(deck, encoding="utf-8")
    said = subprocess.run(
        [command, "-in", "hostile.in"], cwd=tmp_path, capture_output=True, text=True, timeout=60
    ).stdout
    assert not (tmp_path / "hit").exists()
    assert all(f"\nheader {n}\n" in said for n in range(len(HOSTILE))), said[-2000:]


def test_the_source_in_a_study_is_such_a_text(tmp_path: Path) -> None:
    (tmp_path / "trial.yaml").write_text(
        "based_on: tube_demo\nmaterial: null\nscenario: {contact: {grain_grain: {friction: "
        '{value: 0.5, unit: "1", source: "mine\\nshell touch hit"}}}}\n'
    )
    run = expand(open_study(tmp_path / "trial.yaml"))[0]
    deck = lammps.render_deck(build_program(run.scenario), run.sources, run.run, run.study)
    assert "mine shell touch hit" in deck.text
    assert "shell" not in deck.commands


@pytest.mark.parametrize(
    ("text", "line"),
    [("Rojek 2004, eq. (26)", "Rojek 2004, eq. (26)"), ("a\n b\tc", "a b c"), ("", "")],
)
def test_a_plain_source_stays_as_it_is(text: Any, line: str) -> None:
    assert remark(text) == line
