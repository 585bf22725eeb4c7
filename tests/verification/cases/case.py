"""A case: a function of an engine and a dimension, and the results that it gives.

It yields what it measured and the exact value; ``case`` turns that into results and keeps the list
that tests and the table go through.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from sandmould.scenario.engine import ENGINE_NAMES


@dataclass(frozen=True)
class Result:
    """One number that an engine computed beside the exact one."""

    name: str
    engine: str
    dimension: int
    measured: float
    exact: float
    unit: str
    tolerance: float
    """In the unit."""
    reason: str
    """Why the tolerance is what it is."""
    equation: str

    @property
    def error(self) -> float:
        return self.measured - self.exact

    @property
    def holds(self) -> bool:
        return bool(abs(self.error) <= self.tolerance)


@dataclass(frozen=True)
class Measured:
    """What a case yields."""

    name: str
    measured: float
    exact: float
    tolerance: float
    unit: str = "1"


@dataclass(frozen=True)
class Case:
    """One case with its arguments."""

    function: Callable[..., Iterator[Measured]]
    arguments: dict[str, Any]
    dimensions: tuple[int, ...]
    engines: tuple[str, ...]
    equation: str
    reason: str

    @property
    def name(self) -> str:
        words = [self.function.__name__, *(str(value) for value in self.arguments.values())]
        return "-".join(words)

    @property
    def family(self) -> str:
        """Title of the case with all its arguments."""
        return self.function.__name__.replace("_", " ")

    def run(self, engine: str, dimension: int) -> list[Result]:
        """Compute the case.

        Raises
        ------
        RefusedCase
            When the engine lacks what it needs.
        """
        found = self.function(engine, dimension, **self.arguments)
        return [
            Result(
                m.name, engine, dimension, float(m.measured), float(m.exact), m.unit,
                float(m.tolerance), self.reason, self.equation,
            )
            for m in found
        ]  # fmt: skip


CASES: list[Case] = []
Function = Callable[..., Iterator[Measured]]


def case(
    equation: str,
    reason: str,
    dimensions: tuple[int, ...] = (2, 3),
    engines: tuple[str, ...] = ENGINE_NAMES,
    **arguments: list[Any],
) -> Callable[[Function], Function]:
    """Enter a function into the list of cases, once for each combination of arguments."""

    def enter(function: Function) -> Function:
        for values in itertools.product(*arguments.values()):
            chosen = dict(zip(arguments, values, strict=True))
            CASES.append(Case(function, chosen, dimensions, engines, equation, reason))
        return function

    return enter


class RefusedCase(Exception):  # noqa: N818 - it is an answer, not an error
    """The engine refuses the scene, or is not installed."""

    def __init__(self, key: str, valid: str) -> None:
        self.key = key
        super().__init__(f"{key}: valid is {valid}")
