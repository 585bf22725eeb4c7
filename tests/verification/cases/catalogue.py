"""All cases, in the order of the table."""

from __future__ import annotations

import importlib

from tests.verification.cases.case import CASES as CASES

MODULES = (
    "flight",
    "restitution",
    "phases",
    "oblique",
    "floor",
    "incline",
    "rolling",
    "chain",
    "balances",
    "shaking",
    "order",
    "repeating",
)
for _name in MODULES:
    # Its functions enter themselves into the list.
    importlib.import_module(f"tests.verification.cases.{_name}")
