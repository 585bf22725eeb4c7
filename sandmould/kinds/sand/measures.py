"""Which scenes of sand have the measures of ``measures.yaml``."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from sandmould.runs.measures import MeasureGroup, once, read_groups
from sandmould.scenario.scenario import Scenario

Things = Callable[[Scenario], Iterable[str]]


def seeks_loose_sand(scenario: Scenario) -> bool:
    """Whether something is buried that sand may lie loose round, and stays."""
    return scenario.dimension == 3 and bool(scenario.scene.solids) and scenario.gate is None


def _gate(scenario: Scenario, is_level: bool) -> bool:
    return scenario.gate is not None and scenario.gate.is_level == is_level


def _tubes(scenario: Scenario) -> list[str]:
    return [bore.name for bore in scenario.scene.bores]


def _cavities(scenario: Scenario) -> list[str]:
    return [cavity.name for cavity in scenario.cavities]


def _in(dimension: int, things: Things) -> Things:
    """The same in scenes of one dimension alone."""
    return lambda scenario: things(scenario) if scenario.dimension == dimension else ()


def _where(has: Callable[[Scenario], bool]) -> Things:
    """One thing, in scenes that have it."""
    return lambda scenario: once(has(scenario))


_with_pattern = _where(lambda scenario: scenario.pattern is not None)
MEASURES: tuple[MeasureGroup[Scenario], ...] = read_groups(
    Path(__file__).with_suffix(".yaml"),
    {
        "every scene": _where(lambda _: True),
        "with a tube, by its name": _tubes,
        "with a tube, in 2D": _in(2, _tubes),
        "with a tube, in 3D": _in(3, _tubes),
        "with a cavity, by its name": _cavities,
        "with a cavity, in 2D": _in(2, _cavities),
        "with a cavity, in 3D": _in(3, _cavities),
        "with obstacles in 3D, and no gate; of the last record": _where(seeks_loose_sand),
        "with vibration": _where(lambda scenario: bool(scenario.vibrations)),
        "with a discharge": _where(lambda scenario: scenario.gate is not None),
        "with a discharge through a level gate": _where(lambda s: _gate(s, is_level=True)),
        "with a discharge through a level gate, in 2D": _in(
            2, _where(lambda s: _gate(s, is_level=True))
        ),
        "with a discharge through an upright gate": _where(lambda s: _gate(s, is_level=False)),
        "with a pattern": _with_pattern,
        "with pattern.tolerance_m": _where(
            lambda s: s.pattern is not None and s.pattern.tolerance_m is not None
        ),
        "with pattern.crush_strength_pa": _where(
            lambda s: s.pattern is not None and s.pattern.crush_strength_pa is not None
        ),
        "with 3D patterns": _in(3, _with_pattern),
        "with stepped patterns": _where(
            lambda s: s.pattern is not None and not s.pattern.loop.has_windows
        ),
        "with a pattern, in 2D": _in(2, _with_pattern),
        "with a pattern, in 2D, where sand and pattern take turns (no in_step, no monolithic)": _in(
            2, _where(lambda s: s.pattern is not None and s.pattern.loop.has_windows)
        ),
        "with a pattern, in all schemes but monolithic": _where(
            lambda s: s.pattern is not None and s.pattern.loop.scheme != "monolithic"
        ),
    },
)
