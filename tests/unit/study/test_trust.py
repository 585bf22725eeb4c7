"""Decks that are not shipped: where their files may lie, when they may run, what the plan shows."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml
from typer.testing import CliRunner

from sandmould import ROOT
from sandmould.bad_input import BadInputError
from sandmould.cli.commands import app
from sandmould.execution import run_study
from sandmould.kinds.deck.own.scan import findings, to_read
from sandmould.study.plan.build_plan import Plan
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from sandmould.study.plan.trust import check_trust, reading_help

CHUTE = ROOT / "config" / "decks" / "chute.in.j2"


def study_file(folder: Path, text: str = "run {{ number }}\n", /, **sections: Any) -> Path:
    """Write a template and a study of it; sections of the scenario stand below ``scenario``."""
    folder.mkdir(exist_ok=True)
    (folder / "probe.in.j2").write_text(text)
    scenario = {"template": "probe.in.j2", "values": {"number": 10}, "measures": {"x_m": "v_x"}}
    study = {"kind": "deck", "objective": {"measure": "x_m"}, **sections}
    study["scenario"] = scenario | sections.get("scenario", {})
    path = folder / "trial.yaml"
    path.write_text(yaml.safe_dump(study))
    return path


def refused(path: Path) -> str:
    """What is said of a study that may not run."""
    study = open_study(path)
    with pytest.raises(BadInputError) as fault:
        check_trust(study, expand(study))
    return str(fault.value)


def test_plan_runs_no_code_of_a_template(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    proof = tmp_path / "proof"
    reach = f"{{{{ cycler.__init__.__globals__.os.popen('touch {proof}; id').read() }}}}\n"
    path = study_file(tmp_path, "units si\n" + reach, scenario={"values": {}}, trust_deck=True)
    said = CliRunner().invoke(app, ["plan", str(path)])
    assert said.exit_code == 1
    assert "line 2: access to attribute '__init__' of 'type' object is unsafe" in said.output
    assert said.output.count("\n") == 1
    assert not proof.exists()


@pytest.mark.parametrize(
    "text", ["{% for i in range(10 ** 9) %}{% endfor %}", "{{ 'x' * 10**10 }}"]
)
def test_plan_does_not_hang_over_a_template(tmp_path: Path, text: str) -> None:
    path = study_file(tmp_path, text, scenario={"values": {}})
    with pytest.raises(BadInputError, match=r"Range too big|more memory than it may"):
        expand(open_study(path))


OUTSIDE: dict[str, dict[str, Any]] = {
    "template": {"scenario": {"template": "../elsewhere/secret.txt"}},
    "absolute": {"scenario": {"template": "/etc/passwd"}},
    "template that is a link": {"scenario": {"template": "link.txt"}},
    "file in a folder that is a link": {"scenario": {"files": ["folder/secret.txt"]}},
    "file": {"scenario": {"files": ["probe.in.j2", "../elsewhere/secret.txt"]}},
    "swept template": {"sweep": {"keys": {"template": ["probe.in.j2", "../elsewhere/secret.txt"]}}},
    "swept file": {
        "scenario": {"files": ["trial.yaml"]},
        "sweep": {"design": "list", "points": [{"files.0": "../../../../../../etc/passwd"}]},
    },
    "swept files": {"sweep": {"keys": {"files": [["trial.yaml"], ["/etc/passwd"]]}}},
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A study's folder beside another, with links that lead there."""
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "secret.txt").write_text("run {{ number }}\n")
    here = tmp_path / "here"
    here.mkdir()
    (here / "link.txt").symlink_to(tmp_path / "elsewhere" / "secret.txt")
    (here / "folder").symlink_to(tmp_path / "elsewhere")
    return here


@pytest.mark.parametrize("sections", OUTSIDE.values(), ids=OUTSIDE)
def test_files_lie_below_the_study_s_folder(folder: Path, sections: dict[str, Any]) -> None:
    with pytest.raises(BadInputError) as fault:
        expand(open_study(study_file(folder, **sections)))
    assert "valid is a file below the study's folder" in str(fault.value)
    assert f"({folder})" in str(fault.value)
    assert "run " not in str(fault.value)  # nothing of the file is told


@pytest.mark.parametrize("sections", [OUTSIDE["template"], OUTSIDE["template that is a link"]])
def test_a_key_allows_more_folders(folder: Path, sections: dict[str, Any]) -> None:
    path = study_file(folder, **sections, allowed_folders=["../elsewhere"])
    assert len(expand(open_study(path))) == 1


def test_a_deck_below_the_study_s_folder_needs_no_key(folder: Path) -> None:
    (folder / "decks").mkdir()
    (folder / "decks" / "inner.in.j2").write_text("run {{ number }}\n")
    path = study_file(folder, scenario={"template": "decks/../decks/inner.in.j2"})
    assert len(expand(open_study(path))) == 1


def test_a_foreign_deck_does_not_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    started: list[Path] = []

    def snakemake(plan: Plan, *_: object) -> int:
        started.append(plan.study.path)
        return 0

    monkeypatch.setattr(run_study, "_snakemake", snakemake)
    path = study_file(tmp_path)
    said = CliRunner().invoke(app, ["run", str(path)])
    assert said.exit_code == 1
    assert said.output.count("\n") == 1
    assert "write trust_deck: true in trial.yaml" in said.output
    assert "probe.in.j2 is not shipped" in said.output
    assert started == []
    study_file(tmp_path, trust_deck=True)
    assert CliRunner().invoke(app, ["run", str(path)]).exit_code == 0
    assert len(started) == 1


