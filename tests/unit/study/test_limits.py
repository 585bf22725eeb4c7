"""More than can be computed: one sentence with the count, the limit and what to change."""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image

from sandmould.bad_input import BadInputError
from sandmould.limits import LIMITS, PIXELS, YAML_DEPTH, YAML_VALUES
from sandmould.scenario.reading import read_yaml
from tests.unit.refusing import refused

BOMB = "a0: &a0 [x]\n" + "".join(
    f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 10)
)
"""Nine levels, ninety aliases, a billion values."""
BAR = "[{kind: rectangle, low_m: [0.1, 0.1], high_m: [0.3, 0.3]}]"


def casting(element_m: str = "0.01", shapes: str = BAR, record_s: str = "5") -> str:
    """A bar of steel in sand."""
    return (
        "kind: solidification\nmaterial: hirata_2019\n"
        "objective: {measure: solidification_time_s}\n"
        f"scenario: {{element_m: {element_m}, record_s: {record_s}, shapes: {shapes}, "
        "box: {low_m: [0, 0], high_m: [0.4, 0.4]}}"
    )


CASES: dict[str, tuple[str, str]] = {
    "aliases of aliases": (
        BOMB,
        "trial.yaml: file = '926,177,116 values of YAML, aliases followed' cannot be used: valid "
        "is at most 300,000 values of YAML, aliases followed: fewer aliases of aliases, or fewer "
        "values.",
    ),
    "aliases": (
        "based_on: tube\ntitle: &a x\n" + "".join(f"b{i}: *a\n" for i in range(1001)),
        "trial.yaml: file = '1,001 aliases in YAML' cannot be used: valid is at most 1,000 aliases "
        "in YAML: values written out.",
    ),
    "depth": (
        "a: " + "{a: " * 60 + "1" + "}" * 60,
        "trial.yaml: file = '51 levels of YAML' cannot be used: valid is at most 50 levels of "
        "YAML: fewer levels.",
    ),
    "size": (
        f"title: {'a' * 1_000_000}",
        "trial.yaml: file = '1,000,007 bytes of YAML' cannot be used: valid is at most 1,000,000 "
        "bytes of YAML: a shorter file.",
    ),
    "points": (
        "based_on: tube\nsweep: {keys: {sand.size_scale: {low: 4, high: 6, number: 200}, "
        "gravity_m_s2: {low: 4, high: 6, number: 200}}}",
        "trial.yaml: sweep = '40,000 runs' cannot be used: valid is at most 10,000 runs: fewer "
        "points, replicates or rounds.",
    ),
    "replicates": (
        "based_on: tube\nreplicates: 20000",
        "trial.yaml: replicates = 20000 cannot be used: valid is a number of at most 1000.",
    ),
    "rounds": (
        "based_on: tube_frequency\nrefine: {rounds: 100, runs: 1000}",
        "trial.yaml: refine.rounds = '100,008 runs' cannot be used: valid is at most 10,000 runs: "
        "fewer points, replicates or rounds.",
    ),
    "cells": (
        casting(element_m="5e-6"),
        "trial.yaml: scenario.element_m = 5e-06 cannot be used: valid is one with at most "
        "10,000,000 cells, not 6,400,000,000: larger elements or a smaller box.",
    ),
    "records of a casting": (
        casting(record_s="1e-9"),
        "trial.yaml: scenario.record_s = 1e-09 cannot be used: valid is one with at most 2,000,000 "
        "records, not 20,000,000,000,000: a longer interval.",
    ),
    "particles of a tank": (
        "based_on: tank\nscenario: {case: {particle_m: 1e-7}}",
        "trial.yaml: scenario.case.particle_m = 1e-07 cannot be used: valid is one with at most "
        "5,000,000 particles, not 320,000,000,000: larger particles or a smaller mould.",
    ),
    "particles of a cylinder": (
        "kind: flow\nscenario: {case: {kind: shoulder, particle_m: 1e-5}}\n"
        "objective: {measure: bottom_sd_pa}",
        "trial.yaml: scenario.case.particle_m = 1e-05 cannot be used: valid is one with at most "
        "5,000,000 particles, not 288,000,000,000: larger particles or a smaller mould.",
    ),
    "particles across a stream": (
        "kind: flow\nscenario: {case: {kind: shoulder, rate_kg_s: 1e9}}\n"
        "objective: {measure: bottom_sd_pa}",
        "trial.yaml: scenario.case.rate_kg_s = 1000000000.0 cannot be used: valid is one with at "
        "most 5,000,000 particles, not 32,000,000,000: larger particles or a smaller mould.",
    ),
    "frames of a flow": (
        "based_on: tank\nscenario: {record_s: 1e-9}",
        "trial.yaml: scenario.record_s = 1e-09 cannot be used: valid is one with at most 50,000 "
        "frames, not 2,000,000,000: a longer interval.",
    ),
    "steps of a flow": (
        "based_on: tank\nscenario: {dt_max_s: 1e-10}",
        "trial.yaml: scenario.dt_max_s = 1e-10 cannot be used: valid is one with at most 2,000,000 "
        "records, not 20,000,000,000: a longer interval.",
    ),
    "elements of a pattern": (
        "based_on: l_pattern\nscenario: {pattern: {element_m: 1e-7}}",
        "trial.yaml: scenario.pattern.element_m = 1e-07 cannot be used: valid is one with at most "
        "500,000 elements of the pattern, not 1,200,000,000,000: a larger element_m.",
    ),
    "equations of a pattern in 3D": (
        "based_on: plank_3d\nscenario: {pattern: {element_m: 2e-3}}",
        "trial.yaml: scenario.pattern.element_m = 0.002 cannot be used: valid is one with at most "
        "85,000 equations of a pattern of hexahedra, not 96,000: larger elements, or order 1.",
    ),
}


