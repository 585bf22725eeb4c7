"""The ledger of what papers claim: numbers taken of records, and how rows stand."""

from __future__ import annotations

import json
import math
import re
import shutil
from pathlib import Path
from typing import Any

import pytest

from benchmarks.reproduction import recorded_numbers
from benchmarks.reproduction.judge import difference_text, ours_text, state_of, theirs_text
from benchmarks.reproduction.ledger import CLAIMS, LedgerRow, OurSource, read_paper
from benchmarks.reproduction.our_number import OurNumber
from benchmarks.reproduction.page import LedgerPage
from benchmarks.reproduction.recorded_numbers import RecordedNumbers, StudyRecord
from sandmould.bad_input import BadInputError

HZ = "vibration.0.frequency_hz"
README = """\
# planted

| vibrated | 0 | 5 s |
|---|---|---|
| fill (sand) | 0.30 | 0.52 (0.01) |

## Record

| vibrated | 0 |
|---|---|
| fill (sand) | 9 |
"""
# Three fillings at each of three frequencies; one run failed. In pairs 40 Hz is better than 80 Hz
# by 0.02, 0.00 and 0.01, so the two are not told apart; 20 Hz is worse by 0.29 to 0.31.
FILLS = {20: (0.40, 0.42, 0.38), 40: (0.70, 0.71, 0.69), 80: (0.68, 0.71, 0.68)}


@pytest.fixture
def numbers(tmp_path: Path) -> RecordedNumbers:
    """A record and results of a benchmark."""
    folder = tmp_path / "records" / "planted"
    folder.mkdir(parents=True)
    lines = [f"run\t{HZ}\treplicate\tseed\toutcome_code\toutcome\tfill_fraction\tcpu_s"]
    lines += [
        f"r{hz}_{i}\t{hz}\t{i}\t{i}\t0\tfinished\t{fill}\t2.0"
        for hz, fills in FILLS.items()
        for i, fill in enumerate(fills)
    ]
    lines.append("r20_3\t20\t3\t3\t311\toverlap too large\tnan\t1.0")
    (folder / "summary.tsv").write_text("\n".join(lines) + "\n")
    (folder / "record.json").write_text(json.dumps({
        "study": "config/studies/tube_demo.yaml", "wall_s_of_all_runs": 90.0, "commit": "abc",
        "machine": {"processor": "one"},
    }))  # fmt: skip
    (folder / "README.md").write_text(README)
    theme = tmp_path / "benchmarks" / "arpm"
    theme.mkdir(parents=True)
    rows = [
        {"way": "a", "error": {"A": -2.0}, "cpu_s": 3.0, "course_s": [0, 25], "course": [0, -0.5]},
        {"way": "b", "error": {"A": 1.0}, "cpu_s": 4.0, "course_s": [0, 25], "course": [0, 0.25]},
    ]
    (theme / "results.json").write_text(json.dumps({"ways": {"solver": "old", "rows": rows}}))
    return RecordedNumbers(tmp_path / "records", tmp_path / "benchmarks")


def taken(numbers: RecordedNumbers, **source: Any) -> OurNumber:
    return numbers.number(OurSource.model_validate(source), "a.yaml", "rows.0.ours.0")


def test_mean_of_one_setting_has_its_interval(numbers: RecordedNumbers) -> None:
    found = taken(numbers, record="planted", column="fill_fraction", where={HZ: 20}, times=100.0)
    # t(0.975, 2) = 4.3027 times sd 0.02 over sqrt(3); the failed run does not count.
    assert (found.best, found.n) == (pytest.approx(40.0), 3)
    assert found.half_width == pytest.approx(4.3027 * 2 / math.sqrt(3), rel=1e-4)


def test_best_setting_lies_between_those_that_are_ruled_out(numbers: RecordedNumbers) -> None:
    found = taken(numbers, record="planted", column="fill_fraction", take="best", of=HZ)
    assert (found.low, found.best, found.high) == (pytest.approx(20), 40, 80)
    assert found.low > 20


