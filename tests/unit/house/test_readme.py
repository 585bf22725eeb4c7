"""The README stays one page, and its links lead somewhere."""

from __future__ import annotations

import re

from sandmould import ROOT

README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_it_is_one_page() -> None:
    words = [word for word in README.split() if re.search(r"\w", word)]
    assert len(words) <= 900


def test_its_links_and_pictures_are_there() -> None:
    links = re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", README)
    assert len(links) > 20
    assert [link for link in links if not (ROOT / link).exists()] == []


def test_its_film_is_small() -> None:
    assert 10_000 < (ROOT / "docs/film.webp").stat().st_size < 3_000_000
