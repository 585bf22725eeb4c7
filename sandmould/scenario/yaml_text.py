"""YAML as users write it: strict numbers, no key twice, and a bound on what a text unfolds to."""

from __future__ import annotations

import re
from typing import Any

import yaml

from sandmould.limits import YAML_ALIASES, YAML_DEPTH, YAML_VALUES

_TAG = "tag:yaml.org,2002:"


def _mapping(loader: Any, node: yaml.MappingNode) -> dict[str, Any]:
    first: dict[str, int] = {}
    for key_node, _ in node.value:
        if key_node.tag == f"{_TAG}merge":
            continue
        key, mark = loader.construct_object(key_node, deep=True), key_node.start_mark
        if not isinstance(key, str):
            fault = f"key {key!r} is no text: put it in quotes"
        elif key in first:
            fault = f"key {key!r} stands twice, first in line {first[key]}"
        else:
            first[key] = mark.line + 1
            continue
        raise yaml.constructor.ConstructorError(None, None, fault, mark)
    loader.flatten_mapping(node)
    return {
        loader.construct_object(k, deep=True): loader.construct_object(v, deep=True)
        for k, v in node.value
    }


class _Bounded(yaml.SafeLoader):
    """Counts levels and aliases as it reads, and values before it makes any."""

    def __init__(self, stream: str) -> None:
        super().__init__(stream)
        self._depth = self._aliases = 0

    def compose_node(self, parent: Any, index: Any) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            self._aliases += 1
            YAML_ALIASES.check("file", self._aliases)
        self._depth += 1
        if self._depth > YAML_DEPTH.most:
            YAML_DEPTH.check("file", self._depth)
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node

    def construct_document(self, node: yaml.Node) -> Any:
        """Make the values of a document, unless aliases multiply them beyond all measure."""
        YAML_VALUES.check("file", _unfolded(node, {}))
        return super().construct_document(node)


def _unfolded(node: yaml.Node, known: dict[int, int]) -> int:
    """Values of a node with all aliases followed; each node is looked at once."""
    if id(node) not in known:
        known[id(node)] = 1  # of one that holds itself, which the constructor refuses
        parts = node.value if isinstance(node, yaml.CollectionNode) else []
        if isinstance(node, yaml.MappingNode):
            parts = [part for pair in parts for part in pair]
        known[id(node)] = 1 + sum(_unfolded(part, known) for part in parts)
    return known[id(node)]


def _strict(parser: Any) -> Any:
    """A loader whose 7e4 is a number and whose repeated keys are refused."""

    class Loader(parser):
        pass

    Loader.add_implicit_resolver(
        f"{_TAG}float",
        re.compile(r"^[-+]?(\d[\d_]*\.?[\d_]*|\.\d[\d_]*)([eE][-+]?\d+)?$"),
        list("-+0123456789."),
    )
    Loader.add_implicit_resolver(f"{_TAG}int", re.compile(r"^[-+]?\d[\d_]*$"), list("-+0123456789"))
    # The first match wins in PyYAML: plain integers must be asked before floats.
    for resolvers in Loader.yaml_implicit_resolvers.values():
        resolvers.sort(key=lambda item: not item[0].endswith(":int"))
    Loader.add_constructor(f"{_TAG}map", _mapping)
    return Loader


def _as_in_yaml_1_2(loader: Any) -> Any:
    """Let a loader read scalars as YAML 1.2: for 1.1 1:30 is 90, 010 is 8, ``no`` is false."""
    core = {
        "null": r"~|null|Null|NULL|",
        "bool": r"true|True|TRUE|false|False|FALSE",
        "int": r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+",
        "float": r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?"
        r"|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)",
    }
    loader.yaml_implicit_resolvers = {}
    for name, pattern in core.items():
        loader.add_implicit_resolver(f"{_TAG}{name}", re.compile(rf"(?:{pattern})$"), None)
    loader.add_implicit_resolver(f"{_TAG}merge", re.compile("<<$"), None)
    loader.yaml_constructors = {
        tag: constructor
        for tag, constructor in loader.yaml_constructors.items()
        if tag is None or tag.removeprefix(_TAG) in (*core, "str", "seq", "map")
    }
    loader.add_constructor(f"{_TAG}int", _integer)
    loader.add_constructor(f"{_TAG}str", _text)
    return loader


def _integer(loader: Any, node: yaml.ScalarNode) -> int:
    text = str(loader.construct_scalar(node))
    base = {"0o": 8, "0x": 16}.get(text[:2], 10)
    return int(text, base)


_UNSEEN = re.compile(
    r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069\ud800-\udfff]"
)
"""Characters that steer a terminal or the direction of a line, and halves of characters."""


def _text(loader: Any, node: yaml.ScalarNode) -> str:
    text = str(loader.construct_scalar(node))
    if unseen := _UNSEEN.search(text):
        fault = f"U+{ord(unseen[0]):04X} is no character that can be shown"
        raise yaml.constructor.ConstructorError(None, None, fault, node.start_mark)
    return text


_OF_USERS = _as_in_yaml_1_2(_strict(_Bounded))
_OF_THE_PLAN = _strict(getattr(yaml, "CSafeLoader", yaml.SafeLoader))


def load_users(text: str) -> Any:
    """Values of a text that a user wrote.

    Raises
    ------
    BadInputError
        Beyond a limit.
    yaml.YAMLError, ValueError, RecursionError
        When it is no YAML.
    """
    return yaml.load(text, Loader=_OF_USERS)


def load_planned(text: str) -> Any:
    """Values of a text that the plan of a study wrote.

    libyaml reads it six times as fast as Python, and a report reads hundreds. What it says of a
    fault teaches less, so it does not read the files of users. Nested without end a text crashes
    it: one that may be so, or repeats a part of itself, is looked through first.

    Raises
    ------
    yaml.YAMLError, ValueError, RecursionError
        When it is no YAML as a plan writes it.
    """
    if "&" in text or any(text.count(sign) > YAML_DEPTH.most for sign in "[{-?"):
        _check_levels(text)
    return yaml.load(text, Loader=_OF_THE_PLAN)


def _check_levels(text: str) -> None:
    """Refuse a text with an alias, or nested deeper than a study."""
    depth = 0
    for event in yaml.parse(text, Loader=_OF_THE_PLAN):
        opens = isinstance(event, yaml.CollectionStartEvent)
        depth += opens - isinstance(event, yaml.CollectionEndEvent)
        if depth > YAML_DEPTH.most:
            raise RecursionError
        if isinstance(event, yaml.AliasEvent):
            raise ValueError("a part of it is repeated")


def fault_of(error: Exception) -> str:
    """What a parser found, with its line, as a sentence without its full stop."""
    mark = getattr(error, "problem_mark", None)
    if isinstance(error, RecursionError):
        return "it cannot be read as YAML: nested too deeply"
    if mark is None:
        return f"it cannot be read as YAML: {' '.join(str(error).split())}"
    problem = str(getattr(error, "problem", None))
    if "\\t" in problem:
        problem = "a tab stands there; YAML is indented with spaces"
    if problem.startswith("mapping values"):
        problem = (
            "no key can stand before its last colon: put a text that holds ': ' in quotes, or "
            "indent the line like those beside it"
        )
    return f"line {mark.line + 1} cannot be read as YAML: {problem}"