def test_tables_of_the_readme_are_read_section_by_section(numbers: RecordedNumbers) -> None:
    where = {"vibrated": "fill (sand)"}
    found = taken(numbers, record="planted", in_readme=True, where=where, column="5 s")
    assert (found.low, found.best, found.n) == (0.52, 0.52, 1)


def test_results_of_benchmarks(numbers: RecordedNumbers) -> None:
    rows: dict[str, Any] = {"results": "arpm", "part": "ways.rows"}
    both = taken(numbers, **rows, column="error.A", size=True, take="most")
    assert (both.best, both.cost_s) == (2.0, 7.0)
    # A course is as many rows as it has moments, and costs once.
    at = taken(numbers, **rows, column="course", where={"way": "a", "course_s": 25})
    assert (at.best, at.cost_s) == (-0.5, 3.0)
    second = {**rows, "column": "error.A", "where": {"way": "b"}}
    first: dict[str, Any] = {**rows, "column": "error.A", "where": {"way": "a"}}
    assert taken(numbers, **first, minus=second).best == -3.0
    assert taken(numbers, **first, over=second).best == -2.0
    where_least = taken(numbers, **rows, column="error.A", take="where_least", of="cpu_s")
    assert where_least.best == 4.0


FILL = {"record": "planted", "column": "fill_fraction"}
ROWS = {"results": "arpm", "part": "ways.rows", "column": "course"}
SCENE = {"scenario": "tube_demo", "column": "sand.densty"}


@pytest.mark.parametrize(
    ("source", "said"),
    [
        (FILL | {"record": "plantd"}, "record = 'plantd': a folder of docs/results, nearest"),
        (FILL | {"column": "fil_fraction"}, "column = 'fil_fraction': a column of planted, near"),
        (FILL | {"where": {"hz": 20}}, "column = 'hz': a column of planted"),
        (FILL | {"where": {HZ: 30}}, f"where.{HZ} = 30: a value of {HZ} in that table."),
        (FILL, f"where = {{}}: rows of one setting, by {HZ} as well."),
        (FILL | {"column": "run", "where": {HZ: 20}}, "column = 'run': a column with numbers in"),
        (
            FILL | {"column": "6 s", "in_readme": True},
            "column = '6 s': a column of planted, nearest 5 s",
        ),
        (ROWS | {"part": "way.rows"}, "part = 'way.rows': a path into the results, nearest ways."),
        (ROWS | {"where": {"way": "c"}}, "where.way = 'c': a value of way in that table."),
        (
            SCENE | {"scenario": "tube_dem"},
            "scenario = 'tube_dem': a study of config/studies, near",
        ),
        (SCENE, "column = 'sand.densty': a key of tube_demo, nearest density_kg_m3"),
        (SCENE | {"column": "engine.name"}, "column = 'engine.name': a key with a number, not 'r"),
        ({"material": "rojek_204", "column": "x"}, "material = 'rojek_204': a file of config/mat"),
    ],
)
def test_a_row_that_refers_to_nothing_is_refused_in_one_sentence(
    source: dict[str, Any], said: str, numbers: RecordedNumbers
) -> None:
    with pytest.raises(BadInputError) as error:
        taken(numbers, **source)
    text = str(error.value)
    assert text.startswith("a.yaml: rows.0.ours.0.")
    assert said in text.replace(" cannot be used: valid is ", ": ")
    assert len(text.splitlines()) == 1


def row(theirs: dict[str, Any], **more: Any) -> LedgerRow:
    source = {"record": "planted", "column": "x", **more.pop("source", {})}
    ours = {"ours": [source]} if not more.get("price") else {}
    return LedgerRow.model_validate({"at": "1", "shows": "x", "theirs": theirs, **ours, **more})


