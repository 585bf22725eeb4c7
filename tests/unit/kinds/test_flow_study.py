"""Studies of flow: what is refused, what a run leaves, how it is judged, what the report shows."""

from __future__ import annotations

import base64
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

from sandmould.bad_input import BadInputError
from sandmould.casting.mps import scene
from sandmould.casting.mps.scheme import Scheme
from sandmould.casting.mps.stability_measures import StabilityRating, by_window, measure_flow
from sandmould.drawing.animation import ABSENT
from sandmould.drawing.flow_film import make_flow_film
from sandmould.execution.simulate import export_run, measure_run, render_run, simulate
from sandmould.kinds.flow.planning import FlowPlanning
from sandmould.report.flow_charts import _parts, condition_text, said_of, stability_map
from sandmould.report.kinds.flow import _hopping
from sandmould.report.page import write_report
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.scenario.casting.flow import MetalFlow
from sandmould.study.collect import collect
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from sandmould.study.plan.plan_files import plan_table, read_run, write_study
from sandmould.study.plan.price import Prices
from tests.planned import write_plan
from tests.verification.castings.still_fluid import table_2

TANK = {"kind": "tank", "particle_m": 0.004, "width_m": 0.016, "depth_m": 0.032}
SHOULDER = {"kind": "shoulder", "particle_m": 0.00625}
SCHEME_OF = scene.scheme_of
SMALL: dict[str, Any] = {"case": TANK, "duration_s": 0.02, "record_s": 0.005, "dt_max_s": 0.002}


def opened(folder: Path, top: dict[str, Any] | None = None, /, **scenario: Any) -> Path:
    """Write a study of a small tank."""
    whole = SMALL | scenario
    probe = "h28" if whole["case"]["kind"] == "tank" else "bottom"
    objective = {"measure": f"{probe}_sd_pa", "better": "neither"}
    study = {"kind": "flow", "scenario": whole, "objective": objective}
    path = folder / "trial.yaml"
    path.write_text(yaml.safe_dump(study | (top or {})))
    return path


@pytest.mark.parametrize(
    ("scenario", "told"),
    [
        ({"case": TANK | {"width_m": 0.017}}, r"case.width_m = 0.017 .* a whole number"),
        ({"case": TANK | {"depth_m": 0.008}}, "case.depth_m = 0.008 .* at least 4 particles"),
        ({"case": TANK | {"particle_m": 0.0}}, "case.tank.particle_m = 0.0|particle_m = 0.0"),
        ({"case": SHOULDER | {"particle_m": 0.01}}, "particle_m = 0.01 .* at most 0.00625 m"),
        ({"case": SHOULDER | {"rate_kg_s": 3.0}}, "rate_kg_s = 3.0 .* stream is wider than the bo"),
        ({"measured_from_s": 0.02}, "measured_from_s = 0.02 .* below the duration, 0.02 s"),
        ({"record_s": 1.0}, "record_s = 1.0 .* at most the duration"),
        ({"metal": {"viscosity_m2_s": -1.0}}, "metal.viscosity_m2_s = -1.0"),
        ({"source_share": 1.5}, "source_share = 1.5"),
    ],
)
def test_what_cannot_flow_is_told_in_one_sentence(
    tmp_path: Path, scenario: dict[str, Any], told: str
) -> None:
    with pytest.raises(BadInputError, match=told) as refused:
        expand(open_study(opened(tmp_path, **scenario)))
    assert len(refused.value.problems) == 1


@pytest.mark.parametrize(
    ("top", "told"),
    [
        ({"replicates": 2}, "replicates = 2 .* nothing in a run is drawn by lot"),
        ({"certificate": {"controls": ["hold"]}}, "valid is absent: only studies of sand"),
        (
            {"material": "rojek_2004"},
            "'rojek_2004' .* valid is absent: a study of this kind",
        ),
    ],
)
def test_what_a_study_cannot_ask_is_told(tmp_path: Path, top: dict[str, Any], told: str) -> None:
    with pytest.raises(BadInputError, match=told):
        open_study(opened(tmp_path, top))


