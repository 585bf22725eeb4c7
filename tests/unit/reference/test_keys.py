"""What ``sandmould keys`` says of the keys of a study's file."""

from __future__ import annotations

import pytest

from sandmould.bad_input import BadInputError
from sandmould.kinds.registry import KINDS
from sandmould.reference.keys import keys_text


def test_a_study_has_its_keys_and_says_which_have_keys_below() -> None:
    text = keys_text()
    assert "\n  replicates  (default 1)\n" in text
    assert "\n  sweep ...\n" in text
    for kind in KINDS:
        assert f"(kind: {kind}):" in text
    # Kinds of study share most keys, which are told once.
    assert text.count("\n  replicates") == 1


def test_a_section_has_units_choices_and_defaults() -> None:
    text = keys_text("scenario.vibration")
    assert "frequency_hz  (in Hz; default 50.0)" in text
    assert "hold  (one of acceleration, velocity, displacement, unbalance; default" in text
    # Both kinds of stage, and the value that chooses each.
    assert "Keys of scenario.vibration (kind: rest):\n\n  kind  (must be rest)" in text
    assert keys_text("scenario.vibration.0") == text


def test_one_key_is_told_alone() -> None:
    text = keys_text("scenario.sand.disc_thickness_m")
    assert text.startswith('  disc_thickness_m  (in m; default "grain")\n      Length of a disc')
    assert len(text.splitlines()) == 3


@pytest.mark.parametrize(
    ("path", "told"),
    [
        ("refin", r"PATH = 'refin' cannot be used: valid is a key of a study, such as refine"),
        ("scenario.vibration.frequency", r"a key of scenario.vibration, such as .*frequency_hz"),
        ("replicates.x", r"PATH = 'replicates.x' .* a key of replicates"),
    ],
)
def test_a_key_that_is_not_there_is_told_with_the_nearest(path: str, told: str) -> None:
    with pytest.raises(BadInputError, match=told):
        keys_text(path)
