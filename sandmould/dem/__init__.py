"""The reference solver: Rojek 2004, section 3, on arrays, compiled by numba.

It knows no scenario: ``sandmould.engines.reference`` hands it arrays. The number of components of
its arrays says whether it computes discs (2) or spheres (3); nothing else differs.
"""

import hashlib
from pathlib import Path

import numba


def source_hash() -> str:
    """Hash of this room's sources: what a compiled kernel, and so a result, depends on."""
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]
