"""Compiled templates are kept for the next process, and only where nobody else can write."""

from __future__ import annotations

from pathlib import Path
from types import CodeType

import pytest
from jinja2 import Environment, FileSystemLoader

from sandmould.kept_templates import kept_templates


def rendered(folder: Path) -> str:
    loader = FileSystemLoader(folder)
    return Environment(loader=loader, bytecode_cache=kept_templates()).get_template("a").render()


def test_a_template_is_compiled_once_and_again_when_it_is_edited(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    compiled: list[str] = []

    def note(self: Environment, source: str, name: str) -> CodeType:
        compiled.append(name)
        return compile(source, name, "exec")

    monkeypatch.setattr(Environment, "_compile", note)
    (tmp_path / "a").write_text("{{ 1 + 1 }}")
    assert [rendered(tmp_path), rendered(tmp_path)] == ["2", "2"]
    assert len(compiled) == 1
    (tmp_path / "a").write_text("{{ 1 + 2 }}")
    assert rendered(tmp_path) == "3"
    assert len(compiled) == 2


def test_nothing_is_kept_where_others_can_write(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    kept = tmp_path / "sandmould" / "templates"
    kept.mkdir(parents=True)
    kept.chmod(0o777)
    assert kept_templates() is None
