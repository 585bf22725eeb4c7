"""One run of a deck as it is, or with savings taken out: its time, and a digest of its end.

``python -m benchmarks.lammps_decks.variants SCENE.json NAME`` prints what ``timed`` gives.
"""

from __future__ import annotations

import argparse
import json
import re
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from sandmould.digest import SHORT, digest
from sandmould.engines.deck import Deck
from sandmould.engines.program import build_program
from sandmould.engines.registry import engine_of
from sandmould.scenario.scenario import Scenario

BEFORE, NEAR, BOTH = "before", "near grains", "near grains, sorted"
VARIANTS = (BEFORE, NEAR, BOTH)


def without_near_grains(text: str) -> str:
    """The deck with walls that look at all grains in every step."""
    text = re.sub(r"^(fix wall_\w+) near_\w+ ", r"\1 all ", text, flags=re.M)
    text = re.sub(r"^fix near all halt .*\n", "", text, flags=re.M)
    return re.sub(r"(variable near_(?:again|all) string )'[^']*'", r"""\1'"print again"'""", text)


def varied(text: str, variant: str) -> str:
    """The deck of a variant."""
    if variant == BEFORE:
        text = without_near_grains(text)
    if variant != BOTH:
        text = text.replace("sort 500 0.0", "sort 0 0")
    return text


def timed(scenario: Scenario, variant: str) -> dict[str, Any]:
    """Run a deck through a session; processor time of the loop alone, s.

    Parameters
    ----------
    scenario : Scenario
        On engine lammps.
    variant : str
        One of ``VARIANTS``.
    """
    program, engine = build_program(scenario), engine_of(scenario)
    with TemporaryDirectory() as name:
        folder = Path(name)
        engine.write_deck(program, {}, folder, variant, "lammps_decks")
        Deck(varied((folder / "deck.in").read_text(encoding="utf-8"), variant)).write(folder)
        session = engine.open_session(program, folder, folder / "engine.log")
        stages = {}
        for stage in program.stages:
            if stage.layer:
                session.insert_layer(stage.layer)
            session.start_stage(stage)
            steps, begun = session.steps, time.process_time()
            while not session.stage_over:
                session.advance()
            stages[stage.name] = {
                "grain_steps": session.grains * (session.steps - steps),
                "cpu_s": time.process_time() - begun,
            }
            session.end_stage()
        end = session.snapshot()
        session.close()
    state = (end.position_m, end.velocity_m_s, end.spin_rad_s)
    return {
        "grains": len(end.id),
        "stages": stages,
        "digest": digest(*(array.tobytes().hex() for array in state))[:SHORT],
    }


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", type=Path)
    parser.add_argument("variant")
    options = parser.parse_args()
    scene = Scenario.model_validate_json(options.scene.read_text(encoding="utf-8"))
    print(json.dumps(timed(scene, options.variant)))
