"""The conda environment has what the project needs, in the versions of the lock."""

from __future__ import annotations

import re
import tomllib

import yaml

from sandmould import ROOT

_NAME = re.compile(r"([a-z0-9-]+)(\[[a-z,]+\])?", re.IGNORECASE)


def test_conda_environment_agrees_with_the_lock() -> None:
    told = yaml.safe_load((ROOT / "environment.yml").read_text(encoding="utf-8"))
    (python,) = (d for d in told["dependencies"] if str(d).startswith("python="))
    (of_pip,) = (d["pip"] for d in told["dependencies"] if isinstance(d, dict))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert python.removeprefix("python=") in project["requires-python"]
    needed = [_NAME.match(d) for d in project["dependencies"]]
    lock = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    locked = dict(re.findall(r"^([a-z0-9-]+)(?:\[[a-z,]+\])?==([^ \\]+)", lock, re.MULTILINE))
    expected = {f"{m[1]}{m[2] or ''}=={locked[m[1].lower()]}" for m in needed if m}
    assert set(of_pip) == expected
