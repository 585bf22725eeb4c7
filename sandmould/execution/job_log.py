"""Send what a job prints, and how it failed, to its log."""

from __future__ import annotations

import contextlib
import traceback
from collections.abc import Iterator
from pathlib import Path


@contextlib.contextmanager
def to_log(path: str) -> Iterator[None]:
    """Send standard output and errors to a file; the last line of a failure goes to both."""
    with Path(path).open("w", encoding="utf-8") as log, contextlib.redirect_stdout(log):
        try:
            with contextlib.redirect_stderr(log):
                yield
        except Exception as error:
            traceback.print_exc(file=log)
            raise SystemExit(f"{type(error).__name__}: {error} (more in {path})") from error
