"""Sessions of the in-step scheme that tests share."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sandmould.pattern_fe.coupling.contact_rows import ContactRows
from sandmould.pattern_fe.coupling.foam_body import FoamBody
from sandmould.pattern_fe.coupling.in_step_foam import InStepFoam
from sandmould.pattern_fe.coupling.interface import with_surface
from sandmould.pattern_fe.coupling.stepped_sessions import InStepSession
from sandmould.pattern_fe.pattern import Pattern
from sandmould.scenario.scenario import Scenario
from tests.scenes import open_engine


def in_step(
    pattern: Pattern, scenario: Scenario, folder: Path, checkpoint: Path | None = None, **foam: Any
) -> InStepSession:
    """The in-step scheme of a scene on its engine; see ``InStepFoam`` for the foam's settings."""
    contacts = ContactRows.of(scenario, pattern)
    body = InStepFoam(pattern, scenario.step_s, contacts, 0.01, **foam)
    inner = open_engine(scenario, folder, checkpoint)
    return InStepSession(inner, body, FoamBody(pattern), "pattern", folder, checkpoint)


def bed_scene(**changes: Any) -> Scenario:
    """Coarse sand in layers over a small L, coupled in step."""
    told = {
        "shape": {"kind": "l_shape", "thickness_m": 0.006, "height_m": 0.03, "reach_m": 0.045},
        "position_m": [0.02, 0.0],
        "element_m": 0.006,
        "loop": {"scheme": "in_step"},
    }
    scene: dict[str, Any] = {
        "box": {"width_m": 0.08, "height_m": 0.08},
        "sand": {"size_scale": 8.0, "size_classes": 3, "disc_thickness_m": 0.1},
        "pattern": told,
        "fill": {"layers": [{"count": 60, "repeat": 2}]},
        "time_step": {"fraction": 0.4},
        "vibration": [],
        "engine": {"name": "reference"},
    }
    return with_surface(Scenario.model_validate(scene | changes))
