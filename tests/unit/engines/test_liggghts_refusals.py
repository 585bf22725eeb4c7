"""What LIGGGHTS cannot do is refused with the key and what would be valid."""

from __future__ import annotations

from typing import Any

import pytest

from sandmould.engines.liggghts import engine, process
from sandmould.engines.liggghts.render import refuse
from sandmould.engines.registry import engine_problem
from sandmould.engines.session import RefusedError
from tests.liggghts_scenes import liggghts_scene
from tests.scenes import TUBE_SCENE


@pytest.mark.parametrize(
    ("changes", "key", "valid"),
    [
        ({"engine": {"ranks": 2}}, "engine.ranks", "1 on"),
        ({"sand": {"disc_inertia": "disc"}}, "sand.disc_inertia", "sphere"),
        (
            {"time_step": {"rotational_inertia": "scaled"}},
            "time_step.rotational_inertia",
            "physical",
        ),
        (
            {"background_damping": {"form": "nonviscous_componentwise"}},
            "background_damping.form",
            "none or viscous",
        ),
        (
            {"background_damping": {"form": "nonviscous_isotropic"}},
            "background_damping.form",
            "none or viscous",
        ),
        (
            {"background_damping": {"form": "viscous", "viscous_rotation_per_s": 1.0}},
            "background_damping.viscous_rotation_per_s",
            "0 on",
        ),
        (
            {
                "dimension": 3,
                "obstacles": [
                    {
                        "kind": "cylinder",
                        "centre_m": [0.04, 0.025, 0.02],
                        "diameter_m": 0.01,
                        "length_m": 0.01,
                    }
                ],
            },
            "obstacles.0.kind",
            "mesh",
        ),
        (
            {"dimension": 3, "obstacles": [{**TUBE_SCENE["obstacles"][0], "section": "round"}]},
            "obstacles.0.section",
            "facets",
        ),
        (
            {"contact": {"grain_grain": {"rolling_stiffness_n_m": 1e4}}},
            "contact.grain_grain.rolling_stiffness_n_m",
            "70000",
        ),
        (
            {"contact": {"grain_wall": {"tangential_stiffness_n_m": 1e4}}},
            "contact.grain_wall.rolling_stiffness_n_m",
            "10000",
        ),
    ],
)
def test_refusal_names_the_key_and_what_is_valid(
    changes: dict[str, Any], key: str, valid: str
) -> None:
    with pytest.raises(RefusedError) as refusal:
        refuse(liggghts_scene(**changes))
    assert refusal.value.problem.key == key
    assert valid in refusal.value.problem.valid


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"dimension": 3, "sand": {"disc_inertia": "disc"}},
        {"background_damping": {"form": "viscous", "viscous_translation_per_s": 1.0}},
        {"contact": {"grain_grain": {"rolling_stiffness_n_m": 1.0, "rolling_arm_fraction": 0}}},
        {"frame": "laboratory", "vibration": [{"acceleration_g": 1.0, "ramp_s": 0.1}]},
        {"dimension": 3, "obstacles": [{"kind": "mesh", "file": "config/meshes/bracket.stl"}]},
        {
            "obstacles": [
                {"kind": "polygon", "vertices_m": [[0.01, 0.01], [0.02, 0.01], [0.02, 0.02]]}
            ]
        },
    ],
)
def test_all_else_is_taken(changes: dict[str, Any]) -> None:
    refuse(liggghts_scene(**changes))  # no RefusedError


def test_missing_executable_is_told_before_anything_starts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("LIGGGHTS", "no_such_liggghts")
    assert process.executable() is None
    assert engine.installed_version() == 0
    problem = engine_problem(liggghts_scene())
    assert problem is not None
    assert problem.key == "engine.name"
    assert "apt install liggghts" in problem.valid


def test_old_executable_is_told_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine, "executable", lambda: "liggghts")
    for version, fits in (("3.7.1", False), ("3.8.0", True), ("3.10.0", True)):
        monkeypatch.setattr(engine, "version_of", lambda path, v=version: v)
        assert (engine.installation_problem() is None) is fits


def test_version_is_read_from_the_first_line() -> None:
    banner = "LIGGGHTS (Version LIGGGHTS-PUBLIC 3.8.0, compiled 2022-01-26-19:42:32 by buildd)"
    assert process.version_in(banner) == "3.8.0"
    assert process.version_in("LAMMPS (29 Sep 2021)") is None
