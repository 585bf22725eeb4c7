"""Generate ``config/schema.json`` and ``config/default.yaml`` from the types.

Refresh both with ``python -m sandmould.reference.schema``.
"""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel

from sandmould import ROOT
from sandmould.definition.study import Study
from sandmould.kinds.registry import DEFAULT_KIND, KINDS
from sandmould.module_main import run_main
from sandmould.reference.keys import Key, keys_of
from sandmould.scenario.pattern import PatternConfig
from sandmould.scenario.quantity import Section

SCHEMA = ROOT / "config" / "schema.json"
DEFAULT = ROOT / "config" / "default.yaml"
Tree = dict[str, Any]


def schema_text() -> str:
    """JSON schema of a study's file; every leaf may also state its source."""
    schema, *others = (kind.study.model_json_schema() for kind in KINDS.values())
    definitions = schema.pop("$defs")
    scenarios = [part["properties"]["scenario"] for part in (schema, *others)]
    for other in others:
        # a name that both have is one section, but for names that pydantic had to tell apart
        definitions = other["$defs"] | definitions
        schema["properties"] = other["properties"] | schema["properties"]
    # The material states a part of it, and what the study is based on another.
    for name in (*(kind.scenario.__name__ for kind in KINDS.values()), PatternConfig.__name__):
        definitions[name].pop("required", None)
    # The kind may be that of the study which this one is based on.
    kind_key = schema["properties"]["kind"]
    about = {name: kind_key[name] for name in kind_key if name not in ("const", "type")}
    schema["properties"]["kind"] = {**about, "enum": list(KINDS), "type": "string"}
    schema["description"] = Study.model_json_schema()["description"].splitlines()[0]
    schema["properties"]["scenario"] = {
        "description": "What is simulated, by kind.",
        "anyOf": [{"$ref": scenario["$ref"]} for scenario in scenarios],
    }
    tree = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **_section(schema),
        "$defs": {name: _section(part) for name, part in sorted(definitions.items())},
    }
    return json.dumps(tree, indent=1) + "\n"


def _section(schema: Tree) -> Tree:
    properties = {name: _property(part) for name, part in schema.get("properties", {}).items()}
    section: Tree = {k: v for k, v in schema.items() if k != "title"}
    return {**section, "properties": properties}


def _property(schema: Tree) -> Tree:
    """A key as editors show it: its meaning with its unit; a value bare or with its source."""
    about: Tree = {k: schema[k] for k in ("description", "default") if k in schema}
    unit, source = schema.get("unit"), schema.get("source")
    rest = {k: v for k, v in schema.items() if k not in (*about, "unit", "source", "title")}
    if isinstance(about.get("default"), dict):
        del about["default"]  # The section's own keys say it.
    if unit is None:
        return {**about, **rest}
    about["description"] = f"{about['description']} Unit: {unit}. Default from: {source}."
    sourced = {
        "type": "object",
        "properties": {"value": rest, "unit": {"const": unit}, "source": {"type": "string"}},
        "required": ["value", "source"],
        "additionalProperties": False,
    }
    return {**about, "anyOf": [rest, sourced]}


def default_text() -> str:
    """All keys of a study with their defaults, each below its meaning, unit and source."""
    lines = [
        "# All keys of a study and their defaults; a study states only what differs.",
        "# Written by python -m sandmould.reference.schema.",
        *_lines(DEFAULT_KIND.study.model_validate({})),
    ]
    for kind in KINDS.values():
        if kind is not DEFAULT_KIND:
            lines += _entry_keys(kind.scenario, "", f"the scenario of a study of kind {kind.name}")
    return "\n".join(lines) + "\n"


def _lines(section: Section, indent: str = "") -> Iterator[str]:
    for key in keys_of(type(section)):
        value = getattr(section, key.name)
        yield from _comment(_meaning(key), indent)
        if isinstance(value, Section):
            yield f"{indent}{key.name}:"
            yield from _lines(value, indent + "  ")
            continue
        for entry in key.below:
            yield from _entry_keys(entry, indent)
        dump = section.model_dump(mode="json", include={key.name})[key.name]
        if isinstance(value, tuple) and value:
            yield f"{indent}{key.name}:"
            yield from (f"{indent}- {json.dumps(item)}" for item in dump)
        else:
            yield f"{indent}{key.name}: {json.dumps(dump)}"


def _entry_keys(entry: type[BaseModel], indent: str, called: str = "") -> Iterator[str]:
    """Keys of a section that the defaults do not show, as comments."""
    yield from _comment(f"Keys of {called or f'a {entry.__name__}'}:", indent)
    for key in keys_of(entry):
        known = [
            json.dumps(key.schema[name]) for name in ("default", "const") if name in key.schema
        ]
        text = f"{' '.join([f'{key.name}:', *known[:1]])}  {_meaning(key)}"
        yield from _comment(text.rstrip(), indent, "  ")


def _meaning(key: Key) -> str:
    meaning, unit, source = map(key.about, ("description", "unit", "source"))
    return (
        f"{meaning}{f' [{unit}]' if unit != '1' else ''} Source: {source}." if source else meaning
    )


def _comment(text: str, indent: str, inner: str = "") -> list[str]:
    first = f"{indent}# {inner}"
    return textwrap.wrap(text, 100, initial_indent=first, subsequent_indent=first + "  ")


def main() -> None:
    """Rewrite both files."""
    for path, text in ((SCHEMA, schema_text()), (DEFAULT, default_text())):
        path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    run_main(main, "python -m sandmould.reference.schema")
