"""Imported first by a job: Ctrl-C, which reaches every process of a terminal, ends it silently."""

import signal

signal.signal(signal.SIGINT, signal.SIG_DFL)
