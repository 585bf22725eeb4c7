"""What the three papers claim beside what this program computes.

``python -m benchmarks.reproduction`` computes nothing: it writes docs/reproduction.md from the
committed records, results of benchmarks and the claims in ``benchmarks/reproduction/claims``.
"""

from __future__ import annotations

from benchmarks.frame import Benchmark
from benchmarks.reproduction.page import LedgerPage
from sandmould.module_main import in_a_sentence

BENCHMARK = Benchmark(
    __file__,
    __doc__,
    pages={"reproduction.md": lambda results: LedgerPage().text()},
)

if __name__ == "__main__":
    in_a_sentence(BENCHMARK.command)
