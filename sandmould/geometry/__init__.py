"""Solids and surfaces: drawings from files, their union, outlines, distances.

It knows no scenario: arrays and files go in, triangles and distances come out.
"""

from pathlib import Path


def source_files() -> list[Path]:
    """Files of this room: what is computed with a drawing depends on them."""
    return sorted(Path(__file__).parent.glob("[!_]*.py"))
