"""What an engine said last, where its process ended without a word."""

from __future__ import annotations

import os
from pathlib import Path

from sandmould.execution.jobs import _last_words


def test_the_newest_log_ends_with_them(tmp_path: Path) -> None:
    assert _last_words(tmp_path) == ""
    for number, text in enumerate(("first attempt\n", "step 5\nERROR: the orifice jammed\n\n")):
        log = tmp_path / f"engine_{number + 1}.log"
        log.write_text(text)
        os.utime(log, (number, number))
    assert _last_words(tmp_path) == "ERROR: the orifice jammed"
