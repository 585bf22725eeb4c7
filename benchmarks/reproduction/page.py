"""The page of the ledger, from the committed records and the list of claims."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd

from benchmarks.frame import render, table
from benchmarks.reproduction import judge
from benchmarks.reproduction.ledger import (
    CLAIMS,
    Equation,
    LedgerRow,
    OurSource,
    Paper,
    read_elsewhere,
    read_paper,
)
from benchmarks.reproduction.our_number import OurNumber
from benchmarks.reproduction.recorded_numbers import (
    SOLVERS,
    RecordedNumbers,
    planned_core_s,
    shipped,
    table_rows,
)
from sandmould import ROOT
from sandmould.bad_input import BadInputError, Problem, display_path
from sandmould.execution.records import OLD_DEFAULTS, OLDER_SOLVER
from sandmould.runs.columns import finished
from sandmould.runs.formatting import listed, number, seconds

PAPERS = ("rojek_2004", "hirata_2019", "hirata_2017")
FIRST = "reproduction.md"
PAGES = {name: f"reproduction_{name}.md" for name in PAPERS}
VERIFICATION = ROOT / "docs" / "verification.md"
COMMANDS = {"arpm": "make solidification", "mps": "make flow"}
HEAD = ("where", "what", "theirs", "ours", "ours less theirs", "why", "command", "cost", "state")
STAND_IN = "stand-in"
STALE = "stale"


@dataclass
class LedgerPage:
    """What the page is made of.

    Parameters
    ----------
    numbers : RecordedNumbers
    claims : Path
        Folder with a file a paper and ``measured_elsewhere.yaml``.
    verification : Path
        Page with the table of cases.
    """

    numbers: RecordedNumbers = field(default_factory=RecordedNumbers)
    claims: Path = CLAIMS
    verification: Path = VERIFICATION
    states: Counter[str] = field(default_factory=Counter)
    """How many rows stand how."""
    on_stand_ins: Counter[str] = field(default_factory=Counter)
    """How many of these have sizes or materials of ours."""
    old: int = 0
    """Rows whose record is no longer what the code would compute."""

    def texts(self) -> dict[str, str]:
        """Write the pages, by their names in docs: one a paper, and the one that leads to them.

        Raises
        ------
        BadInputError
            Where a row refers to what no record has, or is wrong in itself.
        """
        here = Path(__file__)
        papers = {PAGES[name]: self.paper(self.claims / f"{name}.yaml") for name in PAPERS}
        elsewhere = self.measured_elsewhere()
        first = render(here.with_name("page.md.j2"), {
            "papers": papers, "elsewhere": elsewhere, "records": self.sources(),
            "states": self.states, "on_stand_ins": self.on_stand_ins,
            "meanings": judge.STATES, "old": self.old, "rows": self.states.total(),
        })  # fmt: skip
        of_papers = {
            page: render(here.with_name("paper.md.j2"), {"paper": paper})
            for page, paper in papers.items()
        }
        return {FIRST: first} | of_papers

    def paper(self, path: Path) -> dict[str, object]:
        """Tables of one paper."""
        paper = read_paper(path)
        file = display_path(path)
        rows = [self.row(row, file, f"rows.{i}") for i, row in enumerate(paper.rows)]
        return {
            "title": paper.title,
            "about": paper.about,
            "table": table(HEAD, rows),
            "equations": self.equations(paper, file),
        }

    def row(self, row: LedgerRow, file: str, key: str) -> list[str]:
        """Cells of a row."""
        found = [
            self.numbers.number(source, file, f"{key}.ours.{i}")
            for i, source in enumerate(row.ours)
        ]
        one = found[0] if len(found) == 1 else None
        state = judge.state_of(row, one)
        if state == judge.NOT_COMPUTED and self._has_record(row.price_of):
            state = judge.NOT_COMPARED
        if row.kind == "input" and state == judge.DIFFERS and not row.why:
            raise _bad(file, f"{key}.why", "", "why our study puts in another number")
        # What is put in is no result: how old its record is does not matter.
        is_result = row.kind == "result"
        standing = self._standing(row.ours, file, key) if is_result else []
        self.states[state] += 1
        self.on_stand_ins[state] += row.stand_in
        self.old += bool(standing)
        marks = [state, *([STAND_IN] if row.stand_in else []), *standing]
        spent = self._spent(row, found) if row.ours and is_result else None
        command, cost = spent or self._price(row, file, key)
        difference = judge.difference_text(row.theirs, one) if state != judge.TAKEN else ""
        return [row.at, row.shows, judge.theirs_text(row.theirs), self._ours(row, found, file, key),
                difference, row.why, command, cost, "; ".join(marks)]  # fmt: skip

    def _ours(self, row: LedgerRow, found: Sequence[OurNumber], file: str, key: str) -> str:
        texts = [judge.ours_text(row, place, ours) for place, ours in enumerate(found)]
        texts += [_figure_link(figure, file, f"{key}.figures") for figure in row.figures]
        texts += [_test_text(test, file, f"{key}.tests") for test in row.tests]
        return "; ".join(texts)

    def _standing(self, sources: Sequence[OurSource], file: str, key: str) -> list[str]:
        """Marks of what is no longer what the code would compute."""
        marks = []
        for source in _with_second(sources):
            if source.record:
                if stale := self.numbers.record_of(source.record, file, key).stale:
                    marks.append(stale if stale in (OLD_DEFAULTS, OLDER_SOLVER) else STALE)
            elif source.results and self._solver(source) != SOLVERS[source.results]():
                marks.append(OLDER_SOLVER)
        return list(dict.fromkeys(marks))

    def _solver(self, source: OurSource) -> str:
        part = self.numbers.results_of(source.results)[source.part.split(".")[0]]
        return str(part["solver"])

    def _spent(self, row: LedgerRow, found: Sequence[OurNumber]) -> tuple[str, str]:
        """Commands that computed a row, and what they took."""
        spent_s: dict[str, float] = {}
        commands = []
        for source, ours in zip(row.ours, found, strict=True):
            if source.record:
                record = self.numbers.read[source.record]
                spent_s[source.record] = record.took_s
                commands.append(f"`sandmould run {record.study}`")
            elif source.results:
                # Two numbers of the same rows are computed once.
                spent_s[f"{source.results} {source.part} {source.where}"] = ours.cost_s
                commands.append(f"`{COMMANDS[source.results]}`")
        total_s = sum(spent_s.values())
        return ", ".join(dict.fromkeys(commands)), seconds(total_s) if total_s else ""

    def _price(self, row: LedgerRow, file: str, key: str) -> tuple[str, str]:
        """Command and price of what is not computed, or what it took if it is by now."""
        if not row.price_of:
            return "", row.price
        command, price = _planned(row.price_of, file, f"{key}.price_of")
        if self._has_record(row.price_of):
            price = seconds(self.numbers.record_of(row.price_of, file, key).took_s)
        return command, price

    def _has_record(self, study: str) -> bool:
        return bool(study) and (self.numbers.records / study / "record.json").is_file()

    def equations(self, paper: Paper, file: str) -> str:
        """Table of a paper's equations; empty where it lists none."""
        cases = _cases(self.verification)
        rows = [
            [eq.at, eq.shows, *_checked(eq, cases, file, f"equations.{i}"), eq.note]
            for i, eq in enumerate(paper.equations)
        ]
        head = ("equations", "what", "checked by", "worst error over tolerance", "note")
        return table(head, rows) if rows else ""

    def measured_elsewhere(self) -> str:
        """Table of what others measured."""
        rows = read_elsewhere(self.claims / "measured_elsewhere.yaml").rows
        cells = [[row.what, row.found, row.by, row.lacks] for row in rows]
        return table(("what", "they found", "source", "what ours would take"), cells)

    def sources(self) -> str:
        """Table of the records that rows refer to."""
        rows = []
        for name, record in sorted(self.numbers.read.items()):
            failed = int((~finished(record.summary)).sum())
            rows.append([
                f"[{name}](results/{name}/README.md)", record.record["commit"],
                str(len(record.summary)), str(failed or ""), seconds(record.took_s),
                record.stale or "stands",
            ])  # fmt: skip
        head = ("record", "commit", "runs", "failed", "wall time of all", "stands")
        return table(head, rows)


