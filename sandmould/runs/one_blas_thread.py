"""Imported before numpy by what computes runs: linear algebra has the thread that calls it.

A run has the cores that its job was given, and the fork server must not have threads when it forks.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
