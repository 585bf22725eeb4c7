"""Sentences stand in the templates of wording: what computes answers holds numbers and names."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

from sandmould import ROOT

WORDS = 4
"""A literal of so many is a sentence, or a part of one."""
OF_KEYS = ("quantity", "Field")
"""Calls whose texts describe keys for the reference."""
LEFT = {"statistics/config.py": 1}
"""Files that still hold some, and how many: none is added, and what is moved is struck."""
LEFT_OF_KINDS = 97
"""Notes of plans, in the kinds: at most so many."""


def literals(text: str) -> Iterator[str]:
    """Literals of four words or more, but for docstrings and what describes keys."""
    tree = ast.parse(text)
    apart = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") in OF_KEYS:
            apart |= {id(below) for below in ast.walk(node)}
        if isinstance(node, ast.JoinedStr):
            apart |= {id(part) for part in node.values}
    for node in ast.walk(tree):
        if id(node) in apart:
            continue
        said = ""
        if isinstance(node, ast.JoinedStr):
            parts = [v.value if isinstance(v, ast.Constant) else "X" for v in node.values]
            said = " ".join(map(str, parts))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            said = node.value
        if len(said.split()) >= WORDS:
            yield said


def counted(folder: str) -> dict[str, int]:
    """How many a file holds, of those that hold some."""
    root = ROOT / "sandmould"
    found = {p.relative_to(root).as_posix(): len(list(literals(p.read_text(encoding="utf-8"))))
             for p in sorted(Path(root / folder).rglob("*.py"))}  # fmt: skip
    return {name: count for name, count in found.items() if count}


def test_statistics_hold_no_sentences_but_those_listed() -> None:
    assert counted("statistics") == LEFT


def test_kinds_hold_no_more_sentences_than_they_did() -> None:
    assert sum(counted("kinds").values()) <= LEFT_OF_KINDS


def test_a_sentence_is_found_and_a_docstring_or_a_key_is_not() -> None:
    text = '''"""Four words of docstring."""
a = quantity(1, "The words of a key.")
b = f"the fill of {a}"
c = "two words"
'''
    assert list(literals(text)) == ["the fill of  X"]