def _with_second(sources: Sequence[OurSource]) -> Iterator[OurSource]:
    for source in sources:
        yield source
        if source.second is not None:
            yield from _with_second([source.second])


def _planned(study: str, file: str, key: str) -> tuple[str, str]:
    opened = shipped(study, file, key)
    took_s = float(f"{planned_core_s(opened):.2g}")
    rounds = ", rounds not counted" if opened.study.refine.rounds else ""
    return f"`sandmould run {study}`", f"{seconds(took_s)} of one core, planned{rounds}"


def _figure_link(figure: str, file: str, key: str) -> str:
    if not (ROOT / "docs" / figure).is_file():
        raise _bad(file, key, figure, "a file below docs")
    return f"[picture]({figure})"


def _test_text(test: str, file: str, key: str) -> str:
    if not (ROOT / "tests" / test).is_file():
        raise _bad(file, key, test, "a file below tests")
    return f"`tests/{test}`"


def _cases(page: Path) -> pd.DataFrame:
    """Cases of the verification page, by title."""
    summary = page.read_text(encoding="utf-8").partition("\n## Summary\n")[2].partition("\n## ")[0]
    cases = pd.DataFrame(list(table_rows(summary)))
    titles = cases["case"].str.extract(r"\[(.*?)\]", expand=False)
    return cases.set_index(titles)


def _checked(equation: Equation, cases: pd.DataFrame, file: str, key: str) -> tuple[str, str]:
    """What checks an equation, and the largest error over its tolerance of all cases."""
    checks, worst = [], 0.0
    for title in equation.cases:
        if title not in cases.index:
            raise _bad(file, f"{key}.cases", title, "the title of a case in docs/verification.md")
        case = cases.loc[title]
        checks.append(str(case["case"]))
        for cell in case.drop(["case", "equations"]):
            count, _, error = str(cell).partition(", ")
            worst = max(worst, float(error)) if count.isdigit() and error else worst
    checks += [_test_text(test, file, f"{key}.tests") for test in equation.tests]
    return listed(checks, most=len(checks)), number(worst, 2) if equation.cases else ""


def _bad(file: str, key: str, value: object, valid: str) -> BadInputError:
    return BadInputError([Problem(key, value, valid, file)])
