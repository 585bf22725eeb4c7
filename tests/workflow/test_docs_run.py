"""What the pages have a person type is typed: block by block, in the order of the page.

A reader begins in an empty folder, saves each file under the name that the page gives it, and
gives each ``sh`` block to bash as it stands. Two tables say what differs from a real reader:
``NOT_TYPED`` and ``SMALLER``. An entry that fits no page any more is an error.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from sandmould.cli.study_file import study_file
from sandmould.kinds.sand.speed import SandSpeed
from sandmould.study.plan.build_plan import open_plan
from tests.workflow.pages import PAGES, blocks

NOT_TYPED = {
    "make demo": "a quarter of an hour",
    "make test": "it is what runs this test",
    "sandmould demo --quick": "test_wheel.py runs it",
    "sandmould again frequency_20_r1_45f4dc": "is again RUN of another page, which is typed",
    "sandmould compare A B": "needs two finished studies; test_comparison.py compares some",
    "sandmould run my_study.yaml --cluster": "needs Slurm; test_slurm.py has it",
    "sandmould run my_study.yaml --detach": "needs Slurm; test_slurm.py has it",
    "sandmould run my_study.yaml -- --executor": "needs a scheduler and its plugin",
    "pip install snakemake-executor": "the plugin",
    "python3.11 -m pip wheel": "390 MB from the network",
    "tar": "packs these 390 MB",
    "python3.11 -m venv": "installs what was downloaded",
    "~/sandmould-env/": "the environment that was installed",
    "scp": "needs another machine",
}
"""How commands begin that are left out, and why."""

SMALLER = {
    "my_study.yaml": {
        "size_scale: 8": "size_scale: 24",
        "duration_s: 1": "duration_s: 0.05",
        "[25, 50, 85, 140]": "[50, 140]",
        "replicates: 4": "replicates: 1",
    },
    "my_first.yaml": {
        "size_scale: 8": "size_scale: 24",
        "duration_s: 1": "duration_s: 0.05",
        "[1.5, 3, 6]": "[1.5, 6]",
        "replicates: 4": "replicates: 1",
    },
    "my_cavity.yaml": {
        "size_scale: 16, size_classes: 3": "size_scale: 24, size_classes: 1",
        "repeat: 3": "repeat: 2",
        "duration_s: 0.5": "duration_s: 0.02",
        "[1.5, 4]": "[4]",
        "replicates: 3": "replicates: 1",
    },
    "chute.in.j2": {"run 100000": "run 2000", "thermo 5000": "thermo 500"},
    "my_chute.yaml": {
        "steps: 100000": "steps: 2000",
        "[8, 16, 24]": "[8, 24]",
        "replicates: 3": "replicates: 1",
    },
}
"""What is written in the place of what stands on the page, so that a study takes seconds."""

ONE_STUDY = (
    "README.md", "docs/how-to/write_a_study.md", "docs/running.md", "docs/how-to/packs.md",
    "docs/cluster.md", "docs/tutorials/cluster.md",
)  # fmt: skip
"""They speak of the study of the README: one person reads them in one folder."""

FOLLOWED = [
    page for page in PAGES if page == "README.md" or page.count("/") > 1 or page in ONE_STUDY
] + ["docs/install.md"]
TYPED = [page for page in FOLLOWED if any(b.language == "sh" for b in blocks(page))]
READERS = [ONE_STUDY, *((page,) for page in TYPED if page not in ONE_STUDY)]

A_RUN = re.compile(r"\bRUN\b|\b\w+_r\d+_[0-9a-f]{6}\b")
"""A page names some run; a reader names one of their own."""


def commands(script: str) -> Iterator[str]:
    """Whole commands of a script, such as a line or a loop, as bash reads them."""
    lines: list[str] = []
    for line in script.splitlines():
        lines.append(line)
        whole = "\n".join(lines)
        if not subprocess.run(["bash", "-n", "-c", whole], capture_output=True).returncode:
            yield whole
            lines = []
    assert not lines, f"bash cannot read this: {lines}"


def is_typed(command: str) -> bool:
    return not command.startswith(tuple(NOT_TYPED))


def smaller(text: str, name: str) -> str:
    """Text of a page with what ``SMALLER`` has for it."""
    for there, here in SMALLER.get(name, {}).items():
        assert text.count(there) == 1, f"{name} has not one {there!r}"
        text = text.replace(there, here)
    return text


class Reader:
    """Someone who does what pages say, in one folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._typed: set[str] = set()

    def follow(self, page: str) -> None:
        for block in blocks(page):
            if block.title:
                file = self.folder / block.title
                file.write_text(smaller(block.text, block.title), encoding="utf-8")
            elif block.language == "sh":
                self.type(page, "\n".join(filter(self._is_new, commands(block.text))))

    def type(self, page: str, script: str) -> None:
        """Give lines to bash, which ends at the first that fails."""
        ran = subprocess.run(
            ["bash", "-euo", "pipefail", "-c", A_RUN.sub(self._a_run, script)],
            cwd=self.folder, stdin=subprocess.DEVNULL, capture_output=True, text=True,
            env=os.environ | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"},
        )  # fmt: skip
        assert not ran.returncode, f"{page}\n{script}\n{ran.stdout[-3000:]}\n{ran.stderr[-3000:]}"

    def _is_new(self, command: str) -> bool:
        """Whether a command is to be typed: each is by the first page that has it."""
        command = command.partition(" #")[0].strip()
        seen = command in self._typed
        self._typed.add(command)
        return is_typed(command) and not seen

    def _a_run(self, _: re.Match[str]) -> str:
        return min((self.folder / "results/my_study/runs").iterdir()).name


@pytest.fixture
def reader(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Reader:
    """A reader whose plans know how fast the machine is: measuring it takes 10 s each."""
    monkeypatch.setattr(SandSpeed, "trial", lambda *_: 2e7)
    for study in ("tube_quick", "tube_3d_small"):
        SandSpeed().measured(open_plan(study_file(study)).runs[0].scenario, tmp_path / "results")
    return Reader(tmp_path)


@pytest.mark.parametrize("pages", READERS, ids=lambda pages: pages[0])
def test_what_pages_say_works_as_written(pages: tuple[str, ...], reader: Reader) -> None:
    for page in pages:
        reader.follow(page)


def test_both_tables_are_of_today() -> None:
    found = [block for page in FOLLOWED for block in blocks(page)]
    told = [c for block in found if block.language == "sh" for c in commands(block.text)]
    assert [begin for begin in NOT_TYPED if not any(c.startswith(begin) for c in told)] == []
    assert SMALLER.keys() <= {block.title for block in found}


def test_every_block_of_these_pages_says_its_language() -> None:
    silent = [(page, b.text) for page in FOLLOWED for b in blocks(page) if not b.language]
    assert silent == []
