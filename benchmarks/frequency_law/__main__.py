"""What the frequency that fills a tube best goes with.

``python -m benchmarks.frequency_law`` computes nothing: it writes docs/frequency_law.md and
config/fill_map.yaml from the records of the studies ``tube_law_*``, those that are there.
"""

from __future__ import annotations

from benchmarks.frame import Benchmark
from benchmarks.frequency_law import page
from sandmould import ROOT
from sandmould.kinds.sand.table_motion import MAP

BENCHMARK = Benchmark(
    __file__,
    __doc__,
    pages={
        "frequency_law.md": lambda results: page.page(picture=ROOT / "docs" / "frequency_law.png"),
        "frequency_law_evidence.md": lambda results: page.evidence(),
    },
)

if __name__ == "__main__":
    BENCHMARK.command()
    MAP.write_text(page.fill_map(), encoding="utf-8")
