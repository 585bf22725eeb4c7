"""Time of cores that others than this process have taken."""

from __future__ import annotations

import resource


def children_s() -> float:
    """Time of a core that ended children of this process have taken."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