def test_shipped_decks_run_with_numbers_alone(tmp_path: Path) -> None:
    shipped = open_study(ROOT / "config" / "studies" / "own_deck.yaml")
    check_trust(shipped, expand(shipped))
    assert reading_help(shipped, expand(shipped)) == ""
    (tmp_path / "trial.yaml").write_text("based_on: own_deck\nreplicates: 1\n")
    mine = open_study(tmp_path / "trial.yaml")
    check_trust(mine, expand(mine))
    (tmp_path / "trial.yaml").write_text(
        'based_on: own_deck\nscenario: {values: {friction: "0.5\\nshell touch hit\\n#"}}\n'
    )
    assert "values.friction gives chute.in.j2 text, not numbers" in refused(tmp_path / "trial.yaml")
    (tmp_path / "extra.in").write_text("shell touch hit\n")
    (tmp_path / "trial.yaml").write_text("based_on: own_deck\nscenario: {files: [extra.in]}\n")
    assert "extra.in is not shipped" in refused(tmp_path / "trial.yaml")


def test_a_copy_of_a_shipped_deck_is_foreign(tmp_path: Path) -> None:
    text = CHUTE.read_text(encoding="utf-8")
    values = {"angle_deg": 16, "friction": 0.5, "rolling": 0.1, "number_of_steps": 10}
    scenario = {"values": values, "measures": {"x_m": "v_height"}}
    told = refused(study_file(tmp_path, text, scenario=scenario))
    assert "probe.in.j2 is not shipped" in told


DECK = """\
units si
shell touch x   # a comment
{% if restart %}read_restart {{ restart }}{% endif %}
{{ command }} x
${command} y
if "${a} > 1" then "shell rm x" else "jump SELF a"
dump 1 all custom 10 ../x.dump id
dump 2 all custom 10 x.dump.gz id
dump 3 all movie 10 x.mp4 type type
variable p python foo
python foo source \"\"\"
import os
\"\"\"
include &
  /etc/x
plugin load x.so
variable h getenv HOME
geturl https://x.org/y
run 100 every 10 "shell ls"
partition yes 1 shell ls
log ~/.bashrc
"""
HARMLESS = """\
print "hello # shell" file out.txt # python ../x
restart 20000 {{ restart_files }}
restart 20000 ../restart.a ../restart.b
set type 1 density/disc 2.4
fix gravity all gravity 9.81 vector $(sin({{ angle_deg }}*PI/180)) 0.0 0.0
variable a equal v_b/v_c
if "${a} > 1" then "print 'hello'"
"""


def test_lines_to_look_at_have_their_numbers() -> None:
    found = list(findings("probe.in.j2", DECK, is_template=True))
    lines = [2, 4, 5, 6, 7, 8, 9, 10, 11, 14, 16, 17, 18, 19, 20, 21]
    assert [f.line for f in found] == lines
    told = {f.line: f.why for f in found}
    assert told[2] == told[19] == told[20] == "runs a command of the system"
    assert told[4] == told[5] == "its first word is a value"
    assert told[6] == "runs a command of the system; goes on reading in a file"
    assert told[7] == told[21] == "names a file outside of the run's folder"
    assert told[8] == "starts a program that packs or unpacks a file"
    assert told[10] == told[11] == "runs Python"
    assert told[14].startswith("reads further commands from a file; names a file outside")
    assert told[16] == "loads a compiled library"


@pytest.mark.parametrize("text", [HARMLESS, CHUTE.read_text(encoding="utf-8")])
def test_other_lines_are_not_listed(text: str) -> None:
    assert list(findings("probe.in.j2", text, is_template=True)) == []


def test_what_jinja_puts_together_is_found_too(tmp_path: Path) -> None:
    text = "units si\n{{ 'sh' ~ 'ell' }} ls\n{% if restart %}{{ 'plug' ~ 'in' }} x{% endif %}\n"
    (tmp_path / "more.in").write_text("units si\nshell ls\n")
    path = study_file(tmp_path, text, scenario={"values": {}, "files": ["more.in"]})
    lines = to_read([run.scenario for run in expand(open_study(path))])
    assert lines == [
        "probe.in.j2, line 2: {{...}} ls (its first word is a value)",
        "probe.in.j2, line 3: {{...}} x (its first word is a value)",
        "more.in, line 2: shell ls (runs a command of the system)",
        "the rendered deck, line 2: shell ls (runs a command of the system)",
        "the rendered deck, line 3: plugin x (loads a compiled library)",
    ]


def test_plan_shows_the_lines(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = study_file(tmp_path, "units si\nshell ls {{ number }}\n")
    said = CliRunner().invoke(app, ["plan", str(path)]).output
    assert "probe.in.j2, line 2: shell ls {{...}} (runs a command of the system)" in said
    assert "protects from nothing" in said
    assert "write trust_deck: true in trial.yaml" in said
    study_file(tmp_path, "units si\nshell ls {{ number }}\n", trust_deck=True)
    said = CliRunner().invoke(app, ["plan", str(path)]).output
    assert "trial.yaml allows it to run (trust_deck: true)." in said
    assert "line 2: shell ls" in said


def test_a_long_list_is_cut(tmp_path: Path) -> None:
    path = study_file(tmp_path, "".join(f"shell ls {n}\n" for n in range(50)) + "run {{ number }}")
    study = open_study(path)
    said = reading_help(study, expand(study))
    assert "line 30: shell ls 29" in said
    assert "line 31: " not in said
    assert "... and 20 more lines" in said


@pytest.mark.parametrize("key", ["trust_deck", "allowed_folders"])
def test_other_studies_have_no_such_keys(tmp_path: Path, key: str) -> None:
    (tmp_path / "trial.yaml").write_text(f"based_on: tube_demo\n{key}: true\n")
    with pytest.raises(BadInputError, match=f"{key} = True cannot be used"):
        open_study(tmp_path / "trial.yaml")
