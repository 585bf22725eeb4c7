"""The pages on studies whose settings should agree, from the committed results.

``python -m benchmarks.agreement`` writes docs/engine_twins.md and
docs/one_difference.md; ``make twins`` computes and records the studies of the first before.
"""

from __future__ import annotations

from benchmarks.agreement import engine_twins
from benchmarks.frame import Benchmark

BENCHMARK = Benchmark(
    __file__,
    __doc__,
    pages={
        "engine_twins.md": lambda results: engine_twins.page(),
        "one_difference.md": lambda results: engine_twins.one_difference(),
    },
)

if __name__ == "__main__":
    BENCHMARK.command()
