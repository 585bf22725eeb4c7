"""Own measures: formulas worked out by hand, what is refused, and where they appear."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import pandas as pd
import pytest

from sandmould.bad_input import BadInputError
from sandmould.casting.arpm.computation import ElementCost
from sandmould.casting.mps.computation import FlowCost
from sandmould.definition.own_measures import (
    MOST_LETTERS,
    FormulaError,
    parsed,
    problems,
    with_own_measures,
)
from sandmould.reference.reference import measures_text
from sandmould.report.method import own_measures_method
from sandmould.runs import columns
from sandmould.study.collect import collect, gather, read_study
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from tests.unit.refusing import refused
from tests.unit.report_study import PLANTED, write_study

TABLE = pd.DataFrame({"a": [4.0, 0.0, -1.0], "b": [2.0, 0.0, math.nan], "word": ["x", "1", "y"]})
NONE = [math.nan] * 3


@pytest.mark.parametrize(
    ("formula", "values"),
    [
        ("1 + 2 * a", [9.0, 1.0, -1.0]),
        ("(1 + 2) * a", [12.0, 0.0, -3.0]),
        ("8 - a - 2", [2.0, 6.0, 7.0]),
        ("-a ** 2", [-16.0, 0.0, -1.0]),
        ("2 ** 3 ** a", [2.0**81, 2.0, 2 ** (1 / 3)]),
        ("12 / a / 2", [1.5, math.nan, -6.0]),
        ("a / b", [2.0, math.nan, math.nan]),
        ("sqrt(a)", [2.0, 0.0, math.nan]),
        ("abs(-a)", [4.0, 0.0, 1.0]),
        ("min(a, 3, 1)", [1.0, 0.0, -1.0]),
        ("max(a, b)", [4.0, 0.0, math.nan]),
        # a part that cannot be computed leaves no number behind it
        ("min(1 / a, 7)", [0.25, math.nan, -1.0]),
        ("1 / (1 / a)", [4.0, math.nan, -1.0]),
        ("10 ** (1000 * a)", [math.nan, 1.0, 0.0]),
        ("1.5e3", [1500.0] * 3),
        (" a ", [4.0, 0.0, -1.0]),
        ("absent + 1", NONE),
        ("word", [math.nan, 1.0, math.nan]),
    ],
)  # fmt: skip
def test_values(formula: str, values: list[float]) -> None:
    found = with_own_measures(TABLE, {"own": formula})
    assert found["own"].tolist() == pytest.approx(values, nan_ok=True)
    assert list(found.columns) == [*TABLE.columns, "own"]


def test_own_measures_may_name_one_another_in_any_order() -> None:
    own = {"third": "second + a", "second": "2 * first", "first": "a + 1"}
    found = with_own_measures(TABLE, own)
    assert found["third"].tolist() == [14.0, 2.0, -1.0]
    # each is computed once: sums of sums would otherwise take 2^60 steps, chains a deep stack
    chain = {"x0": "a", **{f"x{n}": f"x{n - 1} + x{n - 1}" for n in range(1, 2000)}}
    assert not list(problems(chain, ()))
    assert with_own_measures(TABLE, chain)["x60"].tolist() == [4.0 * 2.0**60, 0.0, -(2.0**60)]


WHAT = "numbers, names of measures, + - * / **, brackets, min, max, abs and sqrt"


@pytest.mark.parametrize(
    ("formula", "sentence"),
    [
        ("", f"one line of {WHAT}"),
        ("1 +", f"one line of {WHAT}"),
        ("a = 1", f"one line of {WHAT}"),
        ("a\nb", f"one line of {WHAT}"),
        ("(" * 250 + "a" + ")" * 100, f"one line of {WHAT}"),
        ("open('a').read()", f"{WHAT}; open('a').read() is none of these"),
        ("__import__('os')", f"{WHAT}; __import__ is no function of these"),
        ("a.real", f"{WHAT}; a.real is none of these"),
        ("a[0]", f"{WHAT}; a[0] is none of these"),
        ("lambda: 1", f"{WHAT}; lambda: 1 is none of these"),
        ("[a for a in b]", f"{WHAT}; [a for a in b] is none of these"),
        ("a if b else 1", f"{WHAT}; a if b else 1 is none of these"),
        ("(a := 1)", f"{WHAT}; (a := 1) is none of these"),
        ("a < b", f"{WHAT}; a < b is none of these"),
        ("a and b", f"{WHAT}; a and b is none of these"),
        ("a % 2", f"{WHAT}; a % 2 is none of these"),
        ("a // 2", f"{WHAT}; a // 2 is none of these"),
        ("a ^ 2", f"{WHAT}; a ^ 2 is none of these"),
        ("+a", f"{WHAT}; +a is none of these"),
        ("~a", f"{WHAT}; ~a is none of these"),
        ("True", f"{WHAT}; True is none of these"),
        ("1j", f"{WHAT}; 1j is none of these"),
        ("'a'", f"{WHAT}; 'a' is none of these"),
        ("f'{a}'", f"{WHAT}; f'{{a}}' is none of these"),
        ("...", f"{WHAT}; ... is none of these"),
        ("exp(a)", f"{WHAT}; exp is no function of these"),
        ("min(a)", "min of two values or more"),
        ("sqrt(a, b)", "sqrt of one value"),
        ("abs(x=a)", "abs of one value"),
        ("min(*a, b)", f"{WHAT}; *a is none of these"),
        ("1e999", "numbers below 1.8e308"),
        ("9" * 400, "numbers below 1.8e308"),
        ("a" * (MOST_LETTERS + 1), f"a formula of at most {MOST_LETTERS} letters, not 401"),
    ],
)  # fmt: skip
def test_refused(formula: str, sentence: str) -> None:
    with pytest.raises(FormulaError) as caught:
        parsed(formula)
    assert str(caught.value) == sentence


def test_the_deepest_formula_of_so_many_letters_is_computed() -> None:
    formula = "-" * (MOST_LETTERS - 1) + "a"
    assert with_own_measures(TABLE, {"own": formula})["own"].tolist() == [-4.0, 0.0, 1.0]


CASES = {
    "unknown name": (
        "tube_space_fraction: 1 - tube_fil_fraction",
        "own_measures.tube_space_fraction = '1 - tube_fil_fraction' cannot be used: valid is a "
        "formula of measures that this scene will have; tube_fil_fraction is none: nearest are "
        "tube_fill_fraction, tube_fill_of_bed_fraction, tube_space_fraction.",
    ),
    "circle": (
        "x: y + 1, y: 2 * z, z: x",
        "own_measures.x = 'y + 1' cannot be used: valid is a formula that does not lead back to "
        "itself (x over y over z over x).",
    ),
    "of itself": (
        "x: x + 1",
        "own_measures.x = 'x + 1' cannot be used: valid is a formula that does not lead back to "
        "itself (x over x).",
    ),
    "name of a measure": (
        "solid_fraction: 1",
        "own_measures.solid_fraction = 1 cannot be used: valid is text.",
    ),
    "name of a measure, as text": (
        'solid_fraction: "1"',
        "own_measures = 'solid_fraction' cannot be used: valid is a name that no measure of this "
        "scene has.",
    ),
    "name of another column": (
        "wall_s: 2 * grains",
        "own_measures = 'wall_s' cannot be used: valid is a name that no other column of the "
        "tables has.",
    ),
    "no name": (
        "Big-one: 2 * grains",
        "own_measures.Big-one = 'Big-one' cannot be used: valid is text of the pattern "
        "^[a-z][a-z0-9_]*$.",
    ),
    "words": (
        "x: 2 * pattern_loop",
        "own_measures.x = '2 * pattern_loop' cannot be used: valid is a formula of measures that "
        "this scene will have; pattern_loop is none: such as grains.",
    ),
    "no arithmetic": (
        "x: exec('a')",
        f"own_measures.x = \"exec('a')\" cannot be used: valid is {WHAT}; exec is no function of "
        "these.",
    ),
}


@pytest.mark.parametrize("case", CASES, ids=[c.replace(" ", "_") for c in CASES])
def test_sentence(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own, sentence = CASES[case]
    told = refused(tmp_path, f"based_on: tube\nown_measures: {{{own}}}", monkeypatch)
    assert told == f"trial.yaml: {sentence}"


def test_it_may_be_objective_and_margin_and_is_listed(tmp_path: Path) -> None:
    path = tmp_path / "trial.yaml"
    text = (
        "based_on: tube\nown_measures: {empty_m2: 0.0012 - tube_sand_m2}\n"
        "objective: {measure: empty_m2, better: smaller}\n"
        "equivalence: {margins: {empty_m2: 1.0e-5}}\n"
    )
    path.write_text(text)
    assert expand(open_study(path))
    (row,) = [line for line in measures_text(open_study(path)).splitlines() if "empty" in line]
    assert row.split(maxsplit=2) == ["empty_m2", "m²", "Own: 0.0012 - tube_sand_m2."]
    path.write_text(text.replace("measure: empty_m2", "measure: empty_m"))
    with pytest.raises(BadInputError, match="nearest is empty_m2"):
        expand(open_study(path))


def test_it_is_a_column_of_summary_and_curves(tmp_path: Path) -> None:
    study = write_study(tmp_path / "tube")
    own = {"room_fraction": "1 - tube_fill_fraction", "twice_fraction": "2 * room_fraction"}
    found = gather(study, own_measures=own)
    row = found.summary.set_index("run").loc["f50_r1"]
    assert row["room_fraction"] == pytest.approx(1 - PLANTED[50.0], abs=0.05)
    assert row["twice_fraction"] == 2 * row["room_fraction"]
    both = found.curves["room_fraction"] + found.curves["tube_fill_fraction"]
    assert both.tolist() == pytest.approx([1.0] * len(both))
    assert list(gather(study).summary.columns) == [c for c in found.summary.columns if c not in own]


def test_collect_writes_those_that_the_planned_study_has(tmp_path: Path) -> None:
    study = write_study(tmp_path / "tube")
    path = study / "study.yaml"
    path.write_text(path.read_text() + "\nown_measures: {room_fraction: 1 - tube_fill_fraction}\n")
    assert read_study(study).own_measures == {"room_fraction": "1 - tube_fill_fraction"}
    collect(study)
    summary = pd.read_csv(study / "summary.tsv", sep="\t")
    expected = (1 - summary["tube_fill_fraction"]).tolist()
    assert summary["room_fraction"].tolist() == pytest.approx(expected, nan_ok=True)


def test_the_report_tells_the_formulas() -> None:
    assert own_measures_method({}) == ()
    (row,) = own_measures_method({"x_m": "2 * bed_height_m"})
    assert row.text == "x_m = 2 * bed_height_m"


def test_names_of_all_columns_of_runs_are_taken() -> None:
    stated = {
        value for name, value in vars(columns).items() if name.isupper() and isinstance(value, str)
    }
    of_measures = {
        columns.SOLID_FRACTION, columns.BED_HEIGHT_M, columns.CLASSIFICATION, columns.LOOP,
        columns.LOOP_ERROR, columns.HOPS, columns.SOLIDIFICATION_TIME_S,
        columns.OVERLAP_P99_FRACTION,
    }  # fmt: skip
    of_cells = {columns.SWEEP, columns.CROSS_CHECK, columns.CROSS_CHECK_OWN, columns.CONTROL}
    costs = {f.name for kind in (ElementCost, FlowCost) for f in dataclasses.fields(kind)}
    assert (stated - of_measures - of_cells) | costs <= columns.OF_RUN
