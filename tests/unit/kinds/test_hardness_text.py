"""How the plan and the report say how hard the sand is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

from sandmould import ROOT
from sandmould.kinds.sand.hardness_text import hardness_text, softness_warning
from sandmould.scenario.contact import Contact, ContactLaw
from sandmould.scenario.hardness import bed_hardness
from sandmould.scenario.scenario import Scenario
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from sandmould.study.plan.plan_files import plan_table
from sandmould.study.plan.price import Prices
from tests.unit.scenario.test_hardness import PI, G, bed


def test_soft_sand_is_told_with_its_figures() -> None:
    hard = bed_hardness(bed(3))
    assert hard is not None
    assert hard.soft == ()
    assert softness_warning(hard) == ""
    assert softness_warning(None) == ""
    assert hardness_text(hard).replace("\u202f", "") == (
        "kappa 682000 (bed), 195000 (walls), wave speed 164 m/s along a row of grains, c/(4 H) "
        "11300 Hz at the planned depth H of 3.61 mm; 51.3 Pa at the foot"
    )
    walls = ContactLaw(normal_stiffness_n_m=50.0)
    soft = bed_hardness(bed(3, contact=Contact(grain_wall=walls, springs_at_size_scale=None)))
    assert soft is not None
    assert soft.soft == ("walls",)
    pressure_pa = 1000 * 2500 * PI / 6 * 0.002**3 * G / 0.002
    assert softness_warning(soft).startswith(
        f"Soft sand: kappa of the walls is {50 / (pressure_pa * 0.002):.3g}, where hard grains want"
    )


def test_measured_overlaps_are_told_above_five_percent() -> None:
    assert softness_warning(None, 0.05) == ""
    assert softness_warning(None, 0.081) == (
        "Soft sand: one contact in a hundred is deeper than 8.1 % of a radius, where hard grains "
        "stay below 5 %. Packing, density, angles and fills are not those of hard grains."
    )


def test_the_plan_says_what_is_hard_enough_and_where_sand_is_soft(tmp_path: Path) -> None:
    def lines(**sand: Any) -> list[str]:
        study = {
            "based_on": "tube", "scenario": {"engine": {"name": "reference"}, "sand": sand},
            "sweep": {"keys": {"vibration.0.frequency_hz": [20, 50]}},
        }  # fmt: skip
        path = tmp_path / "trial.yaml"
        path.write_text(yaml.safe_dump(study), encoding="utf-8")
        plan = plan_table(expand(open_study(path)), Prices(), 1).splitlines()
        heads = ("Hardness of", "Soft sand: ", "Wave speed c: ")
        return [line.replace("\u202f", "") for line in plan if line.startswith(heads)]

    bed_, walls, wave = lines()
    assert bed_.startswith("Hardness of the bed: hard enough. kappa is 17")
    assert bed_.endswith("from 1000 on it is good.")
    assert walls.startswith("Hardness of the walls: hard enough. kappa is 4980;")
    assert wave.startswith(
        "Wave speed c: 128 m/s along a row of grains. A bed of the planned depth"
    )
    assert wave.endswith(" swings by itself at about 341 Hz: c/(4 H).")
    soft = lines(disc_thickness_m=0.1)
    assert soft[0].startswith("Hardness of the bed: too soft. kappa is 398;")
    assert soft[2] == (
        "Soft sand: Packing, density, angles and fills are not those of hard grains."
    )


@pytest.mark.parametrize("name", ["tube_demo", "tube_frequency", "tube_certified", "repose_paper",
                                  "l_deflection"])  # fmt: skip
def test_studies_of_record_are_hard(name: str) -> None:
    scenario = open_study(Path(ROOT / "config" / "studies" / f"{name}.yaml")).study.scenario
    found = bed_hardness(scenario)
    assert found is not None
    assert found.soft == ()
    assert 100.0 < found.wave_speed_m_s < 160.0


@pytest.mark.parametrize("path", sorted((ROOT / "config" / "studies").glob("*.yaml")),
                         ids=lambda p: p.stem)  # fmt: skip
def test_a_study_of_soft_sand_says_so_in_its_title(path: Path) -> None:
    study = open_study(path).study
    if not isinstance(study.scenario, Scenario):
        return
    found = bed_hardness(study.scenario)
    assert found is None or not found.soft or "soft sand)" in study.title
