"""Error against core time of every method, with the best of each and where it fails.

``make speed-accuracy`` runs ``python -m benchmarks.speed_and_accuracy``, which computes nothing: it
writes docs/speed_and_accuracy.md and its charts from the results of other benchmarks and from the
records in docs/results. Its own ``results.json`` holds trials of layouts.
"""

from __future__ import annotations

from benchmarks.frame import Benchmark
from benchmarks.speed_and_accuracy.chart import draw
from benchmarks.speed_and_accuracy.page import methods, page

BENCHMARK = Benchmark(
    __file__,
    __doc__,
    pages={"speed_and_accuracy.md": page},
    draw=lambda results, folder: draw(methods(), folder / "speed_and_accuracy"),
)

if __name__ == "__main__":
    BENCHMARK.command()
