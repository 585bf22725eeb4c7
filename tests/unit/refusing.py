"""Studies that are refused, and what is said then."""

from __future__ import annotations

from pathlib import Path

import pytest

from sandmould.bad_input import BadInputError
from sandmould.study.plan.build_plan import open_plan


def refused(folder: Path, text: str | bytes, monkeypatch: pytest.MonkeyPatch) -> str:
    """Write a study as ``trial.yaml``, plan it, and give the message."""
    monkeypatch.chdir(folder)
    path = Path("trial.yaml")
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    with pytest.raises(BadInputError) as caught:
        open_plan(path)
    return str(caught.value)