def test_a_range_of_a_whole_number_is_swept_in_whole_numbers(tmp_path: Path) -> None:
    sweep = {"keys": {"relaxations": {"low": 1, "high": 5, "number": 3}}}
    runs = expand(open_study(opened(tmp_path, {"sweep": sweep})))
    values = [run.parameters["relaxations"] for run in runs]
    assert values == [1, 3, 5]
    assert all(type(value) is int for value in values)
    assert [run.run.rsplit("_r", 1)[0] for run in runs] == [f"relaxations_{n}" for n in values]
    sweep["keys"]["relaxations"]["high"] = 4.5
    with pytest.raises(BadInputError, match=r"relaxations.high = 4.5 .* a whole number"):
        open_study(opened(tmp_path, {"sweep": sweep}))


def plan_notes(scenario: dict[str, Any]) -> dict[str, str]:
    """What the plan tells of a flow, by what it is about."""
    return {it.about: it.text for it in FlowPlanning().notes(MetalFlow(**scenario))}


def test_the_plan_says_what_lies_beyond_the_map_of_stability() -> None:
    mapped = {"case": {"kind": "tank"}, "dt_max_s": 0.001}
    assert plan_notes(mapped) == {}
    shallow = mapped | {"case": {"kind": "tank", "depth_m": 0.016}, "relaxations": 20}
    assert plan_notes(shallow)["Map"].startswith("relaxations, case.depth_m lie beyond the map")
    thick = mapped | {"metal": {"viscosity_m2_s": 1e-3}}
    assert plan_notes(thick)["Map"].startswith("metal.viscosity_m2_s lies beyond")


def test_a_casting_with_a_shoulder_says_its_mass_and_that_it_moves() -> None:
    def poured(size_m: float) -> dict[str, str]:
        return plan_notes({"case": {"kind": "shoulder", "particle_m": size_m}})

    # counted beside a drawing of 158 cm3: -9.4 to +9.4 %
    assert poured(0.006)["Mass"] == "the particles hold 9.4 % less metal than the drawn casting."
    assert poured(0.0035)["Mass"] == "the particles hold 9.4 % more metal than the drawn casting."
    assert "It lost a third of each swing" in poured(0.005)["Moving"]
    assert "Collisions" in poured(0.005)


def as_printed(scenario: MetalFlow) -> Scheme:
    """The gradient as the paper prints it, with which every run fails."""
    return replace(SCHEME_OF(scenario), gradient="printed")


