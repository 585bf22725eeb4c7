"""Studies that are refused, and what is said then."""

from __future__ import annotations

from pathlib import Path

import pytest

from sandmould.bad_input import BadInputError
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study


def refused(folder: Path, text: str | bytes, monkeypatch: pytest.MonkeyPatch) -> str:
    """Write a study as ``trial.yaml``, open and expand it, and give the message."""
    monkeypatch.chdir(folder)
    path = Path("trial.yaml")
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    with pytest.raises(BadInputError) as caught:
        expand(open_study(path))
    return str(caught.value)
