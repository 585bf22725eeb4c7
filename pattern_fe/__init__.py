"""The foam pattern as an elastic body that the sand bends.

Arrays go in and out: displacements (m) and loads (N) have one row a node or, on the surface that an
engine is given, one row a vertex. In 2D everything is per thickness of the pattern, so that loads
are in N. The vertical axis is the last one.
"""

from pathlib import Path

from sandmould.digest import code_identity


def source_files() -> list[Path]:
    """All files of this room."""
    return sorted(Path(__file__).parent.rglob("*.py"))


def source_hash() -> str:
    """Hash of what this room computes, which results of bent patterns depend on."""
    return code_identity([source_files()])
