"""Imported by the fork server: what runs need is loaded once, before the first of them asks."""

import contextlib
import gc
import os
import signal
from pathlib import Path

import sandmould.runs.one_blas_thread  # noqa: F401
from sandmould.bad_input import BadInputError
from sandmould.execution.pool import LOADED_FIRST
from sandmould.runs.parent import call_process

# A cluster tells all processes of a job that its time ends: runs stop softly, the server waits.
signal.signal(signal.SIGTERM, signal.SIG_IGN)
call_process("sandmould-ready")
if scenarios := os.environ.get(LOADED_FIRST):
    from sandmould.execution.jobs import read_run
    from sandmould.execution.loading import load_for

    for scenario in scenarios.split(os.pathsep):
        with contextlib.suppress(BadInputError, OSError):  # the run says so itself
            load_for(read_run(Path(scenario)).scenario)
    gc.freeze()  # a child that looks through what is here would copy it
