"""The shipped sands are those of their sources."""

from __future__ import annotations

from pathlib import Path

import pytest

from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from sandmould.study.plan.stand_ins import stand_ins

MEDIANS_M = {"rojek_2004": 0.57e-3, "lbi_beach": 0.470e-3, "duck_beach": 0.341e-3}
"""As docs/explanation/sand.md and the sources state them."""


@pytest.mark.parametrize("name", MEDIANS_M)
def test_a_sand_has_the_median_of_its_source(name: str, tmp_path: Path) -> None:
    study = tmp_path / "trial.yaml"
    study.write_text(f"based_on: tube\nmaterial: {name}\n", encoding="utf-8")
    (run,) = expand(open_study(study))
    # half a unit in the last place of the page
    assert run.scenario.sand.real_median_m == pytest.approx(MEDIANS_M[name], abs=5e-6)
    assert bool(stand_ins(run)) == (name != "rojek_2004")
