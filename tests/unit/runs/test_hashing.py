"""What counts of a scenario: values that differ from the first defaults of their keys."""

from __future__ import annotations

from typing import Literal

import pytest
from pydantic import Field

from sandmould.runs.hashing import said, scenario_hash, solution_hash
from sandmould.scenario.quantity import Section, quantity


class Tube(Section):
    kind: Literal["tube"] = "tube"
    width_m: float = 0.1


class Scene(Section):
    solid: Tube | None = None
    layers: tuple[Tube, ...] = ()
    gravity_m_s2: float = quantity(9.81, "Gravity.", unit="m/s2", source="standard")
    files: dict[str, float] = Field({})
    seed: int = 1


class SceneWithMore(Scene):
    """A later Scene: one key more, one with another default."""

    grains: int = 7
    gravity_m_s2: float = quantity(9.8, "Gravity.", unit="m/s2", source="rounded", first=9.81)


def test_only_what_differs_from_the_defaults_counts() -> None:
    assert said(Scene()) == {}
    assert said(Scene(seed=2, files={"a": 0.0})) == {"seed": 2, "files": {"a": 0.0}}


def test_the_name_of_a_variant_counts_at_every_depth() -> None:
    scene = Scene(solid=Tube(), layers=(Tube(width_m=0.2), Tube()))
    layers = [{"kind": "tube", "width_m": 0.2}, {"kind": "tube"}]
    assert said(scene) == {"solid": {"kind": "tube"}, "layers": layers}


def test_a_later_key_changes_no_hash() -> None:
    kept = {"gravity_m_s2": 9.81, "seed": 5}
    assert scenario_hash(SceneWithMore(**kept)) == scenario_hash(Scene(seed=5))
    assert scenario_hash(SceneWithMore(**kept, grains=8)) != scenario_hash(Scene(seed=5))


def test_a_changed_default_changes_the_hash_of_those_that_take_it() -> None:
    assert scenario_hash(SceneWithMore()) == scenario_hash(Scene(gravity_m_s2=9.8))
    assert scenario_hash(SceneWithMore()) != scenario_hash(Scene())


class Study(Section):
    """A key's default may be a section, or several."""

    scene: Scene = Scene(seed=2)
    scenes: tuple[Scene, ...] = (Scene(seed=3),)


class LaterStudy(Section):
    scene: SceneWithMore = SceneWithMore(seed=2)
    scenes: tuple[SceneWithMore, ...] = (SceneWithMore(seed=3),)


def test_a_changed_default_changes_the_hash_of_those_that_take_it_with_a_whole_section() -> None:
    taken = {"gravity_m_s2": 9.8, "seed": 2}
    assert said(LaterStudy()) == {"scene": taken, "scenes": [taken | {"seed": 3}]}
    kept = SceneWithMore(gravity_m_s2=9.81, seed=2)
    assert said(LaterStudy(scene=kept, scenes=(kept,))) == said(Study(scenes=(Scene(seed=2),)))


@pytest.mark.parametrize("seed", [1, 2])
def test_a_solution_is_of_all_seeds(seed: int) -> None:
    assert solution_hash(Scene(seed=seed), "1.0") == solution_hash(Scene(), "1.0")
    assert solution_hash(Scene(gravity_m_s2=1.0), "1.0") != solution_hash(Scene(), "1.0")
    assert solution_hash(Scene(), "1.1") != solution_hash(Scene(), "1.0")
