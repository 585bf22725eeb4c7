"""What a report says of how the sand came in."""

from __future__ import annotations

from typing import Any

import pandas as pd
import pytest

from sandmould.report.method import sand_method
from tests.scenes import tube_scene

LAYERS = [{"count": 40, "repeat": 2}]
GRAIN = {"position_m": [0.02, 0.05], "diameter_m": tube_scene().largest_diameter_m}


@pytest.mark.parametrize(
    ("fill", "said"),
    [
        (
            {"vibration": {"acceleration_g": 1.5, "layer_s": 0.25, "after_s": 0.1}},
            "2 layers dropped 5 mm, one every 0.25 s, while the box vibrates at 50 Hz and 1.5 g "
            "until 0.1 s after the last has fallen; then the grains' rms speed is below",
        ),
        (
            {"spout": {"from_m": [0.02], "to_m": [0.06], "width_m": 0.03}},
            "2 layers dropped 5 mm in 5 portions out of a spout 30 mm wide that moves over the "
            "box in 1 s; the next comes when",
        ),
        ({"grains": [GRAIN], "layers": []}, "1 grain placed by hand"),
        ({"grains": [GRAIN]}, "1 grain placed by hand, 2 layers dropped 5 mm; the next comes"),
    ],
)
def test_the_way_of_filling_is_said(fill: dict[str, Any], said: str) -> None:
    scene = tube_scene(fill={"layers": LAYERS} | fill)
    summary = pd.DataFrame({"seed": [1]})
    (text,) = (row.text for row in sand_method(scene, [], summary) if row.about == "Filling")
    assert text.startswith(said)
