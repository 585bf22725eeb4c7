"""A theme of benchmarks, and the command line that all themes have."""

from __future__ import annotations

import argparse
import json
import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.frame.parts import Parts
from sandmould import ROOT
from sandmould.digest import code_digest
from sandmould.execution.simulate import provenance
from sandmould.scenario.scenario import Scenario

SCRATCH = ROOT / "results" / "benchmarks"
PRODUCT = ("analysis", "pattern_fe", "sandmould")
ORIGINS = ("origin", "provenance", "fresh_origin")
"""Where results have the commit that measured them, beside their parts."""
CODE = "code_of_parts"
"""In the results: hash of the product's code as each part was measured."""
Results = dict[str, Any]


def product_code() -> str:
    """Hash of what the product computes today."""
    return code_digest(path for room in PRODUCT for path in (ROOT / room).rglob("*.py"))


@dataclass
class BenchmarkRun:
    """One call of a benchmark, as its parts see it."""

    extent: Any
    """How much is measured."""
    options: argparse.Namespace
    origin: dict[str, Any]
    """Machine, commit and versions."""
    parts: Parts
    """Takes what a part wants to keep before it is whole."""
    folder: Path
    """Where pages and pictures go."""
    results: Results
    """Parts measured so far, and those of an earlier call."""
    load_before: float
    begun_s: float = field(default_factory=time.perf_counter)

    @property
    def took_s(self) -> float:
        """Time of all parts, s, those of a stopped call included."""
        return time.perf_counter() - self.begun_s + self.parts.restored_s


@dataclass(frozen=True)
class Benchmark:
    """What a theme measures and what it writes.

    Parameters
    ----------
    main : str
        ``__file__`` of its ``__main__.py``; ``results.json`` lies beside it.
    description : str, optional
        Of the command line.
    parts : mapping of str to callable
        Each takes the run and gives a part of the results, as JSON can hold it.
    pages : mapping of str to callable
        Text of each file in docs from the results.
    draw : callable, optional
        Draws the pictures of the results into a folder.
    extent, quick : object
        How much is measured, and how much with ``--quick``.
    by_default : sequence of str
        Parts that are measured unless some are named, and that the pages need; all if empty.
    arrange : callable, optional
        Gives the results from the parts and the run where a part is not a key of its own.
    add_options : callable, optional
        Adds options of its own to the parser.
    """

    main: str
    description: str | None
    parts: Mapping[str, Callable[[BenchmarkRun], Any]] = field(default_factory=dict)
    pages: Mapping[str, Callable[[Results], str]] = field(default_factory=dict)
    draw: Callable[[Results, Path], None] = lambda results, folder: None
    extent: Any = None
    quick: Any = None
    by_default: Sequence[str] = ()
    arrange: Callable[[Results, BenchmarkRun], Results] = lambda measured, run: measured
    add_options: Callable[[argparse.ArgumentParser], object] = lambda parser: None

    @property
    def theme(self) -> str:
        """Name of its folder."""
        return Path(self.main).parent.name

    def command(self, arguments: Sequence[str] | None = None) -> None:
        """Measure, keep and write as the command line says."""
        options = self._options(arguments)
        folder = SCRATCH / self.theme if options.quick else ROOT / "docs"
        path = (folder if options.quick else Path(self.main).parent) / "results.json"
        results = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
        if self.parts and not options.page:
            results = self._measure(options, folder, results)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
        missing = set(self.by_default or self.parts) - set(results)
        if missing:
            raise SystemExit(f"no page: {', '.join(sorted(missing))} of {path} not measured yet")
        self.write(results, folder)

    def write(self, results: Results, folder: Path) -> None:
        """Write pages and pictures of some results into a folder."""
        for name in self.pages:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
        self.draw(results, folder)
        for name in self.pages:
            (folder / name).write_text(self.text(name, results), encoding="utf-8")
            print(folder / name)

    def text(self, page: str, results: Results) -> str:
        """Text of a page; below its title stands what wrote it, and of which code its figures are.

        Parameters
        ----------
        page : str
            Its name in docs.
        results : dict
        """
        title, _, rest = self.pages[page](results).partition("\n")
        origin = f"Written by `python -m benchmarks.{self.theme}`; do not edit."
        if self.parts:
            origin += " " + self._measured_by(results)
        return f"{title}\n\n{origin}\n{rest}"

    def _measured_by(self, results: Results) -> str:
        """Sentence on the commits that measured, and whether the code has changed since."""
        named = [results.get(key) for key in (*ORIGINS, *self.parts)]
        origins = [results, *(part for part in named if isinstance(part, dict))]
        commits = sorted({origin["commit"] for origin in origins if "commit" in origin})
        at = f"at commit {', '.join(commits)}" if commits else "at a commit that was not kept"
        parts = [part for part in self.parts if part in results]
        codes = {results.get(CODE, {}).get(part) for part in parts}
        today = None not in codes and codes == {product_code()}
        since = "" if today else " with older code than that of today"
        return f"Measured {at}{since}."

    def _options(self, arguments: Sequence[str] | None) -> argparse.Namespace:
        parser = argparse.ArgumentParser(
            prog=f"python -m benchmarks.{self.theme}", description=self.description
        )
        parser.add_argument("--quick", action="store_true",
                            help="a little of all, to see that it works")  # fmt: skip
        parser.add_argument("--page", action="store_true", help="measure nothing, write the page")
        if self.parts:
            parser.add_argument("--part", nargs="+", choices=tuple(self.parts), metavar="NAME",
                                default=tuple(self.by_default or self.parts),
                                help=f"measure these alone: {', '.join(self.parts)}")  # fmt: skip
        self.add_options(parser)
        return parser.parse_args(arguments)

    def _measure(self, options: argparse.Namespace, folder: Path, results: Results) -> Results:
        """Measure parts; those of a stopped call are taken unless the tree has changes."""
        origin = provenance(Scenario())
        scratch = SCRATCH / self.theme / ("quick_parts" if options.quick else "parts")
        extent = self.quick if options.quick else self.extent
        parts = Parts(scratch, {**origin, "extent": repr(extent), "options": repr(options)})
        if origin["commit"].endswith("-dirty"):
            parts.remove()
        load = parts.get("load before", lambda: os.getloadavg()[0])
        run = BenchmarkRun(extent, options, origin, parts, folder, dict(results), load)
        measured: Results = {}
        for name in options.part:
            print(f"{time.strftime('%H:%M:%S')} {self.theme}: {name}", flush=True)
            measured[name] = run.results[name] = parts.get(name, partial(self.parts[name], run))
        arranged = self.arrange(measured, run)
        parts.remove()
        codes = results.get(CODE, {}) | dict.fromkeys(measured, product_code())
        return results | arranged | {CODE: codes}
