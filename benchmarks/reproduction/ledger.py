"""The list of claims that is kept by hand: what a paper shows, and where ours is recorded."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from pydantic import Field, model_validator

from sandmould.bad_input import display_path
from sandmould.scenario.quantity import Section
from sandmould.scenario.reading import ModelT, Origin, merge, read_yaml, validated

CLAIMS = Path(__file__).with_name("claims")
"""One file a paper, and one of what others measured."""
Take = Literal["mean", "least", "most", "best", "where_least"]


class Theirs(Section):
    """What a paper gives: a number, a range, a bound, a picture or words."""

    value: float | None = Field(None, description="A number.")
    low: float | None = Field(None, description="Least of a range, or what it lies above.")
    high: float | None = Field(None, description="Most of a range, or what it lies below.")
    unit: str = Field("", description="Of the numbers.")
    says: str = Field("", description="What the text says, in our words.")
    fault: bool = Field(False, description="Whether low or high is told as a fault of theirs.")
    picture: bool = Field(False, description="Whether the answer is in a picture alone.")

    @model_validator(mode="after")
    def _one_form(self) -> Theirs:
        ranged = self.low is not None or self.high is not None
        if (self.value is not None) + ranged + self.picture > 1:
            raise ValueError("either a value, or low and high, or a picture")
        if self.value is None and not ranged and not self.picture and not self.says:
            raise ValueError("a value, low or high, a picture or what it says")
        return self

    @property
    def interval(self) -> tuple[float, float] | None:
        """Least and most that the paper allows; None where it gives no number."""
        if self.value is not None:
            return self.value, self.value
        if self.low is None and self.high is None:
            return None
        low = float("-inf") if self.low is None else self.low
        return low, float("inf") if self.high is None else self.high


class OurSource(Section):
    """Where a number of ours is recorded, and what is taken of it."""

    record: str = Field("", description="Folder of docs/results; its summary.tsv is read.")
    in_readme: bool = Field(False, description="Read the tables of the record's page.")
    results: Literal["", "arpm", "mps"] = Field(
        "", description="Theme of benchmarks; its results.json is read."
    )
    part: str = Field("", description="Path to a list of rows in the results, such as ways.rows.")
    scenario: str = Field("", description="Shipped study; the number is a key of its scenario.")
    material: str = Field("", description="File of config/materials; the number is a key of it.")
    column: str = Field(..., description="Column of the table, or key path.")
    where: dict[str, Any] = Field({}, description="Rows that count: column and cell, or cells.")
    size: bool = Field(False, description="Whether signs are left out.")
    take: Take = Field(
        "mean",
        description="What of the rows: their mean, the least, the most, the value of the swept "
        "key with the best mean and the nearest ones that are ruled out, or where the size is "
        "least.",
    )
    of: str = Field("", description="The swept key of best and where_least.")
    minus: OurSource | None = Field(None, description="What is taken off.")
    over: OurSource | None = Field(None, description="What it is divided by.")
    times: float = Field(1.0, description="Factor to the unit of the paper.")
    digits: int = Field(3, ge=1, description="Significant digits.")
    name: str = Field("", description="Stands before the number where a row has several.")

    @model_validator(mode="after")
    def _one_place(self) -> OurSource:
        places = (self.record, self.results, self.scenario, self.material)
        if sum(map(bool, places)) != 1:
            raise ValueError("one of record, results, scenario and material")
        if (self.take in ("best", "where_least")) != bool(self.of):
            raise ValueError("of with best and where_least, and with these alone")
        if bool(self.part) != bool(self.results):
            raise ValueError("part with results, and with these alone")
        return self

    @property
    def second(self) -> OurSource | None:
        """What is taken off, or what it is divided by."""
        return self.minus or self.over


class LedgerRow(Section):
    """One figure or number of a paper."""

    at: str = Field(..., description="Figure, table, section or equation.")
    shows: str = Field(..., description="What it shows.")
    kind: Literal["result", "input", "drawing", "measurement"] = Field(
        "result",
        description="A result; a number that is put in; a drawing that defines something; what was "
        "measured, or seen, and cannot be computed.",
    )
    theirs: Theirs
    ours: tuple[OurSource, ...] = Field((), description="Empty where nothing is computed.")
    figures: tuple[str, ...] = Field((), description="Files below docs that show ours.")
    tests: tuple[str, ...] = Field((), description="Files below tests that check it.")
    why: str = Field("", description="Why the two differ, or cannot be compared.")
    stand_in: bool = Field(False, description="Whether sizes or materials are not the paper's.")
    price_of: str = Field("", description="Shipped study that would compute it.")
    price: str = Field("", description="What it would cost, where no study is shipped.")

    @model_validator(mode="after")
    def _whole(self) -> LedgerRow:
        shown = bool(self.ours or self.figures or self.tests)
        if self.kind == "result" and shown == bool(self.price_of or self.price):
            raise ValueError("ours, figures or tests, or else price_of or price")
        if self.kind == "input" and len(self.ours) != 1:
            raise ValueError("one place of ours for what is put in")
        if len(self.ours) > 1 and self.theirs.interval is not None:
            raise ValueError("one place of ours beside a number of theirs")
        return self


class Equation(Section):
    """Some equations of a paper and what checks them here."""

    at: str = Field(..., description="Their numbers.")
    shows: str
    cases: tuple[str, ...] = Field((), description="Titles of cases in docs/verification.md.")
    tests: tuple[str, ...] = Field((), description="Files below tests.")
    note: str = Field("", description="Slips of the print, choices, what is not implemented.")

    @model_validator(mode="after")
    def _checked(self) -> Equation:
        if not (self.cases or self.tests or self.note):
            raise ValueError("cases, tests or a note that says why there are none")
        return self


class Paper(Section):
    """What one paper shows and states."""

    title: str
    about: str = Field("", description="What a reader must know of our copy.")
    rows: tuple[LedgerRow, ...]
    equations: tuple[Equation, ...] = ()


class MeasuredElsewhere(Section):
    """What somebody measured and we have not computed."""

    what: str
    found: str
    by: str = Field(..., description="Source, and how much of it was seen.")
    lacks: str = Field(..., description="What a computation of it would take.")


class Elsewhere(Section):
    """What others measured."""

    rows: tuple[MeasuredElsewhere, ...]


def read_paper(path: Path) -> Paper:
    """Read the claims of a paper.

    Raises
    ------
    BadInputError
        With file, key, value and what is valid.
    """
    return _read(Paper, path)


def read_elsewhere(path: Path = CLAIMS / "measured_elsewhere.yaml") -> Elsewhere:
    """Read what others measured.

    Raises
    ------
    BadInputError
        With file, key, value and what is valid.
    """
    return _read(Elsewhere, path)


def _read(model: type[ModelT], path: Path) -> ModelT:
    name = display_path(path)
    origin = Origin(file={"": name})
    return validated(model, merge({}, read_yaml(path, name), origin, name), origin)
