"""Words of our own that no reader from outside knows stand in no text for users."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest

from sandmould import ROOT
from tests.unit.house.test_sentences import literals

BETTER = {
    "hard sand": "stiff grains: the hardness of a mould is something else",
    "soft sand": "grains that are too soft",
    "hardness of the": "stiffness of the grains",
    "as hard as": "as stiff as",
    "told apart": "differ, or show a difference",
    "tell apart": "show a difference",
    "in the mean": "on average",
    "left to it": "random",
    "by lot": "random",
    "artefact of": "comes from the model, its time step or its springs",
    "mass-median": "of median size",
    "alike but": "differ only in",
    "by itself at": "natural frequency",
    "inner optimum": "a best value inside the range",
    "not told": "not known",
    "can be told": "is known",
    "foretell": "predict",
    "stand-in": "placeholder",
}

TEXTS = ("README.md", "docs/*.md", "docs/tutorials/*.md", "docs/how-to/*.md",
         "docs/explanation/*.md", "templates/*/*.j2", "templates/report/*.html",
         "sandmould/wording/*.py")  # fmt: skip
"""Where users read; records quote what was said in their time."""
GENERATED = ("keys.md", "measures.md", "reproduction*.md", "verification*.md")
"""Pages of the reference and of other people's claims, in the field's own words."""


def texts() -> Iterator[tuple[str, str]]:
    """Each file with what a user reads of it."""
    for pattern in TEXTS:
        for path in sorted(ROOT.glob(pattern)):
            if any(path.match(page) for page in GENERATED):
                continue
            text = path.read_text(encoding="utf-8")
            if path.suffix == ".py":
                text = "\n".join(literals(text))
            text = re.sub(r"{[%#].*?[%#]}", "", text)  # names of verdicts are no words for users
            yield path.relative_to(ROOT).as_posix(), text


@pytest.mark.parametrize("word", BETTER)
def test_nobody_reads_our_dialect(word: str) -> None:
    spoken = re.compile(rf"\b{word}", re.IGNORECASE)
    found = [name for name, text in texts() if spoken.search(" ".join(text.split()))]
    assert not found, f"{word!r}: better say {BETTER[word]}"
