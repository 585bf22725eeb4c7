"""Readers of foreign files: what each may say no with, and how it is called on one file.

A reader gives back a value or raises one of its refusals, which its callers turn into one sentence.
Anything else is a finding.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sandmould.bad_input import BadInputError

CORPUS = Path(__file__).with_name("corpus")


@dataclass(frozen=True)
class Reader:
    """One reader of the project; the folder of ``corpus`` with its name holds files for it."""

    read: Callable[[Path], object]
    refusals: tuple[type[Exception], ...] = ()

    def sound(self, name: str) -> list[Path]:
        """Files that the reader takes, in a fixed order."""
        return sorted(path for path in (CORPUS / name).iterdir() if path.is_file())

    def seeds(self, name: str) -> list[Path]:
        """Files that mutations begin from: sound ones, and ones that once were findings."""
        return [*self.sound(name), *sorted((CORPUS / name).glob("refused/*"))]


def _study(path: Path) -> object:
    from sandmould.study.plan.expand import expand
    from sandmould.study.plan.load_study import open_study

    return expand(open_study(path))


def _planned_run(path: Path) -> object:
    from sandmould.study.plan.plan_files import read_run

    return read_run(path)


def _surface(path: Path) -> object:
    from sandmould.geometry.mesh_file import read_surface

    return read_surface(path)


def _picture(path: Path) -> object:
    from sandmould.scenario.casting.shapes import CastPicture, solid_of

    shape = CastPicture.model_validate({"kind": "image", "file": str(path), "pixel_m": 1e-3})
    return solid_of(shape, "shapes.0")


def _pattern_mesh(path: Path) -> object:
    from sandmould.pattern_fe.mesh_file import read_mesh

    return read_mesh(path)


def _casting_checkpoint(path: Path) -> object:
    from sandmould.runs.checkpoint_file import CheckpointFile

    return CheckpointFile(path, "of this run").read()


def _checkpoint_mark(path: Path) -> object:
    from sandmould.runs.checkpoint_folders import newest_checkpoint

    folder = path.parent / "checkpoint_a"
    folder.mkdir(exist_ok=True)
    path.replace(folder / "mark.json")
    return newest_checkpoint(path.parent)


def _snapshot(path: Path) -> object:
    from sandmould.engines.snapshot import SNAPSHOTS, stored_snapshots

    path.replace(path.parent / SNAPSHOTS)
    return [stored.load() for stored in stored_snapshots(path.parent)]


def _grains(path: Path) -> object:
    from sandmould.engines.liggghts.process import read_grains

    return read_grains(path)


def _stress(path: Path) -> object:
    from sandmould.engines.liggghts.session import read_triangle_loads

    return read_triangle_loads(path)


def _log(path: Path) -> object:
    from sandmould.kinds.deck.own.thermo import read_thermo

    return read_thermo([path])


def _pack(path: Path) -> object:
    from sandmould.execution.packs.unpack import unpack

    said = unpack(path, path.parent / "results")
    return None if " 0 runs taken" in said else said


def _tables(path: Path) -> object:
    from sandmould.study.collect import gather

    run = path.parent / "runs" / "one"
    run.mkdir(parents=True, exist_ok=True)
    (path.parent / "runs.tsv").write_text("run\treplicate\tseed\none\t1\t7\n")
    path.replace(run / "measures.tsv")
    return gather(path.parent)


READERS: dict[str, Reader] = {
    "study": Reader(_study, (BadInputError,)),
    "planned_run": Reader(_planned_run, (BadInputError, OSError)),
    "surface": Reader(_surface, (ValueError,)),
    "picture": Reader(_picture, (BadInputError,)),
    "pattern_mesh": Reader(_pattern_mesh, (ValueError,)),
    "casting_checkpoint": Reader(_casting_checkpoint),
    "checkpoint_mark": Reader(_checkpoint_mark),
    "snapshot": Reader(_snapshot, (ValueError,)),
    "grains": Reader(_grains, (ValueError,)),
    "stress": Reader(_stress, (ValueError,)),
    "log": Reader(_log),
    "pack": Reader(_pack, (BadInputError,)),
    "tables": Reader(_tables, (OSError, ValueError)),
}


def _probe(path: Path) -> object:
    """Do what a file says: to see whether the watch sees it."""
    exec(path.read_text(encoding="utf-8"), {"path": path})
    return None


PROBE = Reader(_probe, (ValueError,))
