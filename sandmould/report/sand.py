"""What the report of a sand study shows beside the verdict: scene, pictures, films, curves."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sandmould.analysis.plots import LAYER_COLOURS
from sandmould.analysis.tube_fill import tube_shares
from sandmould.bad_input import BadInputError
from sandmould.drawing import figures
from sandmould.drawing.animation import BENT_M, Film, make_film
from sandmould.drawing.sphere_film import SphereFilm, sphere_frames
from sandmould.drawing.sphere_scene import SurfaceField, sphere_scene
from sandmould.engines.snapshot import Snapshot
from sandmould.kinds.sand.moments import MOMENTS, Moment, list_moments, nearest
from sandmould.report.curves import measure_curves, pictured_runs
from sandmould.runs.columns import (
    BED_HEIGHT_M,
    RUN,
    SOLID_FRACTION,
    TIME_S,
    VIBRATION_TIME_S,
    finished,
)
from sandmould.runs.formatting import listed, setting_text
from sandmould.runs.templates import worded
from sandmould.scenario.scenario import Scenario
from sandmould.statistics.verdict import Verdict
from sandmould.study.collect import Collected
from sandmould.study.plan.plan_files import SPHERES, read_run

_SECONDARY = (
    SOLID_FRACTION, "apparent_density_corrected_kg_m3", "coordination", BED_HEIGHT_M,
)  # fmt: skip


def sand_pages(
    study_folder: Path,
    scenario: Scenario,
    collected: Collected,
    verdict: Verdict,
    film_budget_bytes: int,
    href: str,
    own_measures: Iterable[str] = (),
) -> dict[str, Any]:
    """Draw everything that a study of sand shows, as ``sand.html`` names it; empty without data.

    ``beside`` has films of all grains: scripts that lie beside the page, by file name.
    """
    roles = pictured_runs(study_folder, collected.summary, verdict)
    run = next(iter(roles.values()), "")
    moments = list_moments(study_folder / "runs" / run) if run else ()
    chosen = _chosen(moments, scenario)
    snapshots = [m.load() for _, m in chosen]
    headings = [f"{heading}, {_clock_s(moment):.2f} s" for heading, moment in chosen]
    height_m = _picture_height_m(snapshots, scenario)
    layers = figures.draw_layers(snapshots, scenario, height_m)
    ends = sorted({0, len(chosen) - 1}) if chosen else []
    densities, scale, median_kg_m3 = figures.draw_densities(
        [snapshots[end] for end in ends], scenario, height_m
    )
    shown = _shown_runs(study_folder, roles, collected, verdict, scenario)
    films: tuple[Film, ...] | tuple[SphereFilm, ...]
    beside: dict[str, str] = {}
    if scenario.dimension == 2:
        made = (make_film(s.folder, s.label, s.reading, film_budget_bytes) for s in shown)
        films = tuple(film for film in made if film is not None)
    else:
        films, beside = _sphere_films(shown, scale, film_budget_bytes, f"{href}{SPHERES}/")
    bed_m = _bed_height_m(collected.curves, run)
    number_of_layers = max((int(s.layer.max(initial=1)) for s in snapshots), default=1)
    return {
        "scene": figures.draw_dimensions(scenario, bed_m),
        "scene_alt": _scene_alt(scenario, bed_m),
        "pictured_run": run,
        "height_m": height_m,
        "role": _role_text(next(iter(roles), ""), verdict, collected.summary),
        "panels": tuple(
            {
                "heading": headings[end],
                "by_layer": layers[end],
                "by_density": by_density,
                "alt": f"The sand of run {run} {chosen[end][0]}",
            }
            for end, by_density in zip(ends, densities, strict=True)
        ),
        "moments": tuple(zip(headings, layers, strict=True)),
        "density_scale": scale,
        "density_conclusion": worded(
            "density_course.j2", kg_m3=[d for d in median_kg_m3 if math.isfinite(d)]
        ),
        "layer_colours": tuple(
            (n, LAYER_COLOURS[(n - 1) % len(LAYER_COLOURS)]) for n in range(1, number_of_layers + 1)
        ),
        "layer_conclusion": _layer_conclusion(snapshots, scenario),
        "films": films,
        "beside": beside,
        "tubes": measure_curves(
            collected, verdict, _tube_measures(collected.curves, scenario, verdict)
        ),
        "others": measure_curves(
            collected, verdict, _other_measures(scenario, verdict, own_measures)
        ),
    }


def _clock_s(moment: Moment) -> float:
    """Time of vibration, or of the run where nothing vibrates."""
    return moment.time_s if math.isnan(moment.vibration_time_s) else moment.vibration_time_s


def _role_text(role: str, verdict: Verdict, summary: pd.DataFrame) -> str:
    """Why a run is the one to be looked at."""
    return worded(
        "pictured.j2",
        role=role,
        measure=verdict.measure,
        most=_value_words(verdict).get(role, role),
        is_mean=verdict.best is not None and verdict.best.n > 1,
        has_finished=finished(summary).any(),
    )


def _value_words(verdict: Verdict) -> dict[str, str]:
    """What the values of the best and the worst run are: a run is not its setting."""
    words = ("highest", "lowest") if verdict.better == "larger" else ("lowest", "highest")
    return dict(zip(("best", "worst"), words, strict=True))


def _chosen(moments: Sequence[Moment], scenario: Scenario) -> list[tuple[str, Moment]]:
    """Snapshots at 0, 1/8, 1/2 and 1 of the vibration, as far as the run has them."""
    duration_s = sum(stage.whole_duration_s for stage in scenario.vibrations)
    if not moments:
        return []
    if not duration_s:
        return [("at its end", moments[-1])]
    chosen: dict[Moment, str] = {}
    for heading, share in MOMENTS.items():
        moment = nearest(moments, share * duration_s)
        if abs(moment.vibration_time_s - share * duration_s) <= 0.1 * duration_s:
            rests = share == 1.0 and scenario.ends_at_rest
            chosen.setdefault(moment, "at rest after its end" if rests else heading)
    shown = [(heading, moment) for moment, heading in chosen.items()]
    return shown or [("at its last snapshot", moments[-1])]


def _picture_height_m(snapshots: Sequence[Snapshot], scenario: Scenario) -> float:
    """Height of the pictures: the sand and the tubes, not the empty space above."""
    tops = [float((s.position_m[:, -1] + s.radius_m).max()) for s in snapshots if len(s.id)]
    tops += [float(solid.corners()[:, -1].max()) for solid in scenario.scene.solids]
    # sand heaped over the rim is shown too, grains still falling from high up are not
    return min(1.12 * max(tops, default=scenario.box.height_m), 1.4 * scenario.box.height_m)


def _bed_height_m(curves: pd.DataFrame, run: str) -> float | None:
    """Height of the filled bed as vibration begins."""
    if BED_HEIGHT_M not in curves:
        return None
    rows = curves[(curves[RUN] == run) & (curves[VIBRATION_TIME_S] >= 0)]
    height_m = rows[BED_HEIGHT_M].dropna()
    return float(height_m.iloc[0]) if len(height_m) else None


class _Shown(NamedTuple):
    """A run that a film is made of."""

    folder: Path
    scenario: Scenario
    label: str
    reading: tuple[NDArray[np.float64], NDArray[np.float64]] | None
    """Times and values of the objective."""


def _shown_runs(
    study_folder: Path,
    roles: Mapping[str, str],
    collected: Collected,
    verdict: Verdict,
    scenario: Scenario,
) -> list[_Shown]:
    """Runs that films are made of: those of the scene's dimension."""
    shown = []
    words = _value_words(verdict) | {"best": "best setting"}
    for role, run in roles.items():
        row = collected.summary[collected.summary[RUN] == run].iloc[0]
        setting = setting_text({key: row[key] for key in collected.keys})
        curve = collected.curves[collected.curves[RUN] == run]
        reading = None
        if verdict.measure in curve:
            readings = curve[[TIME_S, verdict.measure]].dropna().to_numpy(dtype=np.float64)
            reading = (readings[:, 0], readings[:, 1])
        folder, own = study_folder / "runs" / run, scenario
        with contextlib.suppress(BadInputError, OSError):
            own = cast(Scenario, read_run(folder / "scenario.yaml").scenario)
        if own.dimension == scenario.dimension:
            label = f"{words.get(role, role)}: {setting}"
            shown.append(_Shown(folder, own, label, reading))
    return shown


