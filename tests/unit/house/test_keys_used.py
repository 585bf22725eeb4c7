"""Every key stands in a study that is shipped or in a test of physics, and something reads it."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, get_args

import pytest
from pydantic import BaseModel

from sandmould import ROOT
from sandmould.definition.sweep import Range, Sweep
from sandmould.kinds.registry import KINDS
from sandmould.scenario.casting.solidification import Air
from sandmould.scenario.own_deck import Taken
from sandmould.scenario.quantity import PLANNED, Section, models_in, quantity
from sandmould.scenario.yaml_text import load_users

Model = type[BaseModel]
Key = tuple[Model, str]
"""A key by the class that declares it: those that inherit it share its study."""
PHYSICS = {
    "Scenario.measure_at_rest": "tests/verification/cases/shaking.py",
    "Scenario.frame": "tests/verification/cases/shaking.py",
    "Plate.angle_deg": "tests/verification/cases/incline.py",
    "Contact.dashpot": "tests/verification/cases/restitution.py",
    "Contact.slip_normal": "tests/verification/test_three_grains.py",
    "Fill.drop_height_m": "tests/verification/cases/bench.py",
    "TimeStep.step_s": "tests/verification/cases/bench.py",
    "Rest.load_every_steps": "tests/verification/cases/bench.py",
    "Rest.shaken_check_every_s": "tests/workflow/test_checks_while_shaken.py",
    "Recording.orientation": "tests/verification/cases/repeating.py",
    "Loop.most_factor": "tests/wedge.py",
    "MeshCavity.hollow": "tests/unit/scenario/test_hollows.py",
    "PatternConfig.others": "tests/verification/test_pattern_cluster.py",
    "Loop.mass_scale": "tests/verification/test_coupling_monolithic.py",
    "Loop.damping_ratio": "tests/verification/test_coupling_monolithic.py",
    **{f"Taken.{key}": "tests/workflow/test_deck_run.py" for key in Taken.model_fields},
    **dict.fromkeys(
        (
            "MetalAndMould.coating_m2k_w",
            "MetalAndMould.heat_transfer_over",
            "Metal.partition",
            "MouldMaterial.packing",
            "Metal.pure_melts_at_k",
            "Metal.solid_fraction",
            "Solidification.inserts",
            "Solidification.air",
            "Insert.shape",
            "Insert.initial_k",
            "Insert.heat_transfer_w_m2_k",
            *(f"Air.{key}" for key in Air.model_fields),
        ),
        "tests/verification/test_arpm_curves.py",
    ),
    "PatternConfig.crush_strength_pa": "tests/unit/kinds/test_sand_bending.py",
    "PatternConfig.tolerance_m": "tests/unit/kinds/test_sand_bending.py",
    "Placed.depth_m": "tests/unit/pattern_fe/test_pattern_scene.py",
}
"""Keys that no shipped study sets, each with the test that knows the exact answer."""
EXEMPT = {
    "DeckStudy.trust_deck": "a shipped study that trusted decks would be copied with its trust",
}
STUDIES = (
    "config/studies", "config/scenarios", "config/materials", "benchmarks/reliability/studies",
)  # fmt: skip
HOUSE = ("sandmould", "analysis", "pattern_fe", "templates")
ABOUT_KEYS = ("reference/keys.py", "reference/schema.py", "scenario/standing_keys.py")
"""Code that speaks of keys and reads none."""


def every_model() -> list[Model]:
    """All sections of all kinds of study."""
    found: dict[Model, None] = {}
    left: list[Model] = [kind.study for kind in KINDS.values()]
    while left:
        model = left.pop()
        if model not in found:
            found[model] = None
            for field in model.model_fields.values():
                left += models_in(field.annotation)
    return list(found)


def declared(model: Model, name: str) -> Key:
    """A key by the class that declares it."""
    classes = reversed(model.__mro__)
    return next((c, name) for c in classes if name in vars(c).get("__annotations__", {}))


def said(key: Key) -> str:
    return f"{key[0].__name__}.{key[1]}"


def _is_planned(key: Key) -> bool:
    """Whether the plan of a study writes a key and no user does."""
    extras: list[Any] = [field.json_schema_extra or {} for name, field in
                         key[0].model_fields.items() if name in (key[1], "name")]  # fmt: skip
    return PLANNED in {extra.get("source") for extra in extras}


def _below(model: Model, name: str) -> list[Model]:
    return list(models_in(model.model_fields[name].annotation))


def stated(models: Iterable[Model], node: Any) -> Iterator[Key]:
    """Keys that a piece of a file states, which is one of some sections or a list of them."""
    if isinstance(node, dict) and {"value", "source"} <= set(node):
        node = node["value"]
    if isinstance(node, list):
        for each in node:
            yield from stated(models, each)
    if not isinstance(node, dict):
        return
    fits = [m for m in models if set(map(str, node)) <= set(m.model_fields) and _is_of(m, node)]
    for model in fits:
        for name, value in node.items():
            yield declared(model, name)
            yield from stated(_below(model, name), value)
    if not fits:  # names of the user's, such as those of margins, with a section each
        for value in node.values():
            yield from stated(models, value)


def _is_of(model: Model, node: dict[str, Any]) -> bool:
    field = model.model_fields.get("kind")
    return "kind" not in node or (field is not None and node["kind"] in get_args(field.annotation))


def swept(scenario: Model, path: str, values: Any) -> Iterator[Key]:
    """Keys that a swept path goes through, and those that its values state."""
    here = [scenario]
    for part in (p for p in path.split(".") if not p.isdecimal()):
        here = [model for model in here if part in model.model_fields]
        yield from (declared(model, part) for model in here)
        here = [below for model in here for below in _below(model, part)]
    yield from stated([Range] if isinstance(values, dict) and "low" in values else here, values)


def shipped() -> set[Key]:
    """Keys that the shipped studies, scenarios and materials set."""
    found: set[Key] = set()
    studies: list[Model] = [kind.study for kind in KINDS.values()]
    scenarios: list[Model] = [kind.scenario for kind in KINDS.values()]
    for path in (path for folder in STUDIES for path in (ROOT / folder).glob("*.yaml")):
        tree = load_users(path.read_text())
        sweep = tree.pop("sweep", None) or {}
        found.update(stated([*studies, *scenarios], tree))
        found.update(stated([Sweep], dict.fromkeys(sweep)))
        found.update(declared(study, "sweep") for study in studies if sweep)
        for point in (*sweep.get("points", ()), sweep.get("keys", {})):
            for name, values in point.items():
                found.update(key for model in scenarios for key in swept(model, name, values))
    return found


def test_every_key_stands_in_a_study_or_a_test_of_physics() -> None:
    keys = {declared(model, name) for model in every_model() for name in model.model_fields}
    users = {said(key): key for key in keys if not _is_planned(key)}
    ours = shipped()
    without = {name for name, key in users.items() if key not in ours}
    assert without == PHYSICS.keys() | EXEMPT.keys()
    for name, file in PHYSICS.items():
        assert name.split(".")[1] in (ROOT / file).read_text(), file


def test_a_key_that_no_study_sets_is_found() -> None:
    model = KINDS["sand"].scenario
    tree = {"fill": {"layers": [{"count": {"value": 5, "source": "x"}}]}, "vibration": []}
    found = {said(key) for key in stated([model], tree)}
    assert found == {"Scenario.fill", "Fill.layers", "Layer.count", "Scenario.vibration"}
    assert {said(key) for key in swept(model, "vibration.0.frequency_hz", [25])} == {
        "Scenario.vibration", "Shaking.frequency_hz"
    }  # fmt: skip


def words_read(files: Iterable[Path], skipped: Iterable[str] = ()) -> dict[str, set[Path]]:
    """Names that files read: attributes, words of strings but docstrings, words of templates."""
    found: dict[str, set[Path]] = {}
    for path in files:
        if path.as_posix().endswith(tuple(skipped)):
            continue
        text = path.read_text(encoding="utf-8")
        words = _of_code(ast.parse(text)) if path.suffix == ".py" else re.findall(r"\w+", text)
        for word in words:
            found.setdefault(word, set()).add(path)
    return found


def _of_code(tree: ast.Module) -> Iterator[str]:
    texts = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute):
            yield node.attr
        elif (
            isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in texts
        ):
            yield from re.findall(r"\w+", node.value)


def unread(models: Iterable[Model], words: dict[str, set[Path]]) -> set[str]:
    """Keys whose name nothing reads; of sections that are dumped whole their names are enough."""
    keys = {declared(model, name) for model in models for name in model.model_fields}
    return {said(key) for key in keys if not words.get(key[1])}


@pytest.fixture(scope="module")
def words() -> dict[str, set[Path]]:
    files = (path for folder in HOUSE for path in (ROOT / folder).rglob("*")
             if path.is_file() and path.suffix in (".py", ".j2", ".html", ".js"))  # fmt: skip
    return words_read(files, ABOUT_KEYS)


def test_something_reads_every_key(words: dict[str, set[Path]]) -> None:
    assert unread(every_model(), words) == set()


def test_a_key_that_nothing_reads_is_found(words: dict[str, set[Path]], tmp_path: Path) -> None:
    class Made(Section):
        idle_m: float = quantity(1.0, "Idle.", unit="m", source="user")
        busy_m: float = quantity(1.0, "Busy.", unit="m", source="user")

    code = tmp_path / "code.py"
    code.write_text('def f(made):\n    """Say idle_m."""\n    return made.busy_m\n')
    assert unread([Made], words_read([code])) == {"Made.idle_m"}
    assert unread([Made], words) == {"Made.idle_m", "Made.busy_m"}
