"""What the three papers claim beside what this program computes.

``python -m benchmarks.reproduction`` computes nothing: it writes docs/reproduction.md and a page
a paper from the committed records, results of benchmarks and the claims in
``benchmarks/reproduction/claims``.
"""

from __future__ import annotations

from functools import cache, partial

from benchmarks.frame import Benchmark
from benchmarks.frame.benchmark import Results
from benchmarks.reproduction.page import FIRST, PAGES, LedgerPage
from sandmould.module_main import in_a_sentence


@cache
def _texts() -> dict[str, str]:
    """All pages: the first counts the rows of the others."""
    return LedgerPage().texts()


def _text(name: str, results: Results) -> str:
    return _texts()[name]


BENCHMARK = Benchmark(
    __file__,
    __doc__,
    pages={name: partial(_text, name) for name in (FIRST, *PAGES.values())},
)

if __name__ == "__main__":
    in_a_sentence(BENCHMARK.command)
