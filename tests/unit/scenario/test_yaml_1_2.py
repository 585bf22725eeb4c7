"""Plain values of users' files are read as YAML 1.2 reads them, and text can be seen."""

from __future__ import annotations

import math
from typing import Any

import pytest
import yaml

from sandmould.scenario.yaml_text import load_users


@pytest.mark.parametrize(
    ("written", "read"),
    [
        ("1:30", "1:30"), ("010", 10), ("-010", -10), ("0o10", 8), ("0x1F", 31), ("1_0", "1_0"),
        ("no", "no"), ("true", True), ("2026-11-27", "2026-11-27"), ("7e4", 7e4), (".5", 0.5),
        ("1.", 1.0), (".inf", math.inf), ("~", None), ("", None), ('"a\\tb"', "a\tb"),
    ],
)  # fmt: skip
def test_plain_values(written: str, read: Any) -> None:
    found = load_users(f"key: {written}")["key"]
    assert found == read
    assert type(found) is type(read)


@pytest.mark.parametrize(
    ("written", "says"),
    [
        ('"\\e]0;owned\\a"', "U+001B is no character that can be shown"),
        ('"\\u202Eevil"', "U+202E is no character that can be shown"),
        ('"\\ud800"', "U+D800 is no character that can be shown"),
        ("!!binary aGVsbG8=", "binary"),
        ("!!timestamp 2026-11-27", "timestamp"),
    ],
)
def test_what_is_refused(written: str, says: str) -> None:
    with pytest.raises(yaml.YAMLError) as refused:
        load_users(f"key: {written}")
    assert says in str(refused.value)


def test_a_merged_part_is_still_read() -> None:
    assert load_users("a: &x {b: 1}\nc: {<<: *x, d: 2}")["c"] == {"b": 1, "d": 2}