def _sphere_films(
    shown: Sequence[_Shown], scale: tuple[float, float], budget_bytes: int, folder_href: str
) -> tuple[tuple[SphereFilm, ...], dict[str, str]]:
    """Films of spheres for the page, and the scripts beside it."""
    films = []
    beside: dict[str, str] = {}
    for folder, scenario, label, reading in shown:
        if moments := list_moments(folder):
            frames = sphere_frames(moments, scenario, folder.name, label, scale, reading)
            cut_m = figures.cut_m(scenario) or 0.0
            film, script = frames.inside_and_beside(cut_m, budget_bytes, folder_href)
            films.append(film)
            beside |= script
    return tuple(films), beside


def film_scene(
    scenario: Scenario, height_m: float, fields: Sequence[SurfaceField]
) -> dict[str, object]:
    """The scene for the page's canvas, in m; a pattern is drawn as it bends, with the film.

    In 3D its solids can be coloured by fields.
    """
    if scenario.dimension == 3:
        return sphere_scene(scenario, min(height_m, scenario.box.height_m), fields)
    pattern = scenario.pattern.name if scenario.pattern is not None else ""
    obstacles = [o for o in scenario.obstacles if o.name != pattern]
    still = scenario.model_copy(update={"obstacles": tuple(obstacles), "pattern": None})
    section = figures.section_of(still, height_m)
    return {
        "width_m": scenario.box.width_m,
        "height_m": height_m,
        "walls": [np.round(w, 6).tolist() for w in section.walls_m],
        "solids": [np.round(s, 6).tolist() for s in section.solids_m],
        "bores": [np.round(b, 6).tolist() for b in section.bores_m],
        "cavities": [np.round(c, 6).tolist() for c in section.cavities_m],
        "layer_colours": list(LAYER_COLOURS),
        "bent_m": BENT_M,
    }


