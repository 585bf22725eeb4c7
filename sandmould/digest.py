"""Hashes of texts and files: what tells one state of a thing from another."""

from __future__ import annotations

import ast
import functools
import hashlib
from collections.abc import Iterable
from pathlib import Path

_Block = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef
SHORT = 12
"""Digits of a hash that names a state of some sources."""


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
    return digest(path.read_bytes())


def sources_digest(paths: Iterable[Path], *parts: str) -> str:
    """Short hash of texts and, after them, of files in the order of their paths."""
    return digest(*parts, *(path.read_bytes() for path in sorted(paths)))[:SHORT]


def code_digest(paths: Iterable[Path], *parts: str) -> str:
    """Short hash of texts and of what Python files compute, in the order of their paths.

    Comments, docstrings, layout and the annotations of functions and of their variables are left
    out. Fields of classes are code: their annotations stay.
    """
    return digest(*parts, *(_code_in(path.read_bytes()) for path in sorted(paths)))[:SHORT]


@functools.cache
def _code_in(source: bytes) -> str:
    """What a Python file computes, as text; kept, since a plan asks for each of its runs."""
    return ast.dump(_Computing().visit(ast.parse(source)))


class _Computing(ast.NodeTransformer):
    """Leaves of a tree what computes."""

    _in_class = False

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