@pytest.mark.parametrize(
    ("theirs", "ours", "state", "difference"),
    [
        ({"value": 25.0}, (29.0, 31.0), "differs", "+5 (20 %)"),
        ({"value": 25.0}, (24.5, 26.5), "agrees", "+0.500 (2 %)"),
        ({"value": 25.0}, (26.0, 26.0), "no interval", "+1 (4 %)"),
        ({"value": 25.0}, (25.0, 25.0), "agrees", "0"),
        ({"low": 0.0, "unit": "mm"}, (-7.0, -3.0), "differs", "−5 mm"),
        ({"low": 0.0}, (-1.0, 3.0), "not resolved", "holds"),
        ({"high": 200.0}, (74.0, 74.0), "holds", "holds"),
        ({"low": 0.05, "fault": True}, (0.14, 0.14), "worse", "holds"),
        ({"low": 0.02, "fault": True}, (0.01, 0.01), "better", "−0.0100 (50 %)"),
        ({"low": 25.0, "high": 36.0}, (26.0, 35.0), "agrees", "inside"),
        ({"picture": True}, (1.0, 2.0), "picture", ""),
        ({"says": "much"}, (1.0, 2.0), "in words", ""),
    ],
)
def test_state_and_difference(
    theirs: dict[str, Any], ours: tuple[float, float], state: str, difference: str
) -> None:
    number = OurNumber(*ours, sum(ours) / 2, 3)
    assert state_of(row(theirs), number) == state
    assert difference_text(row(theirs).theirs, number) == difference


def test_a_best_setting_that_is_one_of_several_proves_nothing() -> None:
    best = row({"value": 65.0, "unit": "Hz"}, source={"take": "best", "of": HZ})
    number = OurNumber(50, 103, 70, 51)
    assert state_of(best, number) == "not ruled out"
    assert ours_text(best, 0, number) == "best at 70 Hz, its top between 50 and 103, 51 runs"
    assert state_of(best, OurNumber(15, 55, 21, 39)) == "differs"


def test_what_is_put_in_is_the_same_or_needs_a_reason(numbers: RecordedNumbers) -> None:
    put_in = row({"value": 6.4, "unit": "MPa"}, kind="input")
    number = OurNumber(6.4 * (1 + 1e-15), 6.4 * (1 + 1e-15), 6.4 * (1 + 1e-15), 1)
    assert state_of(put_in, number) == "taken over"
    assert ours_text(put_in, 0, number) == "6.4 MPa"
    other = row({"value": 9.0}, kind="input", source={"column": "fill_fraction", "where": {HZ: 20}})
    with pytest.raises(BadInputError, match="why our study puts in another number"):
        LedgerPage(numbers).row(other, "a.yaml", "rows.0")


def test_what_is_not_computed_says_its_price(numbers: RecordedNumbers) -> None:
    missing = row({"picture": True, "says": "even"}, price="1 h (estimate)")
    cells = LedgerPage(numbers).row(missing, "a.yaml", "rows.0")
    assert cells[2:] == [
        "in a picture; text: even",
        "",
        "",
        "",
        "",
        "1 h (estimate)",
        "not computed",
    ]
    assert theirs_text(row({"picture": True}).theirs) == "in a picture, not in text"


def test_what_was_computed_meanwhile_is_not_called_missing(numbers: RecordedNumbers) -> None:
    missing = row({"value": 65.0}, price="x").model_copy(
        update={"price": "", "price_of": "planted"}
    )
    with pytest.raises(BadInputError, match="a study of config/studies"):
        LedgerPage(numbers).row(missing, "a.yaml", "rows.0")
    shutil.copytree(numbers.records / "planted", numbers.records / "tube_demo")
    known = missing.model_copy(update={"price_of": "tube_demo"})
    cells = LedgerPage(numbers).row(known, "a.yaml", "rows.0")
    assert cells[-3:] == ["`sandmould run tube_demo`", "90 s", "not compared"]


