"""Metal flow by MPS with improved multiple relaxation, after Hirata and Anzai 2017.

Arrays of vectors have three components here; in 2D the last is zero. Equation numbers are those of
the paper (Mater. Trans. 58, 479-484).
"""

import hashlib
import os
from pathlib import Path

import numba

# Numba notices a change in a kernel's own file, not in the files of what it calls: each state of
# all kernels here has a cache of its own.
_TEXTS = [path.read_bytes() for path in sorted(Path(__file__).parent.glob("*.py"))]
_KERNELS = b"".join(text for text in _TEXTS if b"@njit" in text)
_CACHES = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "sandmould"
_STATE = hashlib.sha256(numba.__version__.encode() + _KERNELS).hexdigest()[:12]
numba.config.CACHE_DIR = str(_CACHES / f"mps-{_STATE}")  # type: ignore[attr-defined]
