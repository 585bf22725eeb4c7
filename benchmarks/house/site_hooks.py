"""What MkDocs is told beyond ``mkdocs.yml``: results in the navigation, files that pages link to.

The list of results in the navigation is followed by an entry for each, under the headings of the
list. Its title is the study's question, in short: without what stands in brackets.

In a clone a page of ``docs/`` may link to ``../config/default.yaml``. The site holds ``docs/``
alone, so each such file is copied to ``files/`` in it, and the link leads there. A link to a file
that does not exist is left as it is, and the strict build refuses it.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

from benchmarks.house.record_pages import by_theme, pages
from sandmould import ROOT

RESULTS = "results/README.md"
"""Their list in the navigation."""
BRACKETS = re.compile(r"\s*\([^)]*\)")
LINK = re.compile(r"(?<=\]\()\.\./[^)#\s]+")


def outside(target: str, page: str) -> str | None:
    """File of the repository outside ``docs/`` that a link of a page leads to, if there is one.

    Parameters
    ----------
    target : str
        The link, such as ``../config/default.yaml``.
    page : str
        The page as seen from ``docs/``.
    """
    path = posixpath.normpath(posixpath.join("docs", posixpath.dirname(page), target))
    inside = path.startswith(("docs/", "..")) or not (ROOT / path).is_file()
    return None if inside else path


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Put an entry for each result below their list."""
    results = {"Results": [{"All results": RESULTS}, *_results()]}
    config.nav = [results if e == {"Results": RESULTS} else e for e in config.nav or []]
    return config


def _results() -> Iterator[dict[str, list[dict[str, str]]]]:
    for theme, records in by_theme(pages()).items():
        asked = [record.question for record in records]
        titles = [BRACKETS.sub("", question) for question in asked]
        # Brackets tell studies of one question apart.
        short = [t if titles.count(t) == 1 else q for t, q in zip(titles, asked, strict=True)]
        places = [f"results/{record.name}/README.md" for record in records]
        yield {theme: [{title: place} for title, place in zip(short, places, strict=True)]}


def on_files(files: Files, config: MkDocsConfig, **_: Any) -> Files:
    """Add the files that pages link to."""
    for path in sorted(set(_linked(files))):
        files.append(File.generated(config, f"files/{path}", abs_src_path=str(ROOT / path)))
    return files


def _linked(files: Files) -> Iterator[str]:
    for page in files.documentation_pages():
        for target in LINK.findall(page.content_string):
            if path := outside(target, page.src_uri):
                yield path


def on_page_markdown(markdown: str, page: Page, **_: Any) -> str:
    """Lead links that leave ``docs/`` to the copies."""
    at = page.file.src_uri

    def led(link: re.Match[str]) -> str:
        path = outside(link[0], at)
        start = posixpath.dirname(at) or "."
        return posixpath.relpath(f"files/{path}", start) if path else link[0]

    return LINK.sub(led, markdown)
