"""The frame of the benchmarks: parts that are kept, one command line, pages of the results."""

from __future__ import annotations

import importlib
import json
from pathlib import Path
from typing import Any

import pytest

from benchmarks.frame import Benchmark, BenchmarkRun, Parts, benchmark, table
from benchmarks.frame.benchmark import CODE, product_code
from sandmould import ROOT

PAGED = (
    "agreement", "arpm", "at_rest", "calibration", "core_loop", "engines", "lammps_decks", "mps",
    "prices", "rebound", "reliability", "scaling", "size", "size_ratio", "speed_and_accuracy",
    "stability", "sweeps",
)  # fmt: skip
SLOWLY_PAGED = ("frequency_law", "reproduction")
WRITTEN = (
    "Written by `python -m benchmarks.theme`; do not edit. Measured at a commit that was not kept"
)
ORIGIN = {"commit": "abc", "machine": {"processor": "a core"}, "versions": {}}


def count(measured: list[str], name: str) -> int:
    """Note that a part was measured, and how often any was."""
    measured.append(name)
    return len(measured)


def test_parts_of_a_stopped_benchmark_are_read_back(tmp_path: Path) -> None:
    first = Parts(tmp_path, {"commit": "abc"})
    assert first.get("10 runs", lambda: {"cpu_s": 1.0}) == {"cpu_s": 1.0}
    again = Parts(tmp_path, {"commit": "abc"})
    assert again.get("10 runs", lambda: {"cpu_s": 2.0}) == {"cpu_s": 1.0}
    assert again.restored_s > 0.0
    assert first.restored_s == 0.0
    other = Parts(tmp_path, {"commit": "other"})
    assert other.get("10 runs", lambda: {"cpu_s": 2.0}) == {"cpu_s": 2.0}
    again.remove()
    assert again.get("10 runs", lambda: {"cpu_s": 3.0}) == {"cpu_s": 3.0}


def test_a_part_that_was_cut_off_is_measured_again(tmp_path: Path) -> None:
    parts = Parts(tmp_path)
    parts.get("bed", lambda: [1.0])
    path = parts.path("bed")
    path.write_text(path.read_text(encoding="utf-8")[:-3], encoding="utf-8")
    assert parts.get("bed", lambda: [2.0]) == [2.0]


class Theme:
    """A benchmark of two parts, the second of which stops the first call."""

    def __init__(self, folder: Path) -> None:
        self.measured: list[str] = []
        self.stops = True
        (folder / "theme").mkdir()
        self.benchmark = Benchmark(
            str(folder / "theme" / "__main__.py"), "A theme.",
            parts={"first": self.first, "second": self.second},
            pages={"theme.md": lambda results: f"# T\n\n{results['first']} {results['second']}\n"},
            extent="all", quick="little",
        )  # fmt: skip

    def first(self, run: BenchmarkRun) -> int:
        return count(self.measured, f"first of {run.extent}")

    def second(self, run: BenchmarkRun) -> int:
        if self.stops:
            raise KeyboardInterrupt
        return run.results["first"] + count(self.measured, "second")


@pytest.fixture
def theme(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Theme:
    monkeypatch.setattr(benchmark, "SCRATCH", tmp_path / "scratch")
    monkeypatch.setattr(benchmark, "ROOT", tmp_path)
    monkeypatch.setattr(benchmark, "provenance", lambda scenario: dict(ORIGIN))
    monkeypatch.setattr(benchmark, "product_code", lambda: "code")
    return Theme(tmp_path)


def test_a_stopped_benchmark_goes_on(theme: Theme, tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        theme.benchmark.command([])
    assert not (tmp_path / "theme" / "results.json").exists()
    theme.stops = False
    theme.benchmark.command([])
    assert theme.measured == ["first of all", "second"]
    page = (tmp_path / "docs" / "theme.md").read_text()
    assert page == f"# T\n\n{WRITTEN}.\n\n1 3\n"
    # What is whole is measured anew, a part alone where it is named.
    theme.benchmark.command(["--part", "first"])
    results = json.loads((tmp_path / "theme" / "results.json").read_text())
    assert results == {"first": 3, "second": 3, CODE: {"first": "code", "second": "code"}}
    theme.benchmark.command(["--page"])
    page = (tmp_path / "docs" / "theme.md").read_text()
    assert page == f"# T\n\n{WRITTEN}.\n\n3 3\n"
    assert len(theme.measured) == 3


def test_parts_with_uncommitted_changes_are_measured_again(
    theme: Theme, monkeypatch: pytest.MonkeyPatch
) -> None:
    dirty = ORIGIN | {"commit": "abc-dirty"}
    monkeypatch.setattr(benchmark, "provenance", lambda scenario: dict(dirty))
    with pytest.raises(KeyboardInterrupt):
        theme.benchmark.command([])
    theme.stops = False
    theme.benchmark.command([])
    assert theme.measured == ["first of all", "first of all", "second"]


def test_a_quick_benchmark_leaves_the_committed_results_alone(theme: Theme, tmp_path: Path) -> None:
    theme.stops = False
    theme.benchmark.command(["--quick"])
    assert theme.measured == ["first of little", "second"]
    assert sorted(p.name for p in (tmp_path / "theme").iterdir()) == []
    written = tmp_path / "scratch" / "theme"
    assert {p.name for p in written.iterdir()} >= {"results.json", "theme.md"}
    assert not (tmp_path / "docs").exists()


def test_no_page_is_written_before_all_is_measured(theme: Theme, tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match="no page: second of"):
        theme.benchmark.command(["--part", "first"])
    kept = json.loads((tmp_path / "theme" / "results.json").read_text())
    assert kept == {"first": 1, CODE: {"first": "code"}}
    with pytest.raises(SystemExit):
        theme.benchmark.command(["--part", "third"])


@pytest.mark.parametrize("part", ["first", "second"])
def test_a_page_says_that_a_part_is_of_older_code(theme: Theme, part: str) -> None:
    codes = {"first": "code", "second": "code", part: "earlier"}
    results = {"first": 1, "second": 3, "origin": {"commit": "abc"}, CODE: codes}
    page = theme.benchmark.text("theme.md", results)
    assert "Measured at commit abc with older code than that of today." in page
    del results[CODE]
    assert theme.benchmark.text("theme.md", results) == page


@pytest.mark.slow
def test_the_code_of_the_product_has_a_hash() -> None:
    assert len(product_code()) == 12


def test_a_table_has_a_line_a_row() -> None:
    text = table(["a", "b"], [["1", "2"], ["3", ""]])
    assert text == "| a | b |\n| --- | --- |\n| 1 | 2 |\n| 3 |  |\n"


# The law fits many curves, the ledger hashes the runs of all records that it names: 10 to 20 s.
@pytest.mark.parametrize(
    "name", [*PAGED, *(pytest.param(name, marks=pytest.mark.slow) for name in SLOWLY_PAGED)]
)
def test_pages_are_those_of_the_committed_results(name: str) -> None:
    theme: Benchmark = importlib.import_module(f"benchmarks.{name}.__main__").BENCHMARK
    path = Path(theme.main).with_name("results.json")
    results: dict[str, Any] = json.loads(path.read_text("utf-8")) if path.exists() else {}
    assert theme.theme == name
    for page in theme.pages:
        committed = (ROOT / "docs" / page).read_text(encoding="utf-8")
        assert theme.text(page, results) == committed, page
