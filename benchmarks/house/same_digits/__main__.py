"""Whether today's code computes the digits of a commit; where it does, results keep their identity.

``python -m benchmarks.house.same_digits COMMIT`` computes the studies in this folder with both and
compares all that their runs leave: snapshots, loads, series, tables, fields, measures. Without a
difference it writes ``sandmould/equal_code.toml``: the hash of each part's code, and the hash of
the code whose identity it has. ``... identities`` prints the identity of each part and the hash of
each scenario.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.frame.source_tree import unpack
from sandmould import ROOT, geometry, pattern_fe
from sandmould.casting import arpm, mps
from sandmould.definition.run import EXPORTED, Run
from sandmould.digest import EQUAL_CODE, SHORT, code_digest, equal_code
from sandmould.engines.registry import code_groups
from sandmould.kinds.registry import KINDS
from sandmould.module_main import run_main
from sandmould.runs.hashing import scenario_hash
from sandmould.scenario.scenario import Scenario
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study

STUDIES = Path(__file__).parent
APART = {"deck.in", "engine.log", "products.json", "scenario.yaml", *EXPORTED}
"""Files of a run that hold times, versions and names, or are made when asked for."""
TIMED = ["solve_s", "pattern_outside_fraction"]
"""Columns that hold times of the machine."""
HEAD = """\
# Code that was rewritten without a change of digits keeps the identity of the code it replaced:
# its hash now = the hash before. `python -m benchmarks.house.same_digits COMMIT` compares the
# digits and writes this file; docs/developers/identity.md.
"""


def parts() -> dict[str, list[Path]]:
    """Files of each part of the house that results depend on, by a name for people."""
    found = {
        "pattern": pattern_fe.source_files(),
        "geometry": geometry.source_files(),
        "casting": arpm.source_files(),
        "flow": mps.source_files(),
    }
    for run in runs():
        if isinstance(run.scenario, Scenario):
            for number, group in enumerate(code_groups(run.scenario)):
                if group not in found.values():
                    found[f"{run.study}_{run.scenario.engine.name}_{number}"] = group
    for kind in KINDS.values():
        found[f"measures_{kind.name}"] = [ROOT / file for file in kind.planning.measuring]
    return found


def runs() -> list[Run]:
    """All runs of the studies in this folder."""
    return [run for study in sorted(STUDIES.glob("*.yaml")) for run in expand(open_study(study))]


def states() -> dict[str, str]:
    """Hash of each part's code as it is now."""
    return {name: code_digest(files) for name, files in parts().items()}


def identities() -> dict[str, str]:
    """Identity of each part's code, and hash of each scenario."""
    equal = equal_code()
    code = {name: equal.get(state, state) for name, state in states().items()}
    return code | {f"{run.study}/{run.run}": scenario_hash(run.scenario)[:SHORT] for run in runs()}


def compute(tree: Path, folder: Path) -> None:
    """Run the studies with the code of a source tree."""
    folder.mkdir(parents=True)
    environment = os.environ | {"PYTHONPATH": str(tree)}
    for study in sorted(STUDIES.glob("*.yaml")):
        print(f"{study.stem} at {tree.name}", flush=True)
        command = [str(Path(sys.executable).parent / "sandmould"), "run", str(study)]
        with open(folder / f"{study.stem}.log", "wb") as log:
            subprocess.run(command, cwd=folder, env=environment, stdout=log, stderr=log, check=True)


def differences(before: Path, now: Path) -> Iterator[str]:
    """Each file of a run that is not the same, by its place."""
    for study in sorted((before / "results").glob("*/runs.tsv")):
        name = study.parent.name
        folders = [place / "results" / name for place in (before, now)]
        runs = [pd.read_csv(folder / "runs.tsv", sep="\t", dtype=str).run for folder in folders]
        for pair in zip(*runs, strict=True):
            one, other = (folder / "runs" / run for folder, run in zip(folders, pair, strict=True))
            for path in sorted(one.rglob("*")):
                part = path.relative_to(one)
                wanted = path.is_file() and path.name not in APART and "work" not in part.parts
                if wanted and _content(path) != _content(other / part):
                    yield f"{name}: {other.name}/{part}"


def _content(path: Path) -> object:
    """What a file holds, without the times that archives keep; nothing where it is missing."""
    if not path.exists():
        return None
    if path.suffix == ".zip":
        with zipfile.ZipFile(path) as archive:
            return {name: archive.read(name) for name in archive.namelist()}
    if path.suffix == ".npz":
        with np.load(path, allow_pickle=False) as arrays:
            return {name: (arrays[name].dtype.str, arrays[name].tobytes()) for name in arrays}
    if path.suffix == ".tsv":
        table = pd.read_csv(path, sep="\t", dtype=str)
        return table.drop(columns=TIMED, errors="ignore").to_csv()
    return path.read_bytes()


def write_equal(before: dict[str, str], now: dict[str, str]) -> None:
    """List each part whose code has another hash than its identity."""
    pairs: dict[str, dict[str, str]] = {}
    for name, state in now.items():
        if before.get(name, state) != state and not any(state in pair for pair in pairs.values()):
            pairs[name] = {state: before[name]}
    lines = [f'[{name}]\n{now} = "{before}"\n' for name, pair in pairs.items()
             for now, before in pair.items()]  # fmt: skip
    EQUAL_CODE.write_text("\n".join([HEAD, *lines]), encoding="utf-8")


def main(commit: str) -> int:
    """Compare with a commit, or print the identities."""
    if commit == "identities":
        print(json.dumps(identities(), indent=1))
        return 0
    with tempfile.TemporaryDirectory() as name:
        tree = unpack(commit, Path(name))
        compute(tree, Path(name, "before"))
        compute(ROOT, Path(name, "now"))
        found = list(differences(Path(name, "before"), Path(name, "now")))
        print("\n".join(found) or "The digits are the same.")
        if not found:
            command = [sys.executable, "-m", "benchmarks.house.same_digits", "identities"]
            environment = os.environ | {"PYTHONPATH": str(tree)}
            before = subprocess.run(
                command, cwd=tree, env=environment, check=True, capture_output=True
            ).stdout
            write_equal(json.loads(before), states())
    return bool(found)


if __name__ == "__main__":
    run_main(main, "python -m benchmarks.house.same_digits COMMIT | identities", (1,))
