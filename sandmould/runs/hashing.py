"""What tells one scenario from another."""

from __future__ import annotations

import hashlib
import json
from typing import Any

from sandmould.scenario.quantity import Section


def scenario_hash(scenario: Section) -> str:
    """Hash of everything that a scenario says, whatever the order of its keys.

    What is absent is left out: a key that comes later, absent unless given, changes no hash.
    """
    text = json.dumps(present(scenario.model_dump(mode="json")), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def present(tree: Any) -> Any:
    """A tree without keys whose value is None or an empty list."""
    if isinstance(tree, dict):
        return {key: present(value) for key, value in tree.items() if value not in (None, [])}
    return [present(item) for item in tree] if isinstance(tree, list) else tree
