"""Files of results, checkpoints and caches load as data: nothing in them is executed."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import yaml

from sandmould import ROOT
from sandmould.bad_input import BadInputError
from sandmould.digest import digest
from sandmould.runs.checkpoint_file import CheckpointFile
from sandmould.scenario import reading, yaml_text

ROOMS = ("sandmould", "pattern_fe", "analysis", "workflow", "benchmarks")
EXECUTING = {"pickle", "cPickle", "_pickle", "dill", "cloudpickle", "joblib", "shelve", "marshal"}
CALLS = {
    "eval", "exec", "os.system", "os.popen", "yaml.unsafe_load", "yaml.full_load", "pd.read_pickle",
    "pandas.read_pickle", "torch.load",
}  # fmt: skip


def sources() -> Iterator[tuple[Path, ast.Module]]:
    """Every source of the house; drivers of other tools speak the other tools' ways."""
    for room in ROOMS:
        for path in sorted((ROOT / room).rglob("*.py")):
            if "peers" not in path.parts:
                yield path, ast.parse(path.read_text(encoding="utf-8"))


def calls(tree: ast.Module) -> Iterator[tuple[str, ast.Call]]:
    """All calls of a module by name."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            yield ast.unparse(node.func), node


def options(call: ast.Call) -> dict[str | None, str]:
    return {option.arg: ast.unparse(option.value) for option in call.keywords}


def test_nothing_is_loaded_that_executes() -> None:
    found = []
    for path, tree in sources():
        for node in ast.walk(tree):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [str(node.module)] if isinstance(node, ast.ImportFrom) else []
            found += [f"{path}: {n}" for n in names if n.split(".")[0] in EXECUTING]
        for name, call in calls(tree):
            if name in CALLS or options(call).get("shell", "False") != "False":
                found.append(f"{path}:{call.lineno} {name}")
            if name in ("np.load", "numpy.load") and options(call).get("allow_pickle") != "False":
                found.append(f"{path}:{call.lineno} {name} without allow_pickle=False")
            if name == "yaml.load" and path.name != "yaml_text.py":
                found.append(f"{path}:{call.lineno} {name}")
    assert found == []


@pytest.mark.parametrize("loader", ["_OF_USERS", "_OF_THE_PLAN"])
def test_loaders_of_yaml_know_plain_values_alone(loader: str) -> None:
    safe = (yaml.SafeLoader, getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    assert issubclass(getattr(yaml_text, loader), safe)


@pytest.mark.parametrize("read", [reading.read_yaml, reading.read_planned])
def test_yaml_makes_no_objects(read: Callable[[Path, str], object], tmp_path: Path) -> None:
    proof, path = tmp_path / "proof", tmp_path / "trial.yaml"
    path.write_text(f'title: !!python/object/apply:os.system ["touch {proof}"]\n')
    with pytest.raises(BadInputError, match="could not determine a constructor"):
        read(path, "trial.yaml")
    assert not proof.exists()


class _Touch:
    """What touches a file when it is unpickled."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return Path.touch, (self._path,)  # type: ignore[return-value]


def test_a_checkpoint_runs_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    proof, path = tmp_path / "proof", tmp_path / "checkpoint"
    arrays = tmp_path / "arrays.npz"
    np.savez(arrays, computed_hash="abc", state=np.array([_Touch(proof)], dtype=object))
    body = arrays.read_bytes()
    path.write_bytes(bytes.fromhex(digest(body)) + body)
    assert CheckpointFile(path, "abc").read() is None
    assert "cannot be used" in capsys.readouterr().err
    assert not proof.exists()
