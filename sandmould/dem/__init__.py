"""The reference solver: Rojek 2004, section 3, on arrays, compiled by numba.

It knows no scenario: ``sandmould.engines.reference`` hands it arrays. The number of components of
its arrays says whether it computes discs (2) or spheres (3); nothing else differs.
"""

from importlib.metadata import version
from pathlib import Path

from sandmould.digest import code_identity


def source_files() -> list[Path]:
    """Files of this room."""
    return sorted(Path(__file__).parent.glob("*.py"))


def source_hash() -> str:
    """Hash of what this room computes: what a compiled kernel, and so a result, depends on."""
    return code_identity([source_files()], version("numba"))
