"""The conda environment and the container have what is needed, in the versions of the lock."""

from __future__ import annotations

import re
import tomllib

import yaml

from sandmould import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
_NAME = re.compile(r"([a-z0-9-]+)(\[[a-z,]+\])?", re.IGNORECASE)


def test_conda_environment_agrees_with_the_lock() -> None:
    told = yaml.safe_load((ROOT / "environment.yml").read_text(encoding="utf-8"))
    (python,) = (d for d in told["dependencies"] if str(d).startswith("python="))
    (of_pip,) = (d["pip"] for d in told["dependencies"] if isinstance(d, dict))
    assert python.removeprefix("python=") in PROJECT["requires-python"]
    needed = [_NAME.match(d) for d in PROJECT["dependencies"]]
    lock = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    locked = dict(re.findall(r"^([a-z0-9-]+)(?:\[[a-z,]+\])?==([^ \\]+)", lock, re.MULTILINE))
    expected = {f"{m[1]}{m[2] or ''}=={locked[m[1].lower()]}" for m in needed if m}
    assert set(of_pip) == expected


def test_the_container_installs_the_lock_and_nothing_else() -> None:
    steps = (ROOT / "Dockerfile").read_text(encoding="utf-8").replace("\\\n", " ").splitlines()
    (image,) = (step for step in steps if step.startswith("FROM "))
    (python,) = re.findall(r"python:(3\.\d+)-", image)
    assert python in PROJECT["requires-python"]
    installed = [step.split("pip install", 1)[1].split() for step in steps if "pip" in step]
    of_lock, of_house = installed
    assert {"--require-hashes", "requirements.lock"} <= set(of_lock)
    assert {"--no-deps", "--no-build-isolation", "."} <= set(of_house)
    # Without isolation the house is built by what is installed already.
    assert re.search(r"^hatchling==", (ROOT / "requirements.lock").read_text("utf-8"), re.MULTILINE)
    ignored = (ROOT / ".dockerignore").read_text(encoding="utf-8").split()
    assert not set(ignored) & {"sandmould", "config", "profiles", "templates", "workflow"}
