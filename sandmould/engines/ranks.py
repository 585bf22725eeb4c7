"""What ``engine.ranks`` means to an engine."""

from __future__ import annotations

from enum import Enum


class Ranks(Enum):
    """How an engine shares the work of one run."""

    PROCESSES = "MPI ranks, each a process"
    THREADS = "threads of one process"
    ONE = "one process without threads"
