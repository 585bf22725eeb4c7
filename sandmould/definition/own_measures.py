"""Measures of the user's own: arithmetic over named measures, as a study's file states it.

A formula is parsed to a tree of the few parts named here and computed from that tree: no text of
the user's is ever run as a program.
"""

from __future__ import annotations

import ast
import difflib
import math
from collections.abc import Callable, Collection, Iterator, Mapping
from graphlib import CycleError, TopologicalSorter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sandmould.bad_input import Problem
from sandmould.runs.columns import OF_RUN

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]
KEY = "own_measures"
MOST_LETTERS = 400
"""Of a formula; deeper nesting than so many letters allow would fill the stack."""
_NAMES_SHOWN = 3


class FormulaError(Exception):
    """A formula that cannot be used; its text says what would be valid."""


_COMPUTED: dict[type[ast.AST] | str, Callable[..., Array]] = {
    ast.Add: np.add, ast.Sub: np.subtract, ast.Mult: np.multiply, ast.Div: np.divide,
    ast.Pow: np.power, ast.USub: np.negative,
    "min": np.minimum, "max": np.maximum, "abs": np.abs, "sqrt": np.sqrt,
}  # fmt: skip
_TAKE_ONE = ("abs", "sqrt")
"""Functions of one value; the others take two or more."""
_VALID = "numbers, names of measures, + - * / **, brackets, min, max, abs and sqrt"


def parsed(formula: str) -> ast.expr:
    """Turn a formula into its tree, which has no part but those that are computed here.

    Raises
    ------
    FormulaError
        Where it has a part that is not arithmetic, or is none at all.
    """
    if len(formula) > MOST_LETTERS:
        raise FormulaError(f"a formula of at most {MOST_LETTERS} letters, not {len(formula):,}")
    try:
        tree = ast.parse(formula.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise FormulaError(f"one line of {_VALID}") from None
    _check(tree)
    return tree


def _apart(part: ast.expr) -> tuple[type[ast.AST] | str, list[ast.expr]]:
    """What a part does, and the values that it does it to; nothing of a number or a name."""
    if isinstance(part, ast.BinOp):
        return type(part.op), [part.left, part.right]
    if isinstance(part, ast.UnaryOp):
        return type(part.op), [part.operand]
    if isinstance(part, ast.Call) and isinstance(part.func, ast.Name):
        return part.func.id, part.args
    return "", []


def _check(part: ast.expr) -> None:
    """Refuse a part that is not listed here, or holds one."""
    does, values = _apart(part)
    if isinstance(part, ast.Constant) and type(part.value) in (int, float):
        _check_number(part.value)
    elif isinstance(part, ast.Call) and isinstance(does, str) and does:
        _check_call(part, does)
    elif not isinstance(part, ast.Name) and does not in _COMPUTED:
        raise FormulaError(f"{_VALID}; {_shown(part)} is none of these")
    for value in values:
        _check(value)


def _check_call(part: ast.Call, function: str) -> None:
    if function not in _COMPUTED:
        raise FormulaError(f"{_VALID}; {function} is no function of these")
    takes_one = function in _TAKE_ONE
    fits = len(part.args) == 1 if takes_one else len(part.args) >= 2
    if part.keywords or not fits:
        raise FormulaError(f"{function} of {'one value' if takes_one else 'two values or more'}")


def _check_number(value: Any) -> None:
    try:
        finite = math.isfinite(float(value))
    except OverflowError:
        finite = False
    if not finite:
        raise FormulaError("numbers below 1.8e308")


def _shown(part: ast.expr) -> str:
    text = ast.unparse(part)
    return text if len(text) <= 40 else f"{text[:37]}..."


def names_in(part: ast.expr) -> Iterator[str]:
    """Measures that a formula names."""
    if isinstance(part, ast.Name):
        yield part.id
    for value in _apart(part)[1]:
        yield from names_in(value)


def problems(own: Mapping[str, str], swept: Collection[str]) -> Iterator[Problem]:
    """List what is wrong with own measures, whatever the scene has; swept keys are columns too."""
    trees = {}
    for name, formula in own.items():
        try:
            trees[name] = parsed(formula)
        except FormulaError as fault:
            yield Problem(f"{KEY}.{name}", formula, str(fault))
        if name in OF_RUN or name in swept:
            yield Problem(KEY, name, "a name that no other column of the tables has")
    try:
        _in_order(trees)
    except CycleError as fault:
        circle = fault.args[1][::-1]  # each names the next
        valid = f"a formula that does not lead back to itself ({' over '.join(circle)})"
        yield Problem(f"{KEY}.{circle[0]}", own[circle[0]], valid)


def _in_order(trees: Mapping[str, ast.expr]) -> list[str]:
    """Names of own measures, each after those that its formula names."""
    parts = {
        name: [part for part in names_in(tree) if part in trees] for name, tree in trees.items()
    }
    return list(TopologicalSorter(parts).static_order())


def problems_in_scene(own: Mapping[str, str], has: Collection[str]) -> Iterator[Problem]:
    """List the measures that sound formulas name and a scene will not have.

    ``has``: measures of the scene that are numbers.
    """
    for name, formula in own.items():
        if name in has:
            yield Problem(KEY, name, "a name that no measure of this scene has")
        for part in dict.fromkeys(names_in(parsed(formula))):
            if part not in has and part not in own:
                every = [*has, *own]
                near = difflib.get_close_matches(part, every, n=_NAMES_SHOWN, cutoff=0.5)
                hint = (
                    f"nearest are {', '.join(near)}" if near else f"such as {next(iter(has), '')}"
                )
                valid = f"a formula of measures that this scene will have; {part} is none: {hint}"
                yield Problem(f"{KEY}.{name}", formula, valid)


def with_own_measures(table: pd.DataFrame, own: Mapping[str, str]) -> pd.DataFrame:
    """Add a column for each own measure to a table of measures.

    A value that cannot be computed is NaN: of a missing column, a division by zero, the root of a
    negative number, or one beyond all floating-point numbers.
    """
    if not own:
        return table
    import pandas as pd  # slow to import, and no plan needs it

    trees = {name: parsed(formula) for name, formula in own.items()}
    values: dict[str, Array] = {}

    def measured(name: str) -> Array:
        if name not in table:
            return np.full(len(table), np.nan)
        return pd.to_numeric(table[name], errors="coerce").to_numpy(dtype=np.float64)

    def computed(part: ast.expr) -> Array:
        if isinstance(part, ast.Constant):
            return np.full(len(table), part.value, dtype=np.float64)
        if isinstance(part, ast.Name):
            return values[part.id] if part.id in values else measured(part.id)
        does, inner = _apart(part)
        function, (first, *others) = _COMPUTED[does], map(computed, inner)
        if not others:
            return _finite_values(function(first))
        for other in others:
            first = _finite_values(function(first, other))
        return first

    with np.errstate(all="ignore"):
        for name in _in_order(trees):
            values[name] = computed(trees[name])
    own_columns = pd.DataFrame({name: values[name] for name in trees}, index=table.index)
    return pd.concat([table, own_columns], axis=1)


def _finite_values(values: Array) -> Array:
    return np.where(np.isfinite(values), values, np.nan)
