"""Write the pages of the verification: every case on every engine, measured against exact.

Run as ``python -m tests.verification.table`` from the root, or ``make verification``.
"""

from __future__ import annotations

import inspect
import subprocess
import sys
import textwrap
import time
from collections.abc import Iterable
from itertools import groupby
from pathlib import Path

from benchmarks.frame import render
from sandmould import ROOT
from sandmould.engines.registry import engine_of
from sandmould.runs.files import write_text
from sandmould.scenario.engine import ENGINE_NAMES
from tests.verification.cases.bench import scene
from tests.verification.cases.case import Case, RefusedCase, Result
from tests.verification.cases.catalogue import CASES

DOCS = ROOT / "docs"
CASE_PAGES = {
    "verification_cases.md": "Verification cases: motion, damping, impacts",
    "verification_rolling.md": "Verification cases: rolling, bars, frames",
}
"""Pages of the cases and their titles."""
SECOND = "Rolling to a stop"
"""The first case of the second page, in the order of the catalogue."""


def number(value: float) -> str:
    return f"{value:.6g}" if value else "0"


def shared(of_engine: dict[str, str]) -> str:
    """One value for all engines, or which engine has which."""
    if len(set(of_engine.values())) == 1:
        return next(iter(of_engine.values()))
    engines: dict[str, list[str]] = {}
    for engine, value in of_engine.items():
        engines.setdefault(value, []).append(engine)
    return "; ".join(f"{value} ({', '.join(names)})" for value, names in engines.items())


class Family:
    """All results of one function of the catalogue."""

    def __init__(self, cases: list[Case]) -> None:
        self.cases = cases
        self.results: list[Result] = []
        self.refusals: dict[str, str] = {}
        for case in cases:
            for engine in case.engines:
                for dimension in case.dimensions:
                    try:
                        self.results += case.run(engine, dimension)
                    except RefusedCase as refusal:
                        self.refusals[engine] = str(refusal)

    @property
    def title(self) -> str:
        family = self.first.family
        return family[0].upper() + family[1:]

    @property
    def anchor(self) -> str:
        return self.title.lower().replace(" ", "-")

    def of(self, engine: str) -> list[Result]:
        return [r for r in self.results if r.engine == engine]

    @property
    def first(self) -> Case:
        """Case whose equations, reason and derivation stand for all."""
        return self.cases[0]

    @property
    def derivation(self) -> str:
        return inspect.getdoc(self.first.function) or ""

    def summary(self, engine: str) -> str:
        """Numbers of an engine and the largest error over its tolerance."""
        results = self.of(engine)
        if not results:
            return "refused" if engine in self.refusals else ""
        used = max((abs(r.error) / r.tolerance if r.tolerance else float(not r.holds))
                   for r in results)  # fmt: skip
        failed = sum(not r.holds for r in results)
        return f"{len(results)}, {used:.2g}" + (f", **{failed} FAIL**" if failed else "")

    def rows(self) -> list[list[str]]:
        """Cells of each number: what, exact, measured by each engine, tolerance."""
        numbers: dict[tuple[str, int], dict[str, Result]] = {}
        for result in self.results:
            numbers.setdefault((result.name, result.dimension), {})[result.engine] = result
        return [
            [name, f"{dimension}D", *self._cells(of_engine)]
            for (name, dimension), of_engine in numbers.items()
        ]

    def _cells(self, of_engine: dict[str, Result]) -> list[str]:
        unit = next(iter(of_engine.values())).unit
        exact = shared({e: number(r.exact) for e, r in of_engine.items()})
        cells = [exact if unit == "1" else f"{exact} {unit}"]
        for engine in ENGINE_NAMES:
            if engine not in of_engine:
                cells.append("refused" if engine in self.refusals else "")
                continue
            result = of_engine[engine]
            error = f"{result.error:+.1e}" if result.error else "+0"
            mark = "" if result.holds else " **FAIL**"
            cells.append(f"{number(result.measured)} ({error}){mark}")
        tolerances = {e: f"{r.tolerance:.1e}" if r.tolerance else "0" for e, r in of_engine.items()}
        return [*cells, shared(tolerances)]


def families(cases: Iterable[Case]) -> list[Family]:
    """Compute all cases, function by function, and print how long each took."""
    made = []
    for _, group in groupby(cases, key=lambda case: case.family):
        began = time.perf_counter()
        made.append(Family(list(group)))
        failed = sum(not r.holds for r in made[-1].results)
        print(
            f"{time.perf_counter() - began:6.1f} s  {len(made[-1].results):3d} numbers"
            f"{f', {failed} FAIL' if failed else ''}  {made[-1].title}"
        )
    return made


def provenance() -> str:
    """Engines and sources that the numbers come from."""
    versions = {e: engine_of(scene(e, 3)).installed_version() for e in ENGINE_NAMES}

    def git(*words: str) -> str:
        return subprocess.run(
            ["git", *words], cwd=ROOT, capture_output=True, text=True, check=False
        ).stdout.strip()

    commit = git("rev-parse", "--short", "HEAD")
    changed = git("status", "--porcelain", "--", "sandmould", "templates", "tests/verification")
    return (
        f"LAMMPS {versions['lammps']}, LIGGGHTS {versions['liggghts']}, reference solver "
        f"{versions['reference']} (hash of its sources); commit {commit}"
        f"{' with uncommitted changes' if changed else ''}."
    )


def pages(made: list[Family]) -> dict[str, str]:
    """Text of each page by its name in docs."""
    titles = [family.title for family in made]
    split = titles.index(SECOND)
    of_page = dict(zip(CASE_PAGES, (made[:split], made[split:]), strict=True))
    values = {
        "provenance": provenance(),
        "engines": ENGINE_NAMES,
        "page_of": {f.title: page for page, families in of_page.items() for f in families},
    }
    here = Path(__file__)
    return {
        "verification.md": render(here.with_name("page.md.j2"), {**values, "families": made}),
        "verification_figures.md": render(
            here.with_name("figures.md.j2"), {**values, "families": made}
        ),
        **{
            page: render(
                here.with_name("cases.md.j2"), {"title": CASE_PAGES[page], "families": families}
            ).rstrip()
            + "\n"
            for page, families in of_page.items()
        },
    }


def main() -> int:
    made = families(CASES)
    for page, text in pages(made).items():
        write_text(DOCS / page, text)
    failed = [r for f in made for r in f.results if not r.holds]
    for r in failed:
        print(textwrap.shorten(f"FAIL {r}", 300))
    print(f"{sum(len(f.results) for f in made)} numbers, {len(failed)} fail: {DOCS}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
