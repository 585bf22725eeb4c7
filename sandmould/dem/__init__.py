"""The reference solver: Rojek 2004, section 3, on arrays, compiled by numba.

It knows no scenario: ``sandmould.engines.reference`` hands it arrays. The number of components of
its arrays says whether it computes discs (2) or spheres (3); nothing else differs.
"""

from pathlib import Path

import numba

from sandmould.digest import sources_digest


def source_hash() -> str:
    """Hash of this room's sources: what a compiled kernel, and so a result, depends on."""
    return sources_digest(Path(__file__).parent.glob("*.py"), numba.__version__)
