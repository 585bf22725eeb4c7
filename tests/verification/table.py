"""Write docs/verification.md: every case on every engine, measured against exact.

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

from sandmould import ROOT
from sandmould.engines.registry import engine_of
from sandmould.runs.files import write_text
from sandmould.scenario.engine import ENGINE_NAMES
from tests.verification.cases.bench import scene
from tests.verification.cases.case import Case, RefusedCase, Result
from tests.verification.cases.catalogue import CASES

PAGE = ROOT / "docs" / "verification.md"
BEGIN, END = "<!-- mutations begin -->", "<!-- mutations end -->"
NO_MUTATIONS = "Not run yet: `python -m tests.verification.mutations`."
ELSEWHERE = Path(__file__).with_name("elsewhere.md")


def between(text: str, begin: str, end: str) -> str | None:
    """What stands between two marks, or None without them."""
    if begin not in text or end not in text:
        return None
    return text.split(begin, 1)[1].split(end, 1)[0].strip("\n")


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
        family = self.cases[0].family
        return family[0].upper() + family[1:]

    @property
    def anchor(self) -> str:
        return self.title.lower().replace(" ", "-")

    def of(self, engine: str) -> list[Result]:
        return [r for r in self.results if r.engine == engine]

    def summary(self) -> str:
        """A row of the summary: numbers and the largest error over its tolerance."""
        cells = [f"[{self.title}](#{self.anchor})", self.cases[0].equation]
        for engine in ENGINE_NAMES:
            found = self.of(engine)
            if not found:
                cells.append("refused" if engine in self.refusals else "")
                continue
            used = max((abs(r.error) / r.tolerance if r.tolerance else float(not r.holds))
                       for r in found)  # fmt: skip
            failed = sum(not r.holds for r in found)
            cells.append(f"{len(found)}, {used:.2g}" + (f", **{failed} FAIL**" if failed else ""))
        return "| " + " | ".join(cells) + " |"

    def section(self) -> str:
        """Heading, derivation, reason of the tolerance and the table."""
        first = self.cases[0]
        text = inspect.getdoc(first.function) or ""
        lines = [f"### {self.title}", "", text, "", f"Equations: {first.equation}. Tolerance: "
                 f"{first.reason}.", ""]  # fmt: skip
        for engine, refusal in self.refusals.items():
            lines += [f"Refused by {engine}: {refusal}.", ""]
        lines += [f"| what | | exact | {' | '.join(ENGINE_NAMES)} | tolerance |",
                  "|---|---|---|" + "---|" * (len(ENGINE_NAMES) + 1)]  # fmt: skip
        rows: dict[tuple[str, int], dict[str, Result]] = {}
        for result in self.results:
            rows.setdefault((result.name, result.dimension), {})[result.engine] = result
        for (name, dimension), found in rows.items():
            unit = next(iter(found.values())).unit
            cells = [name, f"{dimension}D"]
            exact = shared({e: number(r.exact) for e, r in found.items()})
            cells.append(exact if unit == "1" else f"{exact} {unit}")
            for engine in ENGINE_NAMES:
                if engine not in found:
                    cells.append("refused" if engine in self.refusals else "")
                    continue
                result = found[engine]
                error = f"{result.error:+.1e}" if result.error else "+0"
                mark = "" if result.holds else " **FAIL**"
                cells.append(f"{number(result.measured)} ({error}){mark}")
            cells.append(shared({e: f"{r.tolerance:.1e}" if r.tolerance else "0"
                                 for e, r in found.items()}))  # fmt: skip
            lines.append("| " + " | ".join(cells) + " |")
        return "\n".join(lines) + "\n"


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


def page(made: list[Family], mutations: str) -> str:
    """The whole page."""
    head = f"""\
# Verification

Written by `make verification`; the same cases run in `make test`. {provenance()}

Every case computes a few grains through the session that a study uses, on each engine that can do
it, against a closed form or an independent integration. A cell shows what was measured and, in
brackets, how far it is from exact. Discs of LIGGGHTS are a plane of spheres with I = 2/5 m r^2, so
some of its exact values in 2D are others: kappa = I/(m r^2) is 1/2 for a disc, 2/5 for a sphere.

## Summary

Numbers, and the largest error over its tolerance.
"""
    summary = ["| case | equations | " + " | ".join(ENGINE_NAMES) + " |",
               "|---|---|" + "---|" * len(ENGINE_NAMES)] + [f.summary() for f in made]  # fmt: skip
    return "\n".join([
        head,
        *summary,
        "",
        ELSEWHERE.read_text(encoding="utf-8"),
        "## Mutations",
        "",
        BEGIN,
        mutations,
        END,
        "",
        "## Cases",
        "",
        *(f.section() for f in made),
    ])  # fmt: skip


def write(text: str) -> None:
    """Write the page, last of all."""
    write_text(PAGE, text)


def main() -> int:
    old = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    made = families(CASES)
    write(page(made, between(old, BEGIN, END) or NO_MUTATIONS))
    failed = [r for f in made for r in f.results if not r.holds]
    for r in failed:
        print(textwrap.shorten(f"FAIL {r}", 300))
    print(f"{sum(len(f.results) for f in made)} numbers, {len(failed)} fail: {PAGE}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