def test_a_study_is_computed_collected_and_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        scene, "scheme_of", lambda s: (as_printed if s.collision_distance else SCHEME_OF)(s)
    )
    points = [{"collision_distance": distance} for distance in (0.0, 0.1)]
    top = {"sweep": {"design": "list", "points": points}}
    study = open_study(opened(tmp_path, top, duration_s=0.2))
    runs, folder = expand(study), tmp_path / "results"
    assert "particle-solves" in plan_table(runs, Prices(), 1)
    write_plan(runs, folder)
    write_study(study.study, folder)
    for run in runs:
        of_run = folder / "runs" / run.run
        back = read_run(of_run / "scenario.yaml")
        assert isinstance(back.scenario, MetalFlow)
        assert back == run
        render_run(of_run)
        deck = (of_run / "deck.in").read_text()
        assert "metal.density_kg_m3 = 2500.0" in deck
        assert "# Hirata and Anzai 2017, table 1" in deck
        assert simulate(of_run) == 0
        measure_run(of_run)
        export_run(of_run)
        assert (of_run / "final.png").stat().st_size > 5000
    collect(folder)
    summary = pd.read_csv(folder / "summary.tsv", sep="\t")
    # a tank is run to see whether its setting holds: that it does not is an answer
    assert summary["outcome"].tolist() == ["finished"] * 2
    # 16 particles deep the mean is 3 % off
    assert summary["classification"].tolist() == ["biased", "failed"]
    held, failed = summary.to_dict("records")
    # 28 mm of metal, 686 Pa; half a particle at the top, 49 Pa, carries no pressure and as much
    # again is lost to settling
    assert held["h28_mean_pa"] == pytest.approx(686.0, abs=100.0)
    assert held["h28_error_pa"] == pytest.approx(held["h28_mean_pa"] - 686.0, abs=1e-6)
    # 30 mm of metal lie over the middle of the bottom row, 736 Pa, less the top half a particle and
    # what settles; four particles of a calm tank lie under the same weight
    assert held["end_bottom_pa"] == pytest.approx(736.0, abs=100.0)
    assert held["end_bottom_sd_pa"] < 10.0
    assert held["end_highest_pa"] == pytest.approx(held["end_bottom_pa"], rel=0.02)
    mould = len(scene.open_flow(runs[0].scenario).fluid) - 32
    assert held["particle_solves"] == round(6 * (32 + 0.2 * mould)) * held["steps"]
    assert 0.0 < held["solver_fraction"] < 1.0
    assert np.isnan(failed["h28_sd_pa"])
    assert failed["simulated_s"] < 0.2
    assert "without a free surface" in failed["detail"] or "diverged" in failed["detail"]
    write_report(folder, folder / "report.html")
    page = (folder / "report.html").read_text()
    first = page[page.index('<p class="first">') : page.index("</p>", page.index('class="first"'))]
    assert "The pressure stays calm at 1 of 2 settings, calmest at " in first
    assert first.endswith(" 1 of 2 runs broke down.")
    assert "Take smaller particles" in page
    assert "0 excellent, 1 biased, 0 good and 1 failed" in page
    assert page.count('class="flow-film"') == 2
    assert failed["detail"][:40] in page
    # no map: neither time step nor relaxations are swept
    figures = {path.name for path in (folder / "figures").iterdir()}
    assert {"histories.svg", "fields.png"} <= figures
    assert "stability_map.png" not in figures


def one_run(folder: Path, **scenario: Any) -> tuple[Path, RunOutcome]:
    """Plan and compute a study of one run; its folder and outcome."""
    (run,) = expand(open_study(opened(folder, **scenario)))
    write_plan([run], folder / "results")
    of_run = folder / "results" / "runs" / run.run
    render_run(of_run)
    assert simulate(of_run) == 0
    return of_run, RunOutcome.read(of_run / "outcome.json")


def test_pouring_that_diverges_has_failed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scene, "scheme_of", as_printed)
    folder, outcome = one_run(tmp_path, case=SHOULDER, duration_s=0.3)
    assert outcome.outcome in (Outcome.UNSTABLE, Outcome.NO_FREE_SURFACE, Outcome.ESCAPED_METAL)
    assert outcome.detail
    measure_run(folder)  # what there is
    last = pd.read_csv(folder / "measures.tsv", sep="\t").iloc[-1]
    assert last["classification"] == "failed"


def test_a_ladle_fills_the_casting_and_the_records_grow(tmp_path: Path) -> None:
    folder, outcome = one_run(
        tmp_path, case=SHOULDER | {"rate_kg_s": 0.2}, duration_s=0.12,
        relaxations=1, source_share=0.5,
    )  # fmt: skip
    assert outcome.outcome is Outcome.FINISHED, outcome.detail
    with np.load(folder / "fields.npz") as kept:
        count, size = kept["count"], len(kept["pressure_pa"])
    assert count[0] < count[-1]
    assert count.sum() == size
    series = pd.read_csv(folder / "series.tsv", sep="\t")
    scenario = read_run(folder / "scenario.yaml").scenario
    poured_kg = (series["particles"].iloc[-1] - count[0]) * 2500.0 * 0.00625**3
    # the last layer of four particles waits until all of it is due
    assert 0.0 <= 0.2 * 0.12 - poured_kg < 4 * 2500.0 * 0.00625**3
    assert scene.fluid_of(scenario) >= count[-1]


