"""Labels of runs and settings: what differs looks different, whatever its kind."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandmould.runs.formatting import mark, setting_text
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from sandmould.study.plan.plan_files import plan_table
from sandmould.study.plan.price import Prices
from tests.unit.kinds.test_solidification_study import opened


def corner(far: float) -> list[list[float]]:
    return [[0.03, 0.02], [0.05, 0.02], [far, 0.06], [0.03, 0.06]]


def test_points_of_one_study_have_labels_of_their_own(tmp_path: Path) -> None:
    """Two polygons, a fourth key and a fifth digit were one label each."""
    polygon = {"kind": "polygon", "vertices_m": corner(0.05)}
    tables: dict[str, list[Any]] = {
        "shapes.0.vertices_m": [corner(0.05), corner(0.055)],
        "until_s": [300.0, 300.01],
    }
    for key, values in tables.items():
        sweep = {"sweep": {"design": "list", "points": [
            {"element_m": 0.005, key: value} for value in values]}}  # fmt: skip
        runs = expand(open_study(opened(tmp_path, sweep, shapes=[polygon])))
        labels = {run.run.rsplit("_r", 1)[0] for run in runs}
        assert len(labels) == 2
        rows = plan_table(runs, Prices(), 1).splitlines()[1:3]
        assert {row.split()[0] for row in rows} == labels
        assert all(re.fullmatch("[a-z0-9_]+", label) for label in labels)


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ({"until_s": 300.0}, {"until_s": 300.0001}),
        ({"shapes.0.vertices_m": corner(0.05)}, {"shapes.0.vertices_m": corner(0.055)}),
    ],
)
def test_settings_that_differ_read_differently(first: dict, second: dict) -> None:
    assert setting_text(first) != setting_text(second)
    assert len(setting_text(first)) < 60
    assert setting_text(first) == setting_text(dict(first))


def test_a_long_list_is_told_by_what_it_holds_and_by_the_mark_of_its_run() -> None:
    """Plan and report once had two marks of one value, and neither said what was meant."""
    shapes = [{"vertices_m": corner(0.05), "kind": "polygon"}, {"kind": "sphere", "radius_m": 0.01}]
    as_read = json.dumps([{"kind": "polygon", "vertices_m": corner(0.05)}, shapes[1]])
    told = f"shapes polygon + sphere ({mark(shapes)})"
    assert setting_text({"shapes": shapes}) == setting_text({"shapes": as_read}) == told
    named = [{"kind": "tube", "name": name, "length_m": 0.0512345} for name in "abcde"]
    assert setting_text({"obstacles": named}).startswith("obstacles a + b + c + 2 more (")
    assert setting_text({"title": "[" + 50 * "x"}).startswith("title no. (")


def test_a_setting_names_sections_of_keys_that_end_alike() -> None:
    text = setting_text({"casting.density_kg_m3": 7200.0, "mould.density_kg_m3": 1600.0})
    assert text == "casting density 7200 kg/m³, mould density 1600 kg/m³"
    assert setting_text({"time_s": 0.1 + 0.2}) == "0.3 s"


def test_values_of_a_table_read_like_those_of_a_study() -> None:
    assert setting_text({"relaxations": np.int64(5)}) == setting_text({"relaxations": 5})


def test_a_list_of_small_sections_is_read_as_it_is_said() -> None:
    layers = [{"height_m": 0.01, "repeat": 5}, {"height_m": 0.02}, {"count": 60}]
    assert setting_text({"fill.layers": layers}) == "layers 5 x 10 mm + 20 mm + count 60"
    # as a table holds it
    assert setting_text({"fill.layers": json.dumps(layers[:1])}) == "layers 5 x 10 mm"
    assert " 27 values (" in setting_text({"fill.layers": 9 * layers})
    assert setting_text({"shapes": [{"at_m": [1, 2]}]}) == 'shapes [{"at_m": [1, 2]}]'


def test_switches_and_stiff_springs_read_as_they_are_written() -> None:
    assert setting_text({"values.periodic": True}) == "periodic true"
    assert setting_text({"values.periodic": np.bool_(False)}) == "periodic false"
    assert setting_text({"contact.normal_stiffness_n_m": 6e4}) == "60 kN/m"
    assert setting_text({"values.load_pa": 4349.0}) == "4349 Pa"


def test_sections_and_places_are_told_with_what_they_state() -> None:
    supports = {"clamped": [], "resting": ["bottom"], "hung": [{"low_m": [0.084, 0.047]}],
                "bedding_n_m3": 3e6, "free": None}  # fmt: skip
    told = f"supports resting bottom, hung, bedding 3e+06 N/m³ ({mark(supports)})"
    assert setting_text({"pattern.supports": supports}) == told
    assert setting_text({"shapes.1.high_m": "[0.075, 0.102]"}) == "upper corner (75, 102) mm"
    assert setting_text({"initial_k.casting": 953, "initial_k.mould": 293}) == (
        "casting 953 K, mould 293 K"
    )
