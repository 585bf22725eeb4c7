"""What tells one computed run of casting from another."""

from __future__ import annotations

import hashlib

from sandmould.scenario.quantity import Section


def hash_with(scenario: Section, solver: str) -> str:
    """Hash of a scenario without its seed, and of the solver that computes it."""
    text = scenario.model_dump_json(exclude={"seed"}) + solver
    return hashlib.sha256(text.encode()).hexdigest()
