"""The page on engines that should agree, from the committed results.

``python -m benchmarks.agreement`` writes docs/engine_twins.md; ``make twins`` computes and records
its study before.
"""

from __future__ import annotations

from benchmarks.agreement import engine_twins
from benchmarks.frame import Benchmark

BENCHMARK = Benchmark(
    __file__,
    __doc__,
    pages={
        "engine_twins.md": lambda results: engine_twins.page(),
    },
)

if __name__ == "__main__":
    BENCHMARK.command()
