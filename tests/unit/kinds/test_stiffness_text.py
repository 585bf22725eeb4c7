"""How the plan and the report say how stiff the model grains are."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

from sandmould import ROOT
from sandmould.runs.templates import worded
from sandmould.scenario.contact import Contact, ContactLaw
from sandmould.scenario.hardness import Hardness, bed_hardness
from sandmould.scenario.scenario import Scenario
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from sandmould.study.plan.plan_files import plan_table
from sandmould.study.plan.price import Prices
from tests.unit.scenario.test_hardness import PI, G, bed


def too_soft(hardness: Hardness | None, overlap_percent: float = 0.0) -> str:
    return worded(
        "too_soft.j2", it=hardness, least=1000, overlap_percent=overlap_percent, deep_percent=5
    )


def test_grains_that_are_too_soft_are_told_with_their_figures() -> None:
    stiff = bed_hardness(bed(3))
    assert stiff is not None
    assert stiff.soft == ()
    assert too_soft(stiff) == ""
    assert too_soft(None) == ""
    assert worded("stiffness.j2", it=stiff).replace("\u202f", "") == (
        "kappa 682000 (bed), 195000 (walls), wave speed 164 m/s along a row of grains, c/(4 H) "
        "11300 Hz at the planned depth H of 3.61 mm; 51.3 Pa at the foot"
    )
    walls = ContactLaw(normal_stiffness_n_m=50.0)
    soft = bed_hardness(bed(3, contact=Contact(grain_wall=walls, springs_at_size_scale=None)))
    assert soft is not None
    assert soft.soft == ("walls",)
    pressure_pa = 1000 * 2500 * PI / 6 * 0.002**3 * G / 0.002
    assert f"and {50 / (pressure_pa * 0.002):.3g} at walls, where 1" in too_soft(soft)


def test_measured_overlaps_are_told_above_five_percent() -> None:
    assert too_soft(None, 5.0) == ""
    assert too_soft(None, 8.1) == (
        "Model grains are too soft: one contact in a hundred is deeper than 8.1 % of a radius, "
        "where 5 % or less is needed. Packing, density, angles and fills are not those of real "
        "sand."
    )


def test_the_plan_says_whether_grains_are_stiff_enough(tmp_path: Path) -> None:
    def lines(**sand: Any) -> list[str]:
        study = {
            "based_on": "tube", "scenario": {"engine": {"name": "reference"}, "sand": sand},
            "sweep": {"keys": {"vibration.0.frequency_hz": [20, 50]}},
        }  # fmt: skip
        path = tmp_path / "trial.yaml"
        path.write_text(yaml.safe_dump(study), encoding="utf-8")
        plan = plan_table(expand(open_study(path)), Prices(), 1).splitlines()
        heads = ("Stiffness of the grains", "Natural frequency")
        return [line.replace("\u202f", "") for line in plan if line.startswith(heads)]

    stiff, natural = lines()
    assert stiff.startswith("Stiffness of the grains: stiff enough (kappa 17")
    assert stiff.endswith(" in the bed, 4980 at walls, at least 1000).")
    assert natural.startswith("Natural frequency: about 341 Hz for ")
    assert natural.endswith("wave speed c of 128 m/s along a row of grains.")
    soft, _ = lines(disc_thickness_m=0.1)
    assert soft.startswith("Stiffness of the grains: too soft (kappa 398 in the bed")
    assert soft.endswith("Packing, density, angles and fills are not those of real sand.")


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
def test_a_study_of_too_soft_grains_says_so_in_its_title(path: Path) -> None:
    study = open_study(path).study
    if not isinstance(study.scenario, Scenario):
        return
    found = bed_hardness(study.scenario)
    assert found is None or not found.soft or "grains too soft)" in study.title
