"""All cases, in the order of the table."""

from __future__ import annotations

from tests.verification.cases import (  # noqa: F401 - importing them enters their cases
    flight,  # isort: skip
    restitution,  # isort: skip
    oblique,  # isort: skip
    floor,  # isort: skip
    incline,  # isort: skip
    rolling,  # isort: skip
    chain,  # isort: skip
    balances,  # isort: skip
    shaking,  # isort: skip
    order,  # isort: skip
    repeating,  # isort: skip
)
from tests.verification.cases.bench import CASES as CASES