def _tube_measures(curves: pd.DataFrame, scenario: Scenario, verdict: Verdict) -> list[str]:
    """The objective first, then the filling of every tube and cavity."""
    names = [*(b.name for b in scenario.scene.bores), *(c.name for c in scenario.cavities)]
    fills = [f"{name}_fill_fraction" for name in names]
    return list(dict.fromkeys([verdict.measure, *(f for f in fills if f in curves)]))


def _other_measures(scenario: Scenario, verdict: Verdict, own: Iterable[str]) -> list[str]:
    """How deep the sand has come, which voids it leaves, the user's own, and what the bed does."""
    fronts = [f"{bore.name}_front_depth_m" for bore in scenario.scene.bores]
    for cavity in scenario.cavities:
        fronts += [f"{cavity.name}_filled_depth_m", f"{cavity.name}_void_fraction"]
    return [m for m in (*fronts, *own, *_SECONDARY) if m != verdict.measure]


def _layer_conclusion(snapshots: Sequence[Snapshot], scenario: Scenario) -> str:
    """Which layers the sand in the first tube came from, the largest share first."""
    if not snapshots or not scenario.scene.bores:
        return ""
    bore, last = scenario.scene.bores[0], snapshots[-1]
    found = tube_shares(last.position_m, last.radius_m, last.layer, bore)
    shares = [
        f"layer {layer} ({100 * share:.0f} %)"
        for share, layer in sorted(zip(found.values(), found, strict=True), reverse=True)
        if share >= 0.05
    ]
    name = bore.name.replace("_", " ")
    return f"At the end the sand in the {name} comes from {listed(shares)}." if shares else ""


def _scene_alt(scenario: Scenario, bed_m: float | None) -> str:
    box = scenario.box
    solid = listed(sorted({o.name.replace("_", " ") for o in scenario.obstacles})) or "nothing"
    bed = "" if bed_m is None else f", filled with sand to {1e3 * bed_m:.0f} mm"
    return (
        f"Section of the box, {1e3 * box.width_m:g} mm wide and {1e3 * box.height_m:g} mm high, "
        f"with {solid} in it{bed}"
    )
