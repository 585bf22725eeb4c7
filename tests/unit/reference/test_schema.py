"""The generated files are in step with the types, and the schema rejects."""

from __future__ import annotations

import json
from typing import Any

import jsonschema
import pytest
import yaml

from sandmould import ROOT
from sandmould.kinds.sand.kind import SandStudy
from sandmould.reference.schema import DEFAULT, SCHEMA, default_text, schema_text
from sandmould.scenario.reading import Origin, read_yaml, validated

REFRESH = "the types have changed: run `python -m sandmould.reference.schema` and commit both files"
STUDIES = sorted((ROOT / "config").glob("s*/*.yaml"))


def test_generated_files_are_in_step_with_the_types() -> None:
    assert SCHEMA.read_text(encoding="utf-8") == schema_text(), REFRESH
    assert DEFAULT.read_text(encoding="utf-8") == default_text(), REFRESH


def test_defaults_load_back_as_the_types_defaults() -> None:
    tree = read_yaml(DEFAULT, "config/default.yaml")
    assert validated(SandStudy, tree, Origin()) == SandStudy()


def test_every_default_stands_below_its_meaning() -> None:
    lines = default_text().splitlines()
    at = next(i for i, line in enumerate(lines) if "rms_speed_m_s:" in line)
    above = " ".join(line.strip(" #") for line in lines[at - 2 : at])
    assert above == (
        "Root mean square speed of all grains, weighted by mass, below which the bed is at rest. "
        "[m/s] Source: argued default, docs/choices.md."
    )


RULES = jsonschema.Draft202012Validator(json.loads(SCHEMA.read_text(encoding="utf-8")))


def test_schema_itself_is_one() -> None:
    kind = jsonschema.validators.validator_for(RULES.schema, default=None)
    assert kind is jsonschema.Draft202012Validator
    RULES.check_schema(RULES.schema)  # no SchemaError


@pytest.mark.parametrize("path", STUDIES, ids=[p.stem for p in STUDIES])
def test_schema_takes_the_shipped_studies(path: Any) -> None:
    tree = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert [error.message for error in RULES.iter_errors(tree)] == []


@pytest.mark.parametrize(
    "tree",
    [
        {"sccenario": {}},
        {"replicates": 0},
        {"kind": "steel"},
        {"scenario": {"box": {"widht_m": 0.1}}},
        {"scenario": {"box": {"width_m": "wide"}}},
        {"scenario": {"sand": {"density_kg_m3": {"value": 1, "unit": "g/cm3", "source": "x"}}}},
        {"scenario": {"sand": {"density_kg_m3": {"value": 2400}}}},
        {"scenario": {"obstacles": [{"kind": "tube", "diameter_m": 0.02}]}},
        {"scenario": {"vibration": [{"frequency_hz": 0}]}},
        {"sweep": {"keys": {"sand.size_scale": 4}}},
        {"sweep": {"keys": {"sand.size_scale": []}}},
        {"sweep": {"keys": {"sand.size_scale": {"low": 4}}}},
        {"based_on": "../tube.yaml"},
    ],
)
def test_schema_rejects(tree: dict[str, Any]) -> None:
    with pytest.raises(jsonschema.ValidationError):
        RULES.validate(tree)
