"""The documentation site: it builds without a warning and loads nothing from the network."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from mkdocs.commands.build import build
from mkdocs.config import load_config
from mkdocs.exceptions import Abort

from sandmould import ROOT

LOADED = re.compile(
    r"""<(?:script|img|iframe|source|video)[^>]*\ssrc=["']?(https?:)?//"""
    r"""|<link[^>]*rel=["']?(?:stylesheet|preconnect|icon)[^>]*href=["']?(https?:)?//"""
)


def write_site(folder: Path, **changes: object) -> None:
    """Build as ``make docs`` does, strictly."""
    config = load_config(
        str(ROOT / "mkdocs.yml"), strict=True, site_dir=str(folder / "site"), **changes
    )
    config.plugins.on_startup(command="build", dirty=False)
    build(config)


def test_it_builds_strictly_and_loads_nothing_from_the_network(tmp_path: Path) -> None:
    write_site(tmp_path)
    pages = list((tmp_path / "site").rglob("*.html"))
    assert len(pages) > 25
    loading = [p.name for p in pages if LOADED.search(p.read_text(encoding="utf-8"))]
    assert loading == []
    assert 'rel="stylesheet"' in (tmp_path / "site/index.html").read_text(encoding="utf-8")
    # A file of the repository that a page links to is in the site.
    assert (tmp_path / "site/files/profiles/slurm/config.yaml").is_file()


@pytest.mark.parametrize("link", ["gone.md", "../config/gone.yaml", "index.md#gone"])
def test_a_broken_link_or_anchor_stops_it(tmp_path: Path, link: str) -> None:
    docs = tmp_path / "docs"
    docs.mkdir()
    (docs / "index.md").write_text(f"# Sand\n\n[broken]({link})\n")
    with pytest.raises(Abort, match="warnings in strict mode"):
        write_site(tmp_path, docs_dir=str(docs), nav=["index.md"])
