"""Measures as each kind lists them are the columns that a run of it writes, no more and no less."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from sandmould.definition.run import Run
from sandmould.execution.simulate import measure_run, render_run, simulate
from sandmould.kinds.registry import kind_of
from sandmould.runs.columns import CLOCK
from sandmould.runs.measures import measures_of
from sandmould.scenario.casting.flow import MetalFlow
from sandmould.scenario.casting.solidification import Solidification
from sandmould.scenario.own_deck import OwnDeck
from sandmould.scenario.quantity import Section
from sandmould.scenario.scenario import Scenario
from tests.hopper import DEEP, hopper_scene
from tests.instep import bed_scene
from tests.planned import write_plan
from tests.scenes import tube_scene

PIT = {"kind": "box", "name": "pit", "centre_m": [0.03, 0.03], "size_m": [0.04, 0.04]}
BRIEF: dict[str, Any] = {
    "fill": {"layers": [{"count": 40}], "settling": {"shortest_s": 0.01}},
    "rest": {
        "rms_speed_m_s": 10, "discharge_rms_speed_m_s": 10, "load_tolerance": None, "checks": 1,
    },
    "vibration": [],
    "engine": {"name": "reference"},
}  # fmt: skip
"""One layer that counts as settled at once: columns are asked for here, not numbers."""
TUBE_IN_3D = {"dimension": 3, "box": {"depth_m": 0.03}, "time_step": {"fraction": 0.5}}
DAM = {
    "box": {"width_m": 0.12, "height_m": 0.12},
    "obstacles": [
        {"kind": "plate", "name": "gate", "centre_m": [0.06, 0.06], "size_m": [0.004, 0.12]}
    ],
    "sand": {"size_scale": 4.0, "size_classes": 3, "disc_thickness_m": 0.1},
    "discharge": {"gate": "gate", "duration_s": 0.01},
}
STEEL = {
    "name": "steel", "density_kg_m3": 7200, "heat_capacity_j_kg_k": 711, "conductivity_w_m_k": 29,
    "latent_heat_j_kg": 272e3, "solidus_k": 1713, "liquidus_k": 1773,
}  # fmt: skip
SAND = {"density_kg_m3": 1600, "heat_capacity_j_kg_k": 1130, "conductivity_w_m_k": 1.3}
LOG = """\
units lj
dimension 2
lattice sq 0.5
region box block 0 4 0 4 -0.5 0.5
create_box 1 box
create_atoms 1 box
mass 1 1
pair_style zero 1.0
pair_coeff * *
fix motion all nve
variable height equal xcm(all,y)
thermo_style custom step time v_height
run 2
"""


def bed(scheme: str) -> Scenario:
    told = dict(bed_scene().model_dump(mode="json")["pattern"], loop={"scheme": scheme})
    return bed_scene(**{**BRIEF, "pattern": told})


def hopper(**changes: Any) -> Scenario:
    brief = {key: BRIEF[key] for key in ("fill", "rest", "vibration")}
    discharge = {"gate": "gate", "duration_s": 0.01}
    return hopper_scene("reference", **brief | {"discharge": discharge} | changes)


def casting(dimensions: int) -> Solidification:
    box = {"low_m": [0.0] * dimensions, "high_m": [0.04] * dimensions}
    middle = {"low_m": [0.01] * dimensions, "high_m": [0.03] * dimensions}
    return Solidification.model_validate(
        {
            "casting": STEEL, "mould": SAND, "initial_k": {"casting": 1800, "mould": 293},
            "box": box, "shapes": [{"kind": "rectangle", **middle}], "element_m": 0.01,
            "probes": [{"name": "middle", "at_m": [0.02] * dimensions}], "until_s": 20,
        }
    )  # fmt: skip


def flow(**case: Any) -> MetalFlow:
    return MetalFlow.model_validate(
        {"case": case, "duration_s": 0.01, "record_s": 0.005, "dt_max_s": 0.002}
    )


SHAKE = {"frequency_hz": 200, "duration_s": 0.01}
TABLE = {"moment_kg_m": 1e-3, "moving_mass_kg": 60, "mount_frequency_hz": 8, "flask_depth_m": 0.3}
SCENES = {
    "tube": lambda: tube_scene(**BRIEF),
    "vibration": lambda: tube_scene(**BRIEF | {"vibration": [SHAKE | {"acceleration_g": 1}]}),
    "table with an unbalance": lambda: tube_scene(
        **BRIEF | {"vibration": [SHAKE | {"hold": "unbalance", "unbalance": TABLE}]}
    ),
    "cavity": lambda: tube_scene(**BRIEF, cavities=[PIT]),
    "tube in 3D": lambda: tube_scene(**BRIEF, **TUBE_IN_3D),
    "level gate": hopper,
    "level gate in 3D": lambda: hopper(**DEEP),
    "upright gate": lambda: Scenario.model_validate(
        {**BRIEF, **DAM, "fill": {**BRIEF["fill"], "over_x_m": [0.0, 0.058]}}
    ),
    "pattern in windows": lambda: bed("aitken"),
    "pattern in step": lambda: bed("in_step"),
    "pattern, monolithic": lambda: bed("monolithic"),
    "casting": lambda: casting(2),
    "casting in 3D": lambda: casting(3),
    "tank": lambda: flow(kind="tank", particle_m=0.004, width_m=0.016, depth_m=0.032),
    "shoulder": lambda: flow(kind="shoulder", particle_m=0.00625),
}


def columns_of(scenario: Section, folder: Path) -> set[str]:
    """Compute a run as its job does; the columns of its measures, without the clock."""
    write_plan([Run("test", "one", {}, 1, scenario, {})], folder)
    of_run = folder / "runs" / "one"
    render_run(of_run)
    (of_run / "work").mkdir(exist_ok=True)
    assert simulate(of_run) == 0
    measure_run(of_run)
    return set(pd.read_csv(of_run / "measures.tsv", sep="\t")) - set(CLOCK)


def listed(scenario: Section) -> set[str]:
    measures = [m.name for m in measures_of(kind_of(scenario).planning.measures, scenario)]
    assert len(set(measures)) == len(measures)
    return set(measures)


@pytest.mark.parametrize("scene", SCENES, ids=[name.replace(" ", "_") for name in SCENES])
def test_a_run_writes_the_measures_listed(scene: str, tmp_path: Path) -> None:
    scenario = SCENES[scene]()
    resolved = kind_of(scenario).planning.resolved(scenario)
    assert listed(resolved) == columns_of(resolved, tmp_path)


def test_a_deck_writes_the_measures_it_names(tmp_path: Path) -> None:
    (tmp_path / "deck.in").write_text(LOG)
    deck = OwnDeck.model_validate(
        {"template": str(tmp_path / "deck.in"), "measures": {"height_m": "v_height"}}
    )
    assert listed(deck) == columns_of(deck, tmp_path) == {"height_m"}
