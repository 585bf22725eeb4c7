"""Studies from Python: one is computed, and its tables, grains and pictures are read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sandmould
from sandmould.scenario.bad_input import BadInputError

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


@pytest.mark.slow
def test_a_study_is_computed_and_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    result = sandmould.run(STUDY, name="little", cores=2)
    assert "little: 2 of 2 runs done" in capsys.readouterr().out
    assert result.verdict.startswith("Not resolved")
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
    # The same study again computes nothing; another one of its name is refused.
    assert sandmould.run(STUDY, name="little").runs == result.runs
    with pytest.raises(BadInputError, match=r"little.yaml holds another study"):
        sandmould.run(STUDY | {"replicates": 2}, name="little")


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
    assert not Path("results").exists()


def test_the_package_says_what_it_has_not() -> None:
    with pytest.raises(AttributeError, match="'sandmould' has no attribute 'rum'"):
        _ = sandmould.rum