@pytest.mark.parametrize(
    ("why", "mark"),
    [("", ""), ("old defaults", "; old defaults"), ("older solver", "; older solver"),
     ("the study has changed", "; stale")],
)  # fmt: skip
def test_a_record_that_no_longer_stands_is_marked(
    why: str, mark: str, numbers: RecordedNumbers, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorded_numbers, "why_stale", lambda folder: why)
    where = {"column": "fill_fraction", "where": {HZ: 20}}
    page = LedgerPage(numbers)
    cells = page.row(row({"value": 0.4}, source=where), "a.yaml", "rows.0")
    assert cells[-3:] == ["`sandmould run tube_demo`", "90 s", f"agrees{mark}"]
    assert page.old == bool(why)


def test_results_of_another_solver_are_marked(numbers: RecordedNumbers) -> None:
    source = {"results": "arpm", "part": "ways.rows", "column": "error.A", "where": {"way": "a"}}
    ours = LedgerRow.model_validate(
        {"at": "1", "shows": "x", "theirs": {"value": -2.0}, "ours": [source]}
    )
    assert LedgerPage(numbers).row(ours, "a.yaml", "rows.0")[-1] == "agrees; older solver"


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"theirs": {"value": 1.0, "picture": True}}, "either a value"),
        ({"theirs": {}}, "a value, low or high"),
        ({"ours": [{"record": "a", "scenario": "b", "column": "x"}]}, "one of record"),
        ({"ours": [{"record": "a", "column": "x", "take": "best"}]}, "of with best"),
        ({"ours": [{"results": "apm", "part": "x", "column": "x"}]}, "results = 'apm' cannot be"),
        ({"ours": []}, "ours, figures or tests, or else price_of or price"),
        ({"price": "1 h"}, "ours, figures or tests, or else price_of or price"),
        ({"kind": "input", "ours": []}, "one place of ours for what is put in"),
    ],
)
def test_a_row_of_two_minds_is_refused(changed: dict[str, Any], said: str, tmp_path: Path) -> None:
    whole = {"at": "1", "shows": "x", "theirs": {"value": 1.0},
             "ours": [{"record": "a", "column": "x"}]}  # fmt: skip
    path = tmp_path / "paper.yaml"
    path.write_text(json.dumps({"title": "A", "rows": [{**whole, **changed}]}))
    with pytest.raises(BadInputError) as error:
        read_paper(path)
    assert str(path) in str(error.value)
    assert said in str(error.value)


def numbers_in(texts: list[str], before: str) -> set[int]:
    """Numbers that follow a word; ``(3)-(5)`` and ``(3), (4)`` name those between and both."""
    found: set[int] = set()
    for text in texts:
        ends = re.findall(rf"{before}(\d+)", text)
        found |= set(range(int(ends[0]), int(ends[-1]) + 1)) if "-" in text and ends else set()
        found |= {int(end) for end in ends}
    return found


@pytest.mark.parametrize(
    ("name", "figures", "tables", "equations"),
    [("rojek_2004", 20, 0, 58), ("hirata_2019", 15, 1, 7), ("hirata_2017", 8, 2, 8)],
)
def test_every_figure_table_and_equation_has_a_row(
    name: str, figures: int, tables: int, equations: int
) -> None:
    paper = read_paper(CLAIMS / f"{name}.yaml")
    at = [row.at for row in paper.rows]
    assert numbers_in(at, r"Fig\. ") == set(range(1, figures + 1))
    assert numbers_in(at, "Table ") == set(range(1, tables + 1))
    listed = numbers_in([equation.at for equation in paper.equations], r"\(")
    assert listed == set(range(1, equations + 1))


def test_a_record_is_read_once(numbers: RecordedNumbers) -> None:
    first = numbers.record_of("planted", "a.yaml", "record")
    assert isinstance(first, StudyRecord)
    assert numbers.record_of("planted", "a.yaml", "record") is first
    assert len(first.summary) == 10
