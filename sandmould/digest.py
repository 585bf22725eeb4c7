"""Hashes of texts and files: what tells one state of a thing from another."""

from __future__ import annotations

import ast
import contextlib
import functools
import hashlib
import re
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from sandmould.user_cache import user_cache

_Block = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef
_PATH = re.compile(r"\bsandmould[./][\w./]*")
"""Where a file of the house lies, by its path or its name as a module."""
SHORT = 12
"""Digits of a hash that names a state of some sources."""
EQUAL_CODE = Path(__file__).with_name("equal_code.toml")
"""Hashes of code by what replaced it and computes the same digits."""


def digest(*parts: str | bytes) -> str:
    """SHA-256 of texts or bytes joined, in hexadecimal digits."""
    joined = b"".join(part.encode() if isinstance(part, str) else part for part in parts)
    return hashlib.sha256(joined).hexdigest()


def file_digest(path: Path) -> str:
    """SHA-256 of a file.

    Raises
    ------
    OSError
        When it cannot be read.
    """
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def code_identity(groups: Iterable[Iterable[Path]], *parts: str) -> str:
    """Short hash of texts and of what groups of Python files compute: what results depend on.

    A group that ``EQUAL_CODE`` lists has the identity of the code that it replaced.
    """
    states = {code_digest(paths) for paths in groups}
    return digest(*parts, *sorted(equal_code().get(state, state) for state in states))[:SHORT]


@functools.cache
def equal_code() -> dict[str, str]:
    """Hash of the code that was replaced, by the hash of the one with the same digits."""
    listed = tomllib.loads(EQUAL_CODE.read_text(encoding="utf-8"))
    return {state: before for pairs in listed.values() for state, before in pairs.items()}


def code_digest(paths: Iterable[Path]) -> str:
    """Short hash of the statements of Python files, equal on every Python that is supported.

    Left out are comments, docstrings, layout, imports, names of files and modules of the house, the
    annotations of functions and of their variables, and in which of the files a statement of a
    module stands. Fields of classes are code: their annotations stay.
    """
    return _digest_of(tuple(path.read_bytes() for path in paths))


@functools.cache
def _digest_of(sources: tuple[bytes, ...]) -> str:
    """The same of texts, kept for later starts by their hashes and that of this file."""
    own = Path(__file__).read_bytes()
    kept = user_cache() / "code" / digest(*map(digest, (own, *sources)))
    with contextlib.suppress(OSError):
        if len(known := kept.read_text(encoding="ascii", errors="replace")) == SHORT:
            return known
    statements = [text for source in sources for text in _statements_in(source)]
    found = digest("\n".join(sorted(statements)))[:SHORT]
    with contextlib.suppress(OSError):  # it is found anew where nothing can be kept
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_text(found, encoding="ascii")
    return found


def _statements_in(source: bytes) -> Iterator[str]:
    """What each statement of a module computes."""
    module = _Computing().visit(ast.parse(source))
    return (_text(statement) for statement in module.body if not _for_types(statement))


def _for_types(statement: ast.stmt) -> bool:
    """Whether a statement is one under ``if TYPE_CHECKING``."""
    return (
        isinstance(statement, ast.If)
        and isinstance(statement.test, ast.Name)
        and statement.test.id == "TYPE_CHECKING"
    )


def _text(node: Any) -> str:
    """A node of a tree as text of our own: that of ``ast.dump`` differs from Python to Python."""
    if isinstance(node, ast.Constant):
        return f"Constant({_PATH.sub('a path', repr(node.value))})"
    if isinstance(node, ast.AST):
        parts = [f"{name}={_text(value)}" for name, value in _fields(node)]
        return f"{type(node).__name__}({', '.join(parts)})"
    return f"[{', '.join(map(_text, node))}]" if isinstance(node, list) else repr(node)


def _fields(node: ast.AST) -> Iterator[tuple[str, Any]]:
    """Fields that say something: later Pythons have more, which are empty in older code."""
    for name, value in ast.iter_fields(node):
        if value is not None and value != []:
            yield name, _joined(value) if isinstance(node, ast.JoinedStr) else value


def _joined(parts: list[ast.expr]) -> list[ast.expr]:
    """Parts of an f-string, texts side by side as one: Pythons cut them in different places."""
    joined: list[ast.expr] = []
    for part in parts:
        last = joined[-1] if joined else None
        if isinstance(part, ast.Constant) and isinstance(last, ast.Constant):
            joined[-1] = ast.Constant(str(last.value) + str(part.value))
        elif not isinstance(part, ast.Constant) or part.value:
            joined.append(part)
    return joined


class _Computing(ast.NodeTransformer):
    """Leaves of a tree what computes."""

    _in_class = False

    def visit_Import(self, node: ast.Import) -> None:
        return None

    def visit_ImportFrom(self, node: ast.ImportFrom) -> None:
        return None

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        node.returns = None
        return self._visit_block(node, is_class=False)

    def visit_AsyncFunctionDef(self, node: ast.AsyncFunctionDef) -> ast.AST:
        node.returns = None
        return self._visit_block(node, is_class=False)

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.AST:
        return self._visit_block(node, is_class=True)

    def _visit_block(self, node: _Block, is_class: bool) -> ast.AST:
        around, self._in_class = self._in_class, is_class
        self.generic_visit(node)
        self._in_class = around
        # what held a docstring alone does nothing
        node.body = node.body or [ast.Pass()]
        return node

    def visit_arg(self, node: ast.arg) -> ast.AST:
        node.annotation = None
        return node

    def visit_Expr(self, node: ast.Expr) -> ast.AST | None:
        text = isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
        return None if text else self.generic_visit(node)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST:
        self.generic_visit(node)
        if self._in_class:
            return node
        if node.value is None:
            # still makes a name local
            node.annotation = ast.Constant(None)
            return node
        return ast.Assign([node.target], node.value)
