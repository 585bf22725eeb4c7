"""What all benchmarks share: one command line, one way to keep parts, one kind of page."""

from benchmarks.frame.benchmark import SCRATCH, Benchmark, BenchmarkRun
from benchmarks.frame.clock import children_s
from benchmarks.frame.page import render, table, thousands
from benchmarks.frame.parts import Parts

__all__ = [
    "SCRATCH",
    "Benchmark",
    "BenchmarkRun",
    "Parts",
    "children_s",
    "render",
    "table",
    "thousands",
]
