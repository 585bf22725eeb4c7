"""Names from files stay names: in the page, in its figures, in tables and in folders."""

from __future__ import annotations

import base64
import io
import re
import xml.etree.ElementTree as ET
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import yaml
from PIL import Image

from sandmould.bad_input import BadInputError
from sandmould.definition.run import RUN_NAME
from sandmould.drawing.figure_files import strip
from sandmould.report.page import write_report
from sandmould.runs.columns import RUN
from sandmould.runs.manifest import save_manifest
from sandmould.study.collect import collect
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from sandmould.study.plan.plan_files import read_run, write_study
from tests.planned import write_plan

HIT = "hit-by-a-name"
HOSTILE = (
    f"<script>/*{HIT}*/</script>",
    f"</title></style></text></svg><img src=x onerror={HIT}>",
    f'"\' onmouseover={HIT} x="',
    f"]]>--><b>{HIT}</b><!--&lt;&#60;",
    f"{{{{ 7*7 }}}}{{% raw %}}${{{HIT}}}$\\frac$",
    "../../../../etc/passwd",
    f"$({HIT});`{HIT}`|{HIT}&{HIT}\\",
    "a\tb\nc\u2028d",
)


class _Tags(HTMLParser):
    """Counts what a page is made of."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: dict[str, int] = {}
        self.attributes: set[str] = set()
        self.links: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags[tag] = self.tags.get(tag, 0) + 1
        self.attributes |= {name for name, _ in attrs}
        self.links += [value or "" for name, value in attrs if name in ("href", "src")]


def study_of(folder: Path, names: dict[str, str]) -> Path:
    """Plan, plant and collect a study whose file says such names; its results."""
    folder.mkdir(parents=True)
    template = folder / names["file"]
    template.write_text("run {{ word }} {{ other }} {{ seed }}\n")
    study: dict[str, Any] = {
        "kind": "deck",
        "title": names["title"],
        "scenario": {
            "template": names["file"],
            "values": {"word": "plain", "other": names["value"]},
            "measures": {"speed_m_s": names["column"], "height_m": "v_h"},
        },
        "sweep": {"keys": {"values.word": ["plain", names["swept"]]}},
        "replicates": 2,
        "objective": {
            "measure": "speed_m_s",
            "reported_best": [{"value": 1.0, "by": names["by"]}],
        },
    }
    path = folder / "trial.yaml"
    path.write_text(yaml.safe_dump(study))
    opened = open_study(path)
    runs = expand(opened)
    results = folder / "results"
    write_plan(runs, results)
    write_study(opened.study, results)
    for n, run in enumerate(runs):
        of_run = results / "runs" / run.run
        clock = {"time_s": [0.0, 1.0], "vibration_time_s": -1.0, "stage": "deck"}
        curve = {"speed_m_s": [0.0, 1.0 + 0.1 * n], "height_m": [0.0, 1.0]}
        pd.DataFrame(clock | curve).to_csv(of_run / "measures.tsv", sep="\t", index=False)
        outcome = {"code": 0, "detail": names["detail"], "simulated_s": 1.0, "planned_s": 0.0}
        (of_run / "outcome.json").write_text(yaml.safe_dump(outcome, default_flow_style=True))
        cost = {"engine": "lammps", "version": "1", "ranks": 1, "cpu_s": 9.0}
        save_manifest(of_run, {"cost": cost})
    collect(results)
    write_report(results, results / "report.html")
    return results


PLAIN = dict.fromkeys(("title", "value", "column", "swept", "by", "detail"), "name") | {
    "file": "chute.in.j2"
}


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return study_of(tmp_path_factory.mktemp("plain") / "study", PLAIN)


@pytest.mark.parametrize("name", HOSTILE, ids=range(len(HOSTILE)))
def test_a_name_stays_a_name(plain: Path, tmp_path: Path, name: str) -> None:
    file = re.sub(r"[/\0]", "_", name) + ".j2"
    results = study_of(tmp_path / "study", dict.fromkeys(PLAIN, name) | {"file": file})
    _check_page(results, plain, name)
    _check_figures(results, plain)
    runs = [p.name for p in (results / "runs").iterdir()]
    assert all(re.fullmatch(RUN_NAME, run) for run in runs)
    _check_tables(results, plain, runs)
    read_back = [read_run(results / "runs" / run / "scenario.yaml") for run in runs]
    assert {run.parameters["values.word"] for run in read_back} == {"plain", name}
    # nothing was written beside
    assert [p.name for p in tmp_path.iterdir()] == ["study"]
    assert {p.name for p in results.iterdir()} == {p.name for p in plain.iterdir()}


def _check_page(results: Path, plain: Path, name: str) -> None:
    page = (results / "report.html").read_text(encoding="utf-8")
    tags, before = _Tags(page), _Tags((plain / "report.html").read_text(encoding="utf-8"))
    assert (tags.tags, tags.attributes) == (before.tags, before.attributes)
    assert all(not link.lower().startswith(("javascript:", "http")) for link in tags.links)
    assert ("{{ 7*7 }}" in page) == ("7*7" in name)  # a name is no template


def _check_figures(results: Path, plain: Path) -> None:
    pictures = sorted(p.name for p in (results / "figures").glob("*.svg"))
    assert pictures == sorted(p.name for p in (plain / "figures").glob("*.svg"))
    for picture in pictures:
        drawn, before = (ET.parse(f / "figures" / picture) for f in (results, plain))
        assert [e.tag for e in drawn.iter()] == [e.tag for e in before.iter()]
        assert [set(e.attrib) for e in drawn.iter()] == [set(e.attrib) for e in before.iter()]


def _check_tables(results: Path, plain: Path, runs: list[str]) -> None:
    for table in ("runs.tsv", "summary.tsv"):
        read = pd.read_csv(results / table, sep="\t")
        assert sorted(read[RUN]) == sorted(runs)
        assert list(read) == list(pd.read_csv(plain / table, sep="\t"))
        assert read["values.word"].nunique() == 2


def test_a_heading_of_a_picture_is_no_formula() -> None:
    file = io.BytesIO()
    Image.new("RGB", (40, 20)).save(file, "png")
    address = "data:image/png;base64," + base64.b64encode(file.getvalue()).decode()
    assert strip([("mesh $\\frac$ 2", address)]).startswith(b"\x89PNG")


PATHS = ("../up", "/etc/up", "a/b", "up.yaml", "a b", "A", "", ".", "a\\n", "\u00e4", "$(up)")
NAMING = {
    "based_on": "based_on: NAME\n",
    "material": "based_on: tube_demo\nmaterial: NAME\n",
    "calibration.also.0": "based_on: calibrate_sand\ncalibration: {also: [NAME]}\n",
    "calibration.sands.0.name": "based_on: calibrate_sand\ncalibration: {sands: [{name: NAME}]}\n",
    "scenario.obstacles.0.name": "based_on: tube_demo\nscenario: {obstacles: [{kind: plate, "
    "name: NAME, centre_m: [0.1, 0.1], length_m: 0.01, thickness_m: 0.01}]}\n",
    "scenario.measures": "kind: deck\nscenario: {template: x.j2, measures: {NAME: v_x}}\n",
    "scenario.values": "kind: deck\nscenario: {template: x.j2, values: {NAME: 1}}\n",
}


@pytest.mark.parametrize("key", NAMING)
@pytest.mark.parametrize("name", PATHS)
def test_what_becomes_a_file_or_a_column_is_a_plain_name(
    tmp_path: Path, key: str, name: str
) -> None:
    path = tmp_path / "trial.yaml"
    path.write_text(NAMING[key].replace("NAME", f'"{name}"'), encoding="utf-8")
    with pytest.raises(BadInputError) as fault:
        open_study(path)
    assert any(p.key.startswith(key) for p in fault.value.problems), str(fault.value)
    assert len(str(fault.value).splitlines()) == len(fault.value.problems)
