"""Films of discs, packed small enough to lie inside one HTML page.

Positions are whole numbers of a quantum, too small to see; what is stored is their change from
frame to frame, low bytes before high bytes, deflated: still grains cost next to nothing then.
``templates/report/animation.js`` unpacks and draws them.
"""

from __future__ import annotations

import base64
import math
import zlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from sandmould.kinds.sand.moments import Moment, list_moments

BUDGET_BYTES = 2_500_000
_MOST_FRAMES = 240
_LEVELS = 8191
"""Quanta across the longest side: a tenth of a pixel on a screen."""
BENT_M = 5e-5
"""Unit of the outlines of a pattern: a twentieth of a millimetre."""
ABSENT = 65535
"""Coordinate of a grain that has not been filled in yet."""


@dataclass(frozen=True, kw_only=True)
class PackedFilm:
    """A film of one run whose frames are packed into one text, as the page reads it."""

    run: str
    label: str = ""
    time_s: tuple[float, ...] = (0.0,)
    quantum_m: float = 1.0
    data: str = ""
    """Base64 of deflated bytes."""

    @property
    def values(self) -> dict[str, object]:
        """For JSON."""
        return dict(vars(self))


FilmT = TypeVar("FilmT", bound=PackedFilm)


@dataclass(frozen=True, kw_only=True)
class GrainFilm(PackedFilm):
    """Frames of grains, of none unless given; coordinates are the box's own, in m."""

    grains: int = 0
    vibration_time_s: tuple[float | None, ...] = (None,)
    """None before the first vibration."""
    stage: tuple[str, ...] = ("",)
    reading: tuple[float | None, ...] = (None,)
    """The objective at each frame, if known."""
    origin_m: tuple[float, ...] = (0.0, 0.0, 0.0)
    largest_radius_m: float = 1.0


@dataclass(frozen=True, kw_only=True)
class Film(GrainFilm):
    """Discs.

    ``data`` has coordinates by axis, frame and grain; radii (uint16, shares of the largest, low
    bytes first); layers (uint8).
    """

    bent: tuple[tuple[int, ...], ...]
    """Outline of a pattern at each frame, x and y of one vertex after another in ``BENT_M``; empty
    without one."""


def make_film(
    run_folder: Path,
    label: str,
    reading: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None,
    budget_bytes: int = BUDGET_BYTES,
) -> Film | None:
    """Pack the snapshots of a run; frames are left out to keep the budget, grains never.

    ``reading``: times, s, and values of the objective. None without a readable snapshot.
    """
    moments = list_moments(run_folder)
    if not moments:
        return None
    last = moments[-1].load()
    # positions deflate to a fifth or less, so more raw bytes than this are not worth a try
    raw_frame = max(1, 2 * last.position_m.size)
    count = min(len(moments), _MOST_FRAMES, max(2, 8 * budget_bytes // raw_frame))
    return within_budget(
        lambda chosen: _pack([moments[i] for i in chosen], run_folder.name, label, reading),
        len(moments), count, budget_bytes,
    )  # fmt: skip


def within_budget(
    pack: Callable[[list[int]], FilmT], total: int, count: int, budget_bytes: int
) -> FilmT:
    """Pack frames evenly over a run, fewer and fewer until they weigh little enough.

    ``pack`` gives the film of some frames of ``total``, by their places; ``count`` are tried first,
    and two are kept whatever they weigh.
    """
    while True:
        film = pack(evenly(total, count).tolist())
        if len(film.data) <= budget_bytes or count <= 2:
            return film
        count = max(2, min(count - 1, int(0.95 * count * budget_bytes / len(film.data))))


def encoded(raw: bytes) -> str:
    """Base64 of deflated bytes."""
    return base64.b64encode(zlib.compress(raw, 6)).decode("ascii")


def evenly(number: int, count: int) -> NDArray[np.int64]:
    """Places of the first, the last and evenly spread ones between, at most all."""
    return np.unique(np.linspace(0, number - 1, min(count, number)).round().astype(np.int64))


def _pack(
    moments: Sequence[Moment],
    run: str,
    label: str,
    reading: tuple[NDArray[np.float64], NDArray[np.float64]] | None,
) -> Film:
    frames = [m.load() for m in moments]
    ids = np.unique(np.concatenate([f.id for f in frames]))
    every = np.concatenate([f.position_m for f in frames])
    origin_m = every.min(axis=0) if len(every) else np.zeros(2)
    extent_m = float(np.ptp(every, axis=0).max()) if len(every) else 1.0
    quantum_m = extent_m / _LEVELS or 1e-6
    place = np.full((2, len(frames), len(ids)), ABSENT, dtype=np.uint16)
    radius_m, layer = np.zeros(len(ids)), np.zeros(len(ids), dtype=np.uint8)
    for number, frame in enumerate(frames):
        row = np.searchsorted(ids, frame.id)
        place[:, number, row] = np.rint((frame.position_m - origin_m) / quantum_m).T
        radius_m[row], layer[row] = frame.radius_m, np.minimum(frame.layer, 255)
    largest_m = float(radius_m.max(initial=0.0)) or 1.0
    share = np.rint(radius_m / largest_m * 65535).astype(np.uint16)
    raw = split_bytes(changes(place)) + split_bytes(share) + layer.tobytes()
    time_s = np.array([f.time_s for f in frames])
    return Film(
        run=run,
        label=label,
        grains=len(ids),
        time_s=tuple(time_s.round(6).tolist()),
        vibration_time_s=rounded(f.vibration_time_s for f in frames),
        stage=tuple(f.stage for f in frames),
        reading=readings_at(time_s, reading),
        origin_m=tuple(origin_m.tolist()),
        quantum_m=quantum_m,
        largest_radius_m=largest_m,
        bent=tuple(
            tuple(np.rint(f.pattern_m / BENT_M).astype(np.int64).ravel().tolist())
            for f in frames
            if f.pattern_m is not None
        ),
        data=encoded(raw),
    )


def changes(place: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Change of each coordinate from the frame before, folded so that small ones are small.

    0, -1, 1, -2, 2, ... become 0, 1, 2, 3, 4, ...; the first frame is the change from 0.
    """
    step = np.diff(place, axis=1, prepend=np.zeros_like(place[:, :1])).astype(np.int16)
    return ((step << 1) ^ (step >> 15)).astype(np.uint16)


def split_bytes(values: NDArray[np.uint16]) -> bytes:
    """All low bytes, then all high bytes."""
    return (values & 0xFF).astype(np.uint8).tobytes() + (values >> 8).astype(np.uint8).tobytes()


def rounded(times_s: Iterable[float]) -> tuple[float | None, ...]:
    """Times to a microsecond; None where there is none."""
    return tuple(None if math.isnan(time_s) else round(time_s, 6) for time_s in times_s)


def readings_at(
    time_s: NDArray[np.float64],
    reading: tuple[NDArray[np.float64], NDArray[np.float64]] | None,
) -> tuple[float | None, ...]:
    """Values at each frame, from those that are known; None outside them."""
    if reading is None or not len(reading[0]):
        return (None,) * len(time_s)
    values = np.interp(time_s, *reading, left=np.nan, right=np.nan)
    return tuple(round(v, 4) if np.isfinite(v) else None for v in values.tolist())