def table(pressure_pa: list[float], rise_m_s: float = 0.0, top_m: float = 0.033) -> pd.DataFrame:
    """Steps of 1 s of a tank's three probes that all read the same."""
    n = len(pressure_pa)
    same = {f"h{h}_pa": pressure_pa for h in (12, 20, 28)}
    return pd.DataFrame(
        {"time_s": np.arange(1.0, n + 1), **same, "largest_speed_m_s": 0.1, "mean_speed_m_s": 0.02,
         "kinetic_energy_j_kg": 1e-3, "top_m": top_m, "largest_rise_m_s": rise_m_s,
         "particles": 32, "step_iterations": 7}
    )  # fmt: skip


def test_runs_are_judged_from_when_they_are_measured() -> None:
    scenario = MetalFlow(**(SMALL | {"duration_s": 9.0, "measured_from_s": 2.0}))
    # 5000 Pa while it settled, then 690 plus and minus 100
    found = measure_flow(scenario, table([5000.0, 5000.0, 790.0, 590.0, 790.0, 590.0]), "")
    assert found.mean_pa["h28"] == pytest.approx(690.0)
    assert found.sd_pa["h28"] == pytest.approx(100.0)
    assert found.ideal_pa == pytest.approx({"h12": 294.0, "h20": 490.0, "h28": 686.0})
    assert found.verdict is StabilityRating.EXCELLENT
    low = measure_flow(scenario, table([0.0, 0.0, *[650.0] * 4]), "")
    assert low.verdict is StabilityRating.BIASED
    loud = measure_flow(scenario, table([0.0, 0.0, 950.0, 500.0, 950.0, 500.0]), "")
    assert loud.verdict is StabilityRating.GOOD
    hops = measure_flow(scenario, table([700.0] * 6, top_m=0.045), "")
    assert (hops.hops, hops.verdict) == (True, StabilityRating.GOOD)
    assert (
        measure_flow(scenario, table([700.0] * 6), "it diverged").verdict is StabilityRating.FAILED
    )


def test_metal_in_a_full_shoulder_that_rises_fast_hops() -> None:
    scenario = MetalFlow(case=SHOULDER, duration_s=9.0)
    names = {"h12_pa": "bottom_pa", "h28_pa": "shoulder_pa"}
    seen = table([500.0] * 4, rise_m_s=0.6).rename(columns=names)
    assert not measure_flow(scenario, seen, "").hops  # still being poured: a splash
    seen["particles"] = scene.fluid_of(scenario)
    assert measure_flow(scenario, seen, "").hops


def test_windows_hold_means_and_the_fastest() -> None:
    seen = table([100.0, 300.0, 500.0, 700.0])
    seen["largest_speed_m_s"] = [0.1, 0.4, 0.2, 0.3]
    found = by_window(seen, ["h28"], 2.0)
    assert found["time_s"].tolist() == [1.0, 3.0]
    assert found["h28_pa"].tolist() == [200.0, 600.0]
    assert found["largest_speed_m_s"].tolist() == [0.4, 0.3]


def test_the_shipped_grid_is_the_papers() -> None:
    keys = ("dt_max_s", "relaxations", "source_share")
    runs = expand(open_study(Path("config/studies/tank_paper.yaml")))
    shipped = [tuple(run.parameters[key] for key in keys) for run in runs]
    assert shipped == [tuple(getattr(scheme, key) for key in keys) for scheme in table_2()]
    told = [said_of(run.parameters) for run in runs]
    # figure 4: all but MR1-1.0 and MR2-1.0 are below 200 Pa
    assert sum(text.startswith("noisy") for text in told) == 2
    assert told[0].startswith("noisy")
    assert told[4].startswith("noisy")
    assert condition_text(runs[9].parameters) == "MR5-0.5, 1 ms"
    assert said_of({"dt_max_s": 1e-4, "relaxations": 5, "source_share": 0.5}) == ""
    assert len(expand(open_study(Path("config/studies/tank_map.yaml")))) == 64


