"""Films of spheres for the page's 3D view: all grains beside the page, a light part inside it.

Packed as the films of discs are, with two shades a grain and frame: apparent density and speed.
Vertices of a pattern that bends follow the grains as points. ``templates/report/sphere_film.js``
unpacks and ``sphere_view.js`` draws them.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from sandmould.analysis.density import apparent_density
from sandmould.drawing import animation
from sandmould.engines.snapshot import Snapshot, scene_at
from sandmould.kinds.sand.moments import Moment
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.stages import is_filling

Array = NDArray[np.float64]
MOST_INSIDE = 30_000
"""Grains inside the page: of more only a slice behind the cut is taken, dense and to scale."""
MOST_BESIDE = 3_600_000
"""Grains times frames beside the page: 8 bytes each, a third more in base64, are 38.4 MB even where
nothing deflates."""
MOST_FRAMES = 120
LEVELS = 8191
"""Quanta across the longest side: a grain of a hundredth of it is 80 quanta wide."""
UNKNOWN = 255
"""Shade of a grain whose density is not known."""


@dataclass(frozen=True, kw_only=True)
class SphereFilm(animation.GrainFilm):
    """Spheres; of no grain unless given, for a view of solids alone.

    ``data`` has coordinates by axis, frame and point; radii of the grains (uint16, shares of the
    largest, low bytes first); their layers (uint8); shades of density and of speed by frame and
    grain (uint8).
    """

    of_grains: int = 0
    """Grains of the run; fewer are shown where the film is light."""
    vertices: int = 0
    """Points after the grains: vertices of the pattern that bends, 0 without one."""
    is_filling: tuple[bool, ...] = (False,)
    slice_m: tuple[float, float] | None = None
    """Least and greatest y of the grains that are shown, where not all are."""
    density_kg_m3: tuple[float, float] = (0.0, 1.0)
    """Densities of shades 0 and 254."""
    fastest_m_s: float = 1.0
    """Speed of shade 254 and above."""
    data: str = animation.encoded(b"")
    beside: str = ""
    """Address of the script with all grains and frames; empty where this film has them."""
    beside_bytes: int = 0
    beside_frames: int = 0


@dataclass(frozen=True)
class SphereFrames:
    """Frames of a run, quantised and shaded, before they are packed."""

    place: NDArray[np.uint16]
    """(3, frames, points) uint16: quanta from the origin; ``ABSENT`` where a grain is not there."""
    radius_m: Array
    layer: NDArray[np.uint8]
    shade: NDArray[np.uint8]
    """(2, frames, grains) uint8: apparent density and speed."""
    film: SphereFilm
    """All but the data."""

    def packed(self, grains: NDArray[np.int64], frames: Sequence[int]) -> SphereFilm:
        """Pack some of the grains at some of the frames."""
        points = np.append(grains, np.arange(len(self.radius_m), self.place.shape[2]))
        share = np.rint(self.radius_m[grains] / self.film.largest_radius_m * 65535)
        raw = (
            animation.split_bytes(animation.changes(self.place[:, frames][:, :, points]))
            + animation.split_bytes(share.astype(np.uint16))
            + self.layer[grains].tobytes()
            + self.shade[:, frames][:, :, grains].tobytes()
        )
        of_frames = ("time_s", "vibration_time_s", "stage", "is_filling", "reading")
        chosen: dict[str, Any] = {
            name: tuple(getattr(self.film, name)[i] for i in frames) for name in of_frames
        }
        return replace(self.film, **chosen, grains=len(grains), data=animation.encoded(raw))

    @property
    def whole(self) -> SphereFilm:
        """All grains at all frames, packed."""
        return self.packed(np.arange(len(self.radius_m)), range(self.place.shape[1]))

    def light(self, cut_m: float, budget_bytes: int) -> SphereFilm:
        """Pack what a page can hold: frames are left out, and grains far behind the cut.

        ``cut_m``: y of the plane behind which grains are shown first.
        """
        grains, slice_m = self._behind(cut_m)
        total = self.place.shape[1]
        count = max(2, min(total, budget_bytes // max(1, 4 * len(grains))))
        film = animation.within_budget(partial(self.packed, grains), total, count, budget_bytes)
        return replace(film, slice_m=slice_m)

    def inside_and_beside(
        self, cut_m: float, budget_bytes: int, folder_href: str
    ) -> tuple[SphereFilm, dict[str, str]]:
        """The film for the page, and the script that lies beside it, by file name.

        No script where the page holds all there is; ``folder_href``: its folder, seen from there.
        """
        light, total = self.light(cut_m, budget_bytes), self.place.shape[1]
        if light.slice_m is None and len(light.time_s) == total:
            return light, {}
        name = f"{self.film.run}.js"
        # the film as a script that hands itself to the page
        script = f"sphereFilmArrived({json.dumps(self.whole.values, separators=(',', ':'))});\n"
        href = f"{folder_href}{quote(name)}"
        inside = replace(light, beside=href, beside_bytes=len(script), beside_frames=total)
        return inside, {name: script}

    def _behind(self, cut_m: float) -> tuple[NDArray[np.int64], tuple[float, float] | None]:
        """Grains on the plane of the cut and next behind it, and between which y they lie."""
        n = len(self.radius_m)
        if n <= MOST_INSIDE:
            return np.arange(n), None
        y = self.film.origin_m[1] + self.film.quantum_m * self.place[1, -1, :n]
        nearest = np.where(self.place[1, -1, :n] == animation.ABSENT, -np.inf, y) + self.radius_m
        # as many as the page holds from the plane on; some before it where it lies far back
        order = np.argsort(nearest, kind="stable")
        first = min(int(np.searchsorted(nearest[order], cut_m)), n - MOST_INSIDE)
        chosen = np.sort(order[first : first + MOST_INSIDE])
        here = self.place[1, -1, chosen] != animation.ABSENT
        return chosen, (float(y[chosen][here].min()), float(y[chosen][here].max()))


def sphere_frames(
    snapshots: Sequence[Snapshot] | Sequence[Moment],
    scenario: Scenario,
    run: str,
    label: str,
    scale: tuple[float, float],
    reading: tuple[Array, Array] | None = None,
) -> SphereFrames:
    """Quantise and shade all grains of a run.

    ``snapshots``: at least one, in order of time, thinned so that all grains fit beside the page;
    moments are read one at a time.
    """
    most = max(2, min(MOST_FRAMES, MOST_BESIDE // max(1, len(_read(snapshots[-1]).id))))
    chosen = [snapshots[i] for i in animation.evenly(len(snapshots), most).tolist()]
    ids, low_m, high_m, vertices = _extent(chosen)
    quantum_m = float((high_m - low_m).max()) / LEVELS or 1e-6
    n, total = len(ids), len(chosen)
    place = np.full((3, total, n + vertices), animation.ABSENT, dtype=np.uint16)
    density, speed = np.full((total, n), np.nan), np.zeros((total, n))
    radius_m, layer = np.zeros(n), np.zeros(n, dtype=np.uint8)
    clock: list[tuple[float, float, str]] = []
    for number, each in enumerate(chosen):
        frame = _read(each)
        row = np.searchsorted(ids, frame.id)
        place[:, number, row] = np.rint((frame.position_m - low_m) / quantum_m).T
        if vertices and frame.pattern_m is not None:
            place[:, number, n:] = np.rint((frame.pattern_m - low_m) / quantum_m).T
        radius_m[row], layer[row] = frame.radius_m, np.minimum(frame.layer, 255)
        speed[number, row] = np.linalg.norm(frame.velocity_m_s, axis=1)
        density[number, row] = apparent_density(
            frame.position_m,
            frame.radius_m,
            scenario.sand.density_kg_m3,
            scene=scene_at(scenario, frame),
        ).corrected_kg_m3
        clock.append((frame.time_s, frame.vibration_time_s, frame.stage))
    time_s = np.array([time for time, _, _ in clock])
    filling = tuple(is_filling(stage) for _, _, stage in clock)
    fastest_m_s = _fastest(speed, place[0, :, :n] != animation.ABSENT, np.array(filling))
    film = SphereFilm(
        run=run,
        label=label,
        grains=n,
        of_grains=n,
        vertices=vertices,
        time_s=tuple(time_s.round(6).tolist()),
        vibration_time_s=animation.rounded(shaken_s for _, shaken_s, _ in clock),
        stage=tuple(stage for _, _, stage in clock),
        is_filling=filling,
        reading=animation.readings_at(time_s, reading),
        origin_m=tuple(low_m.tolist()),
        quantum_m=quantum_m,
        largest_radius_m=float(radius_m.max(initial=0.0)) or 1.0,
        density_kg_m3=scale,
        fastest_m_s=fastest_m_s,
    )
    span = (scale[1] - scale[0]) or 1.0
    shares = ((density - scale[0]) / span, speed / fastest_m_s)
    return SphereFrames(place, radius_m, layer, np.stack([_shade(s) for s in shares]), film)


def _read(snapshot: Snapshot | Moment) -> Snapshot:
    return snapshot.load() if isinstance(snapshot, Moment) else snapshot


def _extent(
    snapshots: Sequence[Snapshot] | Sequence[Moment],
) -> tuple[NDArray[np.int64], Array, Array, int]:
    """All ids, the corners of all that is drawn, and how many vertices bend in every frame."""
    ids: NDArray[np.int64] = np.zeros(0, dtype=np.int64)
    low_m, high_m, vertices = np.full(3, np.inf), np.full(3, -np.inf), set()
    for each in snapshots:
        frame = _read(each)
        ids = np.union1d(ids, frame.id)
        bent = frame.pattern_m
        vertices.add(0 if bent is None else len(bent))
        for points in (frame.position_m, bent):
            if points is not None and len(points):
                low_m, high_m = np.fmin(low_m, points.min(0)), np.fmax(high_m, points.max(0))
    if not np.isfinite(low_m).all():
        low_m, high_m = np.zeros(3), np.ones(3)
    return ids, low_m, high_m, vertices.pop() if len(vertices) == 1 else 0


def _fastest(speed: Array, here: NDArray[np.bool_], filling: NDArray[np.bool_]) -> float:
    """Speed that is shaded full: few grains are faster once the box is full."""
    rows = filling if filling.all() else ~filling
    known = speed[rows][here[rows]]
    return (float(np.quantile(known, 0.99)) if len(known) else 0.0) or 1.0


def _shade(share: Array) -> NDArray[np.uint8]:
    whole = np.rint(254 * np.clip(np.nan_to_num(share), 0.0, 1.0)).astype(np.uint8)
    return np.where(np.isnan(share), np.uint8(UNKNOWN), whole)
