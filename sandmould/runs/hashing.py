"""What tells one scenario, and one computed run, from another."""

from __future__ import annotations

import json
from typing import Any

from sandmould.digest import digest
from sandmould.scenario.quantity import Section


def scenario_hash(scenario: Section) -> str:
    """Hash of everything that a scenario says, whatever the order of its keys.

    What is absent is left out: a key that comes later, absent unless given, changes no hash.
    """
    return digest(json.dumps(present(scenario.model_dump(mode="json")), sort_keys=True))


def present(tree: Any) -> Any:
    """A tree without keys whose value is None or an empty list."""
    if isinstance(tree, dict):
        return {key: present(value) for key, value in tree.items() if value not in (None, [])}
    return [present(item) for item in tree] if isinstance(tree, list) else tree


def solution_hash(scenario: Section, solver: str) -> str:
    """Hash of a scenario without its seed, and of the solver that computes it."""
    return digest(scenario.model_dump_json(exclude={"seed"}), solver)