CONDITIONS = pd.DataFrame({
    "dt_max_s": [1e-4, 1e-3, 1e-3], "relaxations": [1, 5, 5], "source_share": [1.0, 0.5, 0.5],
    "collision_distance": [0.8, 0.8, 0.0], "classification": ["good", "excellent", "failed"],
    "hops": [1.0, 0.0, 0.0],
})  # fmt: skip
KEYS = ("dt_max_s", "relaxations", "source_share", "collision_distance")


def test_a_map_has_a_panel_for_all_that_is_swept_beside_its_axes() -> None:
    assert condition_text(dict(CONDITIONS.iloc[2][list(KEYS)])) == (
        "MR5-0.5, 1 ms, collision distance 0"
    )
    parts = _parts(CONDITIONS, KEYS[2:])
    assert [title for title, _ in parts] == [
        "c_poi 1\ncollision distance 0.8",
        "c_poi 0.5\ncollision distance 0.8",
        "c_poi 0.5\ncollision distance 0",
    ]
    assert [part.index.tolist() for _, part in parts] == [[0], [1], [2]]
    assert stability_map(CONDITIONS, KEYS).startswith("data:image/png")
    assert stability_map(CONDITIONS, KEYS[2:]) == ""


def test_a_report_says_where_metal_hops() -> None:
    scenario = MetalFlow(case=SHOULDER)
    assert _hopping(scenario, CONDITIONS, KEYS[:3]) == (
        "When the casting is full, metal that rises faster than 0.5 m/s hops: it hops at MR1-1, "
        "0.1 ms; it does not hop at MR5-0.5, 1 ms.",
    )
    assert _hopping(MetalFlow(case=TANK), CONDITIONS, KEYS[:3]) == ()
    assert _hopping(scenario, CONDITIONS.drop(columns="hops"), KEYS[:3]) == ()


def test_a_film_keeps_places_and_shades() -> None:
    place = np.array([[0.0, 0.0], [0.01, 0.02], [0.002, 0.0], [0.01, 0.018], [1.0, 1.0]])
    fields = {
        "time_s": np.array([0.0, 0.1]), "count": np.array([2, 3]), "position_m": place,
        "velocity_m_s": np.zeros_like(place), "pressure_pa": np.array([0.0, 50.0, 0.0, 200.0, 9.0]),
        "wall_m": np.array([[-0.001, -0.001], [0.019, 0.029]]), "particle_m": np.array(0.002),
    }  # fmt: skip
    film = make_flow_film(fields, "run", "label", 100.0, 10**6)
    raw = np.frombuffer(zlib.decompress(base64.b64decode(film.data)), dtype=np.uint8)
    n = 2 * 2 * 3
    folded = raw[:n].astype(np.uint16) | (raw[n : 2 * n].astype(np.uint16) << 8)
    change = ((folded >> 1) ^ -(folded & 1)).astype(np.uint16).reshape(2, 2, 3)
    steps = np.cumsum(change, axis=1, dtype=np.uint16)
    assert steps[0, 0, 2] == ABSENT  # not poured yet
    assert steps[0, 1, 2] == ABSENT  # flown out of the picture
    back = film.low_m[0] + film.quantum_m * steps[0, :, :2]
    assert back == pytest.approx(np.array([[0.0, 0.01], [0.002, 0.01]]), abs=film.quantum_m)
    shades = raw[2 * n :].reshape(2, 2, 3)
    assert shades[0].tolist() == [[0, 128, 0], [0, 255, 23]]
    thin = make_flow_film(fields, "run", "label", 100.0, 1)
    assert len(thin.time_s) == 2  # the first and the last stay