@pytest.mark.parametrize("case", CASES, ids=[c.replace(" ", "_") for c in CASES])
def test_sentence(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text, sentence = CASES[case]
    assert refused(tmp_path, text, monkeypatch) == sentence


@pytest.mark.parametrize(
    ("key", "what"), [("series_every_s", "records"), ("snapshot_every_s", "frames")]
)
def test_records_of_sand(
    key: str, what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = (
        "based_on: tube\nscenario: {rest: {check_every_s: 1e-4}, "
        "record: {series_every_s: 1e-4, snapshot_every_s: 1e-4}, "
        "vibration: [{frequency_hz: 50, acceleration_g: 1.5, duration_s: 1000}]}"
    )
    assert f"record.{key} = 0.0001 cannot be used: valid is one with at most" in (
        told := refused(tmp_path, text, monkeypatch)
    )
    assert f" {what}, not 10,0" in told


@pytest.mark.parametrize("side", [5001, 20000], ids=["beyond_ours", "beyond_the_library's"])
def test_pixels(side: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Image.new("1", (side, side)).save(tmp_path / "huge.png")
    shape = "{kind: image, file: huge.png, pixel_m: 1e-5}"
    told = refused(tmp_path, casting(shapes=f"[{shape}]"), monkeypatch)
    assert told == (
        f"trial.yaml: scenario.shapes.0.file = 'huge.png' cannot be used: valid is a picture with "
        f"at most 25,000,000 pixels, not {side**2:,}: a smaller picture and a larger pixel_m."
    )


def test_as_much_as_the_limit_is_taken(tmp_path: Path) -> None:
    values = ", ".join(["*a"] * 999)
    inner = "[" * (YAML_DEPTH.most - 2) + "1" + "]" * (YAML_DEPTH.most - 2)
    path = tmp_path / "much.yaml"
    path.write_text(f"a: &a [{', '.join(['1'] * 298)}]\nb: [{values}]\nc: {inner}\n")
    tree = read_yaml(path, "much.yaml")
    assert len(tree["b"]) == 999
    assert YAML_VALUES.most > 1 + 299 * 1000
    path.write_text(path.read_text().replace("[[1]]", "[[[1]]]"))
    with pytest.raises(BadInputError, match="51 levels"):
        read_yaml(path, "much.yaml")


def test_each_limit_says_what_and_why() -> None:
    assert len({limit.what for limit in LIMITS}) == len(LIMITS)
    assert all(limit.change and limit.why for limit in LIMITS)
    assert PIXELS in LIMITS
