"""Names, rooms and imports of the house, on a small tree and on this one."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks.house import architecture
from benchmarks.house.architecture import page_text
from benchmarks.house.names import doubled_names, main
from benchmarks.house.picture import draw_house
from benchmarks.house.rooms import Room, read_house

CONTRACT = """\
[[tool.importlinter.contracts]]
name = "imports point one way"
layers = [
  "sandmould.cli", "sandmould.analysis | (sandmould.engines)", "sandmould.dem", "sandmould.absent"
]
"""
FILES = {
    "pyproject.toml": CONTRACT,
    "Snakefile": 'include: "workflow/rules/run.smk"\n',
    "workflow/rules/run.smk": "from sandmould.cli.verbs import run\n\nrule all:\n    input: 1",
    "sandmould/__init__.py": "ROOT = 1\n",
    "sandmould/cli/__init__.py": "",
    "sandmould/cli/verbs.py": (
        "from sandmould import ROOT, dem\nimport numpy\n\n\ndef run():\n"
        "    from sandmould.engines.bed import Bed\n    import sandmould.analysis.fill\n"
    ),
    "sandmould/engines/bed.py": "from sandmould.dem import step\n\n\nclass Bed:\n    pass\n",
    "sandmould/dem.py": "class Bed:\n    class Grain:\n        pass\n",
    "sandmould/analysis/fill.py": "class Grain:\n    pass\n",
    "benchmarks/peers/sweep/bed.py": "class Grain:\n    pass\n",
}


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A small house."""
    for name, text in FILES.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return tmp_path


def test_doubled_names_have_their_places(tree: Path, capsys: pytest.CaptureFixture[str]) -> None:
    # Neither a class within another nor what users of other tools write counts.
    assert doubled_names(tree) == {"Bed": ["sandmould/dem.py:1", "sandmould/engines/bed.py:4"]}
    assert main(tree) == 1
    said = "Bed is 2 classes: sandmould/dem.py:1, sandmould/engines/bed.py:4\n"
    assert capsys.readouterr().out == said
    (tree / "sandmould" / "dem.py").write_text("class Sand:\n    pass\n")
    assert main(tree) == 0
    assert capsys.readouterr().out == ""


def test_rooms_imports_and_floors(tree: Path) -> None:
    house = read_house(tree)
    assert house.rooms["sandmould.engines"] == Room("sandmould.engines", 1, 5)
    assert house.rooms["workflow"] == Room("workflow", 2, 5)
    assert "sandmould" not in house.rooms
    assert house.imports == {
        ("sandmould.cli", "sandmould.analysis"): 1,
        ("sandmould.cli", "sandmould.dem"): 1,
        ("sandmould.cli", "sandmould.engines"): 1,
        ("sandmould.engines", "sandmould.dem"): 1,
        ("workflow", "sandmould.cli"): 1,
    }
    # Programs of other tools are no room of the house.
    above = ("workflow",)
    siblings = ("sandmould.analysis", "sandmould.engines")
    assert house.floors == (above, ("sandmould.cli",), siblings, ("sandmould.dem",))
    assert house.upward == []
    (tree / "sandmould" / "dem.py").write_text("import sandmould.cli.verbs\n")
    assert read_house(tree).upward == [("sandmould.dem", "sandmould.cli")]


def test_picture_is_the_same_every_time(tree: Path, tmp_path: Path) -> None:
    texts = []
    for name in ("a.svg", "b.svg"):
        draw_house(read_house(tree), tmp_path / name)
        texts.append((tmp_path / name).read_text(encoding="utf-8"))
    assert texts[0] == texts[1]
    assert all(f">{name}<" in texts[0] for name in ("cli", "dem", "engines", "analysis"))


def test_rooms_of_before_and_now_are_listed(tree: Path) -> None:
    before = {"commit": "abc", "rooms": [{"name": "sandmould.old", "files": 3, "lines": 30}]}
    page = page_text(read_house(tree), before)
    assert "| `sandmould.old` | 3 | 30 | | |" in page
    assert "| `sandmould.engines` |  |  | 1 | 5 |" in page


def test_page_of_this_house(tmp_path: Path) -> None:
    assert architecture.main(tmp_path / "architecture.md") == 0
    page = (tmp_path / "architecture.md").read_text(encoding="utf-8")
    assert "Every import runs down" in page
    assert (tmp_path / architecture.PICTURE).stat().st_size > 1e4
    kept = json.loads(architecture.BEFORE.read_text(encoding="utf-8"))
    assert sum(room["lines"] for room in kept["rooms"]) == 80040
