"""What the page of files does not say of the files that a study left."""

from __future__ import annotations

import json
import re
import zipfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from sandmould.definition.study import Study
from sandmould.kinds.registry import kind_named
from sandmould.reference.contents import MEASURES, OF_RUN, OF_STUDY, SWEPT
from sandmould.runs.columns import PART, REPLICATE, RUN, SEED
from sandmould.study.collect import read_study


def undescribed(folder: Path) -> list[str]:
    """Files, columns and keys of a study's results that `contents` does not list.

    Parameters
    ----------
    folder : Path
        ``results/<study>``.
    """
    swept = [c for c in _head(folder / "runs.tsv") if c not in (RUN, REPLICATE, SEED, PART, "fill")]
    measures = _measures_of(read_study(folder))
    found = []
    for path in sorted(p for p in folder.rglob("*") if p.is_file()):
        parts = path.relative_to(folder).parts
        if parts[0] in ("runs", "fills"):
            name, files = "/".join(parts[2:]), OF_RUN
        else:
            name, files = "/".join(parts), OF_STUDY
        inner = [name, *(f"{name}/{m}" for m in _members(path))]
        for each in inner:
            file = next((f for f in files if _fits(f.name, each)), None)
            if file is None:
                found.append(each)
                continue
            if file.name.endswith("/<name>"):  # an engine's own
                continue
            for column in _columns(path, each.removeprefix(name).lstrip("/")):
                if not any(_is_column(c.name, column, swept, measures) for c in file.columns):
                    found.append(f"{each}: {column}")
    return list(dict.fromkeys(found))


def _head(path: Path) -> list[str]:
    return [str(column) for column in pd.read_csv(path, sep="\t", nrows=0).columns]


def _members(path: Path) -> list[str]:
    if path.suffix != ".zip":
        return []
    with zipfile.ZipFile(path) as archive:
        return archive.namelist()


def _columns(path: Path, member: str) -> Sequence[str]:
    """Columns, keys or fields of a file, or of one in an archive."""
    if member.endswith(".dump"):
        with zipfile.ZipFile(path) as archive:
            text = archive.read(member).decode()
        return re.findall("^ITEM: ATOMS (.*)$", text, re.MULTILINE)[0].split()
    if path.suffix == ".tsv":
        return _head(path)
    if path.suffix == ".npz":
        with np.load(path, allow_pickle=False) as arrays:
            return list(dict.fromkeys(name.rpartition("/")[2] for name in arrays))
    if path.name in ("outcome.json", "products.json"):
        return list(json.loads(path.read_text(encoding="utf-8")))
    return []


def _fits(pattern: str, name: str) -> bool:
    parts = re.split("(<[^>]*>)", pattern)
    return (
        re.fullmatch("".join(".+" if p[:1] == "<" else re.escape(p) for p in parts), name)
        is not None
    )


def _is_column(pattern: str, name: str, swept: Sequence[str], measures: Sequence[str]) -> bool:
    if pattern == SWEPT:
        return name in swept
    if pattern == MEASURES:
        return any(_fits(measure, name) for measure in measures)
    return _fits(pattern, name)


def _measures_of(study: Study) -> list[str]:
    groups = kind_named(study.kind).planning.measures
    return [*study.own_measures, *(m.name for group in groups for m in group.measures)]
