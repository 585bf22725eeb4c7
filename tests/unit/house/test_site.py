"""The documentation site: it builds without a warning and loads nothing from the network."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from mkdocs.commands.build import build
from mkdocs.config import load_config
from mkdocs.exceptions import Abort

from benchmarks.house import site_hooks
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
    # A page that is called README.md may be taken for the head of its section, and vanish.
    assert "Does resistance to twist change" in (tmp_path / "site/faq.html").read_text("utf-8")
    # A file of the repository that a page links to is in the site.
    assert (tmp_path / "site/files/profiles/slurm/config.yaml").is_file()


def test_each_result_has_its_own_entry_under_the_heading_of_its_theme() -> None:
    config = load_config(str(ROOT / "mkdocs.yml"))
    (results,) = (e["Results"] for e in site_hooks.on_config(config).nav or [] if "Results" in e)
    listed, *themes = results
    assert listed == {"All results": "results/README.md"}
    of_theme = {name: entries for theme in themes for name, entries in theme.items()}
    entries = {title: page for es in of_theme.values() for e in es for title, page in e.items()}
    records = {path.parent.name for path in (ROOT / "docs/results").glob("*/record.json")}
    assert sorted(entries.values()) == sorted(f"results/{name}/README.md" for name in records)
    depth = "Does the frequency that fills the tube best follow the depth of the bed?"
    assert {depth: "results/tube_law_depth/README.md"} in of_theme["Sand fills a tube"]
    heap = "Which angle of repose has the paper's sand in 3D?"
    assert entries[heap] == "results/repose_3d/README.md"
    # Two studies ask this; what stands in brackets tells them apart.
    coarse = "At which frequency does sand fill a blind tube best? (coarse grains, short vibration)"
    assert entries[coarse] == "results/tube_demo/README.md"


@pytest.mark.parametrize("link", ["gone.md", "../config/gone.yaml", "index.md#gone"])
def test_a_broken_link_or_anchor_stops_it(tmp_path: Path, link: str) -> None:
    docs = tmp_path / "docs"
    docs.mkdir()
    (docs / "index.md").write_text(f"# Sand\n\n[broken]({link})\n")
    with pytest.raises(Abort, match="warnings in strict mode"):
        write_site(tmp_path, docs_dir=str(docs), nav=["index.md"])
