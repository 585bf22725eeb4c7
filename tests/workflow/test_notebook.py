"""Studies from Python: one is computed, and its tables, grains and pictures are read."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import sandmould
from sandmould import ROOT
from sandmould.bad_input import BadInputError
from sandmould.study.plan.build_plan import open_plan
from tests.undescribed import undescribed
from tests.workflow.pages import PAGES, blocks

FREQUENCY = "vibration.0.frequency_hz"
STUDY: dict[str, Any] = {
    "based_on": "tube_quick",
    "scenario": {
        "sand": {"size_classes": 3},
        "fill": {"layers": [{"count": 20}]},
        "vibration": [{"frequency_hz": 50, "acceleration_g": 1.5, "duration_s": 0.04}],
    },
    "sweep": {"keys": {FREQUENCY: [50, 75]}},
    "replicates": 1,
}


NOTEBOOK = ROOT / "docs" / "first_study.ipynb"


def _cells_of_the_notebook() -> list[str]:
    cells = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    return ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]


def _blocks_of_pages() -> list[str]:
    """Python that pages have a person type; a file that a page has saved is run elsewhere."""
    found = [b for page in PAGES for b in blocks(page) if b.language == "python" and not b.title]
    return [block.text for block in found]


def _follow(
    cells: list[str], result: Any, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> tuple[dict[str, Any], int]:
    """Execute code on a study that is computed already: its own takes a minute.

    Returns
    -------
    dict
        Its names.
    int
        How many runs its own study has.
    """
    told: list[Path] = []

    def run(study: dict[str, Any], name: str) -> Any:
        told.append(folder / f"{name}.yaml")
        told[0].write_text(yaml.safe_dump(study))
        return result

    names: dict[str, Any] = {}
    with monkeypatch.context() as patched:
        patched.setattr("sandmould.notebook.run", run)
        for cell in cells:
            exec(compile(cell, "cell", "exec"), names)
    return names, len(open_plan(*told).runs)


def test_the_notebook_is_executed_and_small() -> None:
    text = NOTEBOOK.read_text(encoding="utf-8")
    assert len(text.encode()) < 500_000
    cells = [cell for cell in json.loads(text)["cells"] if cell["cell_type"] == "code"]
    assert [cell["execution_count"] for cell in cells] == list(range(1, len(cells) + 1))
    outputs = [output for cell in cells for output in cell["outputs"]]
    assert all(output["output_type"] != "error" for output in outputs)
    assert sum("image/png" in output.get("data", {}) for output in outputs) == 2


@pytest.mark.slow
@pytest.mark.usefixtures("unmeasured")
def test_a_study_is_computed_and_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    told: list[tuple[int, int]] = []
    result = sandmould.run(
        STUDY, name="little", cores=2, progress=lambda done, of, _: told.append((done, of))
    )
    assert told == [(1, 2), (2, 2)]
    # a study without a title does not ask what the one that it rests on asks
    assert yaml.safe_load(Path("little.yaml").read_text(encoding="utf-8"))["title"] == "little"
    said = capsys.readouterr().out
    assert "little: 2 of 2 runs done" in said
    # The machine's speed is measured; the plan is told once all the same.
    assert said.count("Measuring the speed of this machine") == 1
    assert said.count("Wall time on 2 cores with report") == 1
    # Nothing is in the tube after so short a time, at either frequency.
    assert "50 Hz to 75 Hz" in result.verdict
    assert undescribed(result.folder) == []
    assert sorted(result.summary[FREQUENCY]) == [50, 75]
    assert set(result.curves["run"]) == set(result.runs)
    run = result.runs[0]
    grains = result.grains(run)
    assert len(grains) == 20
    assert list(grains)[:5] == ["id", "layer", "radius_m", "x_m", "z_m"]
    assert grains["z_m"].min() > 0.0
    first = result.grains(run, time_s=grains.attrs["time_s"] - 0.01)
    assert first.attrs["time_s"] < grains.attrs["time_s"]
    assert not np.array_equal(first["z_m"], grains["z_m"])
    png = result.show(run).save("grains.png")
    assert png.read_bytes().startswith(b"\x89PNG")
    assert 'src="results/little/report.html#film"' in result.film()._repr_html_()
    with pytest.raises(BadInputError, match=r"run = 'other' .* one of result.runs, such as freq"):
        result.grains("other")
    with pytest.raises(BadInputError, match=r"time_s = -1.0 .* at least"):
        result.grains(run, time_s=-1.0)
    names, runs = _follow(_cells_of_the_notebook(), result, tmp_path, monkeypatch)
    assert (len(names["grains"]), runs) == (20, 4)
    names, runs = _follow(_blocks_of_pages(), result, tmp_path, monkeypatch)
    assert (names["result"], runs) == (result, 12)
    there = sandmould.Result("results/little")
    assert there.verdict == result.verdict
    assert {"time_s", "kinetic_energy_j"} <= set(there.series(run))
    with pytest.raises(BadInputError, match=r"run = 'other' .* one of result.runs"):
        there.series("other")
    there.report.path.unlink()
    assert there.write_report().path.is_file()
    assert list(sandmould.status(STUDY, name="little")["state"]) == 3 * ["done"]  # and a fill
    (again,) = sandmould.again(f"little/{run}", quiet=True)
    assert again.summary[FREQUENCY].equals(result.summary[FREQUENCY])
    # The same study again computes nothing, and says nothing where that is asked for.
    capsys.readouterr()
    assert sandmould.run(STUDY, name="little", quiet=True).runs == result.runs
    assert capsys.readouterr().out == ""


def test_what_is_no_study_is_told_before_anything_starts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(BadInputError, match=r"name = 'My study' .* small letters"):
        sandmould.run(STUDY, name="My study")
    with pytest.raises(BadInputError, match=r"STUDY = 'tube_dem' .* such as tube_demo"):
        sandmould.run("tube_dem")
    with pytest.raises(BadInputError, match=r"replicates = 0"):
        sandmould.run(STUDY | {"replicates": 0}, name="wrong")
    assert not Path("wrong.yaml").exists()
    assert not Path("results").exists()
    with pytest.raises(BadInputError, match=r"folder = 'results' .* has its verdict.txt"):
        sandmould.Result("results")


def test_the_package_says_what_it_has_not() -> None:
    with pytest.raises(AttributeError, match="'sandmould' has no attribute 'rum'"):
        _ = sandmould.rum
