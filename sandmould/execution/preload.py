"""Imported by the fork server: what runs need is loaded once, before the first of them asks."""

import gc
import os
import signal
import traceback
from pathlib import Path

import sandmould.runs.one_blas_thread  # noqa: F401
from sandmould.execution.pool import LOADED_FIRST
from sandmould.runs.parent import call_process

# A cluster tells all processes of a job that its time ends: runs stop softly, the server waits.
signal.signal(signal.SIGTERM, signal.SIG_IGN)
call_process("sandmould-ready")
if scenarios := os.environ.get(LOADED_FIRST):
    from sandmould.execution import jobs  # with all that jobs import

    for path in scenarios.split(os.pathsep):
        try:
            jobs.load_for(jobs.read_run(Path(path)).scenario)
        except Exception:  # the run meets the same; the server must live for the others
            traceback.print_exc()
    gc.freeze()  # a child that looks through what is here would copy it
