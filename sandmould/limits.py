"""Limits on how much a study may ask for: the one place where they stand.

More than these is a slip of the pen rather than a wish: a power of ten too many would fill the
memory of the machine before the first run, or keep it busy for days without a word.
``docs/limits.md`` is written from this list.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from sandmould.bad_input import BadInputError, Problem

_EXACT = 1e15
"""Larger counts are told to three digits."""


@dataclass(frozen=True)
class Limit:
    """The most of something."""

    most: int
    what: str
    """What is counted."""
    change: str
    """What to change where there is more."""
    why: str

    def problems(self, key: str, count: float, value: Any = None) -> Iterator[Problem]:
        """Tell a count beyond the limit.

        Parameters
        ----------
        key : str
            Key that asks for so many.
        value : any, optional
            What stands there; the count unless given.
        """
        if count > self.most and value is None:
            most = f"at most {self.most:,} {self.what}: {self.change}"
            yield Problem(key, f"{_number(count)} {self.what}", most)
        elif count > self.most:
            yield Problem(key, value, f"one {self.sentence(count)}")

    def sentence(self, count: float) -> str:
        """What a count beyond the limit should be, and how it becomes so."""
        return f"with at most {self.most:,} {self.what}, not {_number(count)}: {self.change}"

    def check(self, key: str, count: float, value: Any = None) -> None:
        """Refuse a count beyond the limit; parameters as in ``problems``.

        Raises
        ------
        BadInputError
        """
        if found := [*self.problems(key, count, value)]:
            raise BadInputError(found)


def _number(count: float) -> str:
    return f"{count:,.0f}" if count < _EXACT else f"{count:.3g}"


YAML_BYTES = Limit(
    1_000_000, "bytes of YAML", "a shorter file", "reading takes a second for every 100 kB"
)
YAML_DEPTH = Limit(
    50, "levels of YAML", "fewer levels", "the deepest key of a study lies 8 levels down"
)
YAML_ALIASES = Limit(
    1_000, "aliases in YAML", "values written out", "no study needs more than a few"
)
YAML_VALUES = Limit(
    300_000, "values of YAML, aliases followed", "fewer aliases of aliases, or fewer values",
    "aliases of aliases grow tenfold a line; 10 000 points of ten keys are 210 000",
)  # fmt: skip
RUNS = Limit(
    10_000, "runs", "fewer points, replicates or rounds",
    "more jobs than one graph of Snakemake carries well",
)  # fmt: skip
REPLICATES = Limit(1_000, "replicates", "fewer replicates", "each is a run of every point")
GRAINS = Limit(
    20_000_000, "grains", "fewer or thinner layers, or a larger sand.size_scale",
    "50 GB at 2.6 kB a grain (144 MB at 8 000 discs less 126 MB at 1 134)",
)  # fmt: skip
CELLS = Limit(
    10_000_000, "cells", "larger elements or a smaller box",
    "110 bytes a cell to paint them, 2 kB an element to compute them",
)  # fmt: skip
PARTICLES = Limit(
    5_000_000, "particles", "larger particles or a smaller mould",
    "3 kB a particle for its pairs",
)  # fmt: skip
PATTERN_ELEMENTS = Limit(
    500_000, "elements of the pattern", "a larger element_m",
    "2 million unknowns of its stiffness at order 2 in 2D",
)  # fmt: skip
SOLID_ELEMENTS = Limit(
    20_000, "tetrahedra of a drawn pattern", "a larger element_m",
    "0.7 GB and 14 s at 9 270 of order 2, nearly squared for twice as many: their equations fill",
)  # fmt: skip
SOLID_EQUATIONS = Limit(
    85_000, "equations of a pattern of hexahedra", "larger elements, or order 1",
    "1 GB and 11 s at 46 000 in an L, 1.9 GB and 55 s at 54 000 in a bar; more than squared for "
    "twice as many",
)  # fmt: skip
STEPPED_COMPONENTS = Limit(
    5_000, "components of a surface stepped in 3D", "a larger element_m, or a scheme with windows",
    "a matrix of 200 MB that every step reads, and its modes",
)  # fmt: skip
RECORDS = Limit(
    2_000_000, "records", "a longer interval",
    "a row of a table each: a few hundred megabytes a run",
)  # fmt: skip
FRAMES = Limit(
    50_000, "frames", "a longer interval", "a file of all grains each, or an array in memory"
)
PIXELS = Limit(
    25_000_000, "pixels", "a smaller picture and a larger pixel_m", "some 60 bytes a pixel"
)
DRAWING_BYTES = Limit(
    2_000_000_000, "bytes of a drawing", "a coarser surface or a smaller picture",
    "an ASCII STL file has 260 bytes a triangle",
)  # fmt: skip
TRIANGLES = Limit(
    5_000_000, "triangles", "a coarser surface",
    "1.2 kB a triangle to read and check it (1.3 GB at 998 000), more where shells touch",
)  # fmt: skip

LIMITS = (
    YAML_BYTES, YAML_DEPTH, YAML_ALIASES, YAML_VALUES, RUNS, REPLICATES, GRAINS, CELLS, PARTICLES,
    PATTERN_ELEMENTS, SOLID_ELEMENTS, SOLID_EQUATIONS, STEPPED_COMPONENTS, RECORDS, FRAMES,
    PIXELS, DRAWING_BYTES, TRIANGLES,
)  # fmt: skip
