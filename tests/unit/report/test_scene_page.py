"""The scene of a casting before anything runs: as a picture in 2D, to be turned in 3D."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from PIL import Image

from sandmould.bad_input import BadInputError
from sandmould.report.scene_page import draw_scene_file
from sandmould.study.plan.drawn_run import drawn_run

BLOCK = """\
kind: solidification
material: hirata_2019
scenario:
  box: {low_m: [-0.01, 0, 0], high_m: [0.05, 0.04, 0.04]}
  shapes: [{kind: rectangle, low_m: [0.0, 0.01, 0.01], high_m: [0.02, 0.03, 0.03]}]
  element_m: 0.005
objective: {measure: solidification_time_s, better: neither}
"""
PLATES = "based_on: plates\n"
TANK = "based_on: tank\n"


def drawn(folder: Path, text: str, ending: str) -> Path:
    (folder / "s.yaml").write_text(text)
    _, run = drawn_run(folder / "s.yaml")
    draw_scene_file(run.scenario, "A part", run.run, folder / f"s.{ending}")
    return folder / f"s.{ending}"


def test_plates_are_drawn_in_their_sand(tmp_path: Path) -> None:
    picture = Image.open(drawn(tmp_path, PLATES, "png")).convert("RGB")
    colours = {colour for _, colour in picture.getcolors(1 << 24) or []}
    assert {(185, 190, 196), (241, 229, 204)} <= colours


def test_a_block_can_be_turned_in_its_box(tmp_path: Path) -> None:
    page = drawn(tmp_path, BLOCK, "html").read_text(encoding="utf-8")
    found = re.search(r'id="film-scene">(.*?)</script>', page)
    assert found is not None
    scene = json.loads(found.group(1))
    assert scene["size_m"] == pytest.approx([0.06, 0.04, 0.04])
    assert scene["from_m"] == [-0.01, 0.0, 0.0]
    assert [solid["triangles"] for solid in scene["solids"]] == [12]
    assert "The grains are not computed" not in page


def test_a_flow_has_no_scene(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match="has no scene to draw"):
        drawn(tmp_path, TANK, "png")
