"""Names of folders are no commands: to the shell, to Slurm and to engines."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from sandmould import ROOT
from sandmould.bad_input import BAD_INPUT_EXIT, BadInputError
from sandmould.execution import run_study
from sandmould.study.plan import trust
from sandmould.study.plan.load_study import open_study
from tests.scenes import open_lammps, tube_scene

TINY = """\
based_on: plates
scenario: {heat_transfer_w_m2_k: null}
sweep: {design: list, points: [{exchange: corrected, element_m: 0.01, layers: []}]}
reference: {exchange: corrected, element_m: 0.01}
"""
REFUSED = (
    "x$(touch HIT)",
    "x`touch HIT`",
    "it's",
    "'$(touch HIT)'",
    'say "touch HIT"',
    "back\\slash",
    "line\nbreak",
    "${HOME}",
    "step_*",
    "rank_%",
)
TAKEN = "a b&c;d|e(f)<g>{h}[i]#j!k~l=m,n?^@:"


@pytest.mark.parametrize("name", REFUSED)
def test_a_folder_that_a_shell_would_read_is_refused(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    started: list[object] = []
    monkeypatch.setattr(subprocess, "run", lambda *a, **_: started.append(a))
    folder = tmp_path / name
    folder.mkdir()
    path = folder / "tiny.yaml"
    path.write_text(TINY)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(BadInputError) as fault:
        run_study.run_study(path, [])
    assert "STUDY = " in str(fault.value)
    assert len(str(fault.value).splitlines()) == 1
    monkeypatch.chdir(folder)
    with pytest.raises(BadInputError, match="working folder = "):
        run_study.run_study(Path("tiny.yaml"), [])
    assert started == []


def test_the_installation_counts_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tiny.yaml").write_text(TINY)
    study = open_study(tmp_path / "tiny.yaml")
    trust.check_places(study)
    monkeypatch.setattr(trust, "ROOT", tmp_path / "$(touch HIT)")
    with pytest.raises(BadInputError, match="installation = "):
        trust.check_places(study)


def test_lammps_is_not_started_where_it_cannot_read_names(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    started: list[object] = []
    monkeypatch.setattr(run_study, "run_in_group", lambda work, *_: started.append(work))
    folder = tmp_path / "\u00fcbung"
    folder.mkdir()
    monkeypatch.chdir(folder)
    text = "based_on: tube\nscenario: {engine: {name: %s}}\nsweep: {}\n"
    Path("tiny.yaml").write_text(text % "lammps")
    with pytest.raises(BadInputError, match="valid is a folder of ASCII letters alone") as fault:
        run_study.run_study(Path("tiny.yaml"), [])
    assert len(str(fault.value).splitlines()) == 1
    assert started == []
    Path("tiny.yaml").write_text(text % "reference")
    run_study.run_study(Path("tiny.yaml"), [])
    assert len(started) == 1


def test_slurm_is_handed_no_command(tmp_path: Path) -> None:
    fakes = tmp_path / "fakes"
    fakes.mkdir()
    for name, says in {"sinfo": "main*|normal|1-00:00:00|1|1|500000", "sbatch": "77"}.items():
        (fakes / name).write_text(f"#!/bin/sh\necho '{says}'\n")
        (fakes / name).chmod(0o755)
    folder = tmp_path / "x$(touch HIT)"
    folder.mkdir()
    (folder / "tiny.yaml").write_text(TINY)
    command = [sys.executable, "-m", "snakemake", "--snakefile", str(ROOT / "Snakefile")]
    options = ["--workflow-profile", str(ROOT / "profiles" / "slurm"), "--retries", "0"]
    said = subprocess.run(
        [*command, "--configfile", str(folder / "tiny.yaml"), *options],
        cwd=tmp_path, env=os.environ | {"PATH": f"{fakes}:{os.environ['PATH']}"},
        capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert said.returncode == BAD_INPUT_EXIT
    assert "valid is a path without quotes, $ ` \\ * % and line breaks" in said.stderr
    assert not (tmp_path / "HIT").exists()


def test_names_of_files_and_swept_texts_are_no_wildcards(tmp_path: Path) -> None:
    name = "p{x}$(touch HIT);`touch HIT`'\"a.in.j2"
    (tmp_path / name).write_text("# {{ word }}\nunits si\n")
    study = {
        "kind": "deck", "trust_deck": True, "scenario": {"template": name, "values": {"word": "a"}},
        "sweep": {"keys": {"values.word": ["{wildcards.run} {x} $(touch HIT) %s {0}", "b"]}},
    }  # fmt: skip
    (tmp_path / "trial.yaml").write_text(yaml.safe_dump(study))
    command = [sys.executable, "-m", "snakemake", "--snakefile", str(ROOT / "Snakefile")]
    said = subprocess.run(
        [*command, "--configfile", "trial.yaml", "--cores", "1", "--dry-run"],
        cwd=tmp_path, capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert said.returncode == 0, said.stderr[-2000:]
    assert "render" in said.stdout + said.stderr
    assert not (tmp_path / "HIT").exists()


def test_engines_take_what_is_left(tmp_path: Path) -> None:
    folder = tmp_path / TAKEN
    folder.mkdir()
    scenario = tube_scene(fill={"layers": [{"count": 20}]})
    session = open_lammps(scenario, folder)
    stage = session._program.stages[0]
    session.insert_layer(stage.layer)
    session.start_stage(stage)
    session.advance()
    steps = session.steps
    (folder / "checkpoint").mkdir()
    session.write_checkpoint(folder / "checkpoint")
    session.close()
    again = open_lammps(scenario, folder, folder / "checkpoint")
    assert again.steps == steps > 0
    again.close()


def test_a_foreign_deck_is_refused_without_the_command_too(tmp_path: Path) -> None:
    (tmp_path / "probe.in.j2").write_text("shell touch HIT\n")
    (tmp_path / "probe.yaml").write_text("kind: deck\nscenario: {template: probe.in.j2}\n")
    command = [sys.executable, "-m", "snakemake", "--snakefile", str(ROOT / "Snakefile")]
    said = subprocess.run(
        [*command, "--configfile", "probe.yaml", "--cores", "1"],
        cwd=tmp_path, capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert said.returncode == BAD_INPUT_EXIT
    assert "write trust_deck: true in probe.yaml" in said.stderr
    assert not list(tmp_path.rglob("HIT"))
