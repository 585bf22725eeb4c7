"""What ``sandmould new`` asks: the questions, their limits, and how answers go together."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Literal

from sandmould.engines.registry import engine_problem
from sandmould.kinds.registry import DEFAULT_KIND
from sandmould.scenario.engine import ENGINE_NAMES, Engine, EngineName
from sandmould.scenario.quantity import NAME, Section, quantity
from sandmould.scenario.reading import Origin, merge, read_yaml, validated
from sandmould.scenario.sand import Sand
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.unbalance import Unbalance
from sandmould.scenario.vibration import VibrationStage
from sandmould.study.plan.load_study import MATERIALS, materials

WHY_HELD = (
    "What is held decides most. With 1.5 g held the shipped tube fills best at 76 Hz. With the "
    "amplitude held it is full from 120 Hz on. With the velocity held, 60 to 240 Hz fill alike."
)
HELD = {
    "acceleration": "the acceleration in g stays: a shaker whose controller holds it",
    "velocity": "the velocity in mm/s stays: a shaker whose controller holds it",
    "displacement": "the amplitude in mm stays: that of a crank or cam",
    "unbalance": "rotating masses on a table that stands on mounts",
}
HOLES = {
    "tube": "a blind horizontal hole, closed at the right wall of the box",
    "hole_up": "a blind hole that opens upwards",
    "hole_down": "a blind hole that opens downwards",
    "none": "no hole: the study asks how densely the sand packs",
}
WALL_MM = 3.0
"""Thickness of the walls round a hole."""
_LEAST_GRAINS_WIDE = 5
"""Width of a hole in its largest grains below which a warning is said: grains wedge in a mouth of
fewer (argued)."""
_TUBE = "config/scenarios/tube.yaml"
_TABLE = "config/studies/tube_unbalance.yaml"
_DEMO = "config/studies/tube_demo.yaml"
_LAW = "config/studies/tube_law_hold.yaml"
_HOLE = "config/studies/blind_cavity.yaml"


class NewStudy(Section):
    """Answers; each description is a question."""

    hold: Literal["acceleration", "velocity", "displacement", "unbalance"] = quantity(
        "acceleration",
        "What stays the same when the frequency changes",
        source=_TUBE,
    )
    acceleration_g: float = quantity(
        1.5, "Greatest acceleration of the vibration", unit="g", source=_TUBE, gt=0, le=100
    )
    velocity_mm_s: float = quantity(
        47.0, "Greatest velocity of the vibration", unit="mm/s", source=_LAW, gt=0, le=10_000
    )
    amplitude_mm: float = quantity(
        0.15, "Amplitude (half of peak to peak)", unit="mm", source=_LAW, gt=0, le=100
    )
    moment_kg_m: float = quantity(
        0.006, "Rotating mass times its eccentricity", unit="kg m", source=_TABLE, gt=0, le=1e4
    )
    moving_mass_kg: float = quantity(
        30.0, "Mass of table, motors and empty flask", unit="kg", source=_TABLE, gt=0, le=1e6
    )
    mount_frequency_hz: float = quantity(
        6.0, "Natural frequency of that mass on its mounts", unit="Hz", source=_TABLE,
        ge=0.01, le=1000,
    )  # fmt: skip
    flask_depth_mm: float = quantity(
        500.0, "Depth of the flask across the plane", unit="mm", source=_TABLE, gt=0, le=100_000
    )
    lowest_hz: float = quantity(
        25.0, "Lowest frequency", unit="Hz", source=_DEMO, ge=0.1, le=10_000
    )
    highest_hz: float = quantity(
        140.0, "Highest frequency", unit="Hz", source=_DEMO, ge=0.1, le=10_000
    )
    settings: int = quantity(
        4, "Number of frequencies from one to the other", source=_DEMO, ge=2, le=100
    )
    direction: Literal["vertical", "horizontal"] = quantity(
        "vertical", "Direction of the vibration", source=_TUBE
    )
    most_g: float | None = quantity(
        None, "Greatest acceleration that the table bears (no limit unless given)",
        unit="g", source="user", gt=0,
    )  # fmt: skip
    duration_s: float = quantity(
        2.0, "Duration of the vibration", unit="s", source=_TUBE, gt=0, le=3600
    )
    width_mm: float = quantity(
        120.0, "Inner width of the box", unit="mm", source=_TUBE, gt=0, le=100_000
    )
    height_mm: float = quantity(
        110.0, "Inner height of the box", unit="mm", source=_TUBE, gt=0, le=100_000
    )
    cavity: Literal["tube", "hole_up", "hole_down", "none"] = quantity(
        "tube",
        "Hole to fill",
        source=_TUBE,
    )
    opening_mm: float = quantity(
        24.0, "Width of the hole", unit="mm", source=_TUBE, gt=0, le=100_000
    )
    cavity_depth_mm: float = quantity(
        40.0, "Depth of the hole from its opening", unit="mm", source=_HOLE, gt=0, le=100_000
    )
    hole_height_mm: float | None = quantity(
        None, "Height of the hole's middle over the floor", unit="mm", source=_TUBE, gt=0
    )
    sand_height_mm: float | None = quantity(
        None, "Height of the sand over the floor, before it vibrates", unit="mm", source=_TUBE,
        gt=0,
    )  # fmt: skip
    material: str = quantity("rojek_2004", "Sand", source=_TUBE, pattern=NAME)
    size_scale: float = quantity(
        6.0,
        "How many times larger than real grains the computed ones are (6 is coarse and quick)",
        source=_DEMO,
        ge=0.01,
        le=100,
    )
    wave_speed_m_s: float | None = quantity(
        None,
        "Wave speed of the sand, if you have measured it. It says how stiff the sand is, and the "
        "best frequency depends on that. Left empty, the stiffness of the sand's file counts",
        unit="m/s",
        source="docs/hard_sand.md",
        gt=0,
    )
    engine: EngineName = quantity("reference", "Engine: reference is the faster one", source=_DEMO)
    replicates: int = quantity(
        4,
        "How often each setting is computed, each time with other grains. More repeats show "
        "smaller differences between settings",
        source=_LAW,
        ge=1,
        le=100,
    )

    @property
    def opens_down(self) -> bool:
        """Whether the hole opens downwards."""
        return self.cavity == "hole_down"

    @property
    def middle_mm(self) -> float:
        """Height of the hole's middle over the floor.

        Unless given it is that of a shipped study, or the nearest at which a larger hole and its
        walls lie in the box.
        """
        if self.hole_height_mm is not None:
            return self.hole_height_mm
        half_mm, below_mm, above_mm = self._extent_mm
        shipped_mm = 0.32 * self.height_mm
        if self.cavity != "tube":
            shipped_mm = 0.4 * self.height_mm + (half_mm if self.opens_down else -half_mm)
        highest_mm = self.height_mm - half_mm - above_mm
        return max(min(shipped_mm, highest_mm), half_mm + below_mm)

    @property
    def _extent_mm(self) -> tuple[float, float, float]:
        """Half the height of the hole, and the walls below and above it."""
        if self.cavity == "tube":
            return self.opening_mm / 2, WALL_MM, WALL_MM
        return self.cavity_depth_mm / 2, *((0.0, WALL_MM) if self.opens_down else (WALL_MM, 0.0))

    @property
    def solid_ends_mm(self) -> tuple[float, float]:
        """Lowest and highest point of the hole's walls."""
        half_mm, below_mm, above_mm = self._extent_mm
        return self.middle_mm - half_mm - below_mm, self.middle_mm + half_mm + above_mm

    @property
    def level_mm(self) -> float:
        """Height of the sand, four fifths of the box's unless given."""
        return 0.8 * self.height_mm if self.sand_height_mm is None else self.sand_height_mm

    @property
    def poured_mm(self) -> float:
        """Height of the sand in a box without the hole: the plan counts walls and empty tube on."""
        wide_mm, deep_mm = self.opening_mm, self.cavity_depth_mm
        displaced_mm2 = {
            "none": 0.0,
            "tube": (wide_mm + 2 * WALL_MM) * deep_mm,
        }.get(self.cavity, WALL_MM * (2 * (deep_mm + WALL_MM) + wide_mm))
        return self.level_mm - displaced_mm2 / self.width_mm

    @property
    def frequencies_hz(self) -> list[float]:
        """Frequencies in equal ratios, to three digits."""
        ratio = (self.highest_hz / self.lowest_hz) ** (1 / (self.settings - 1))
        inner = [float(f"{self.lowest_hz * ratio**i:.3g}") for i in range(1, self.settings - 1)]
        return [self.lowest_hz, *inner, self.highest_hz]

    def stage(self, frequency_hz: float) -> VibrationStage:
        """The vibration at a frequency."""
        amplitudes: dict[str, dict[str, Any]] = {
            "acceleration": {"acceleration_g": self.acceleration_g},
            "velocity": {"velocity_m_s": self.velocity_mm_s / 1e3},
            "displacement": {"displacement_m": self.amplitude_mm / 1e3},
            "unbalance": {
                "unbalance": Unbalance(
                    moment_kg_m=self.moment_kg_m,
                    moving_mass_kg=self.moving_mass_kg,
                    mount_frequency_hz=self.mount_frequency_hz,
                    flask_depth_m=self.flask_depth_mm / 1e3,
                )
            },
        }
        return VibrationStage(
            hold=self.hold,
            frequency_hz=frequency_hz,
            direction=self.direction,
            **amplitudes[self.hold],
        )

    @property
    def borne(self) -> list[VibrationStage]:
        """The settings that the table bears."""
        stages = [self.stage(frequency_hz) for frequency_hz in self.frequencies_hz]
        return [s for s in stages if self.most_g is None or s.peak_acceleration_g <= self.most_g]


_OF_HOLD = {
    "acceleration": ("acceleration_g",),
    "velocity": ("velocity_mm_s",),
    "displacement": ("amplitude_mm",),
    "unbalance": ("moment_kg_m", "moving_mass_kg", "mount_frequency_hz", "flask_depth_mm"),
}
_OF_CAVITY = ("opening_mm", "cavity_depth_mm", "hole_height_mm")


def applies(name: str, hold: str, cavity: str) -> bool:
    """Whether a question is asked after the answers to what is held and which cavity.

    Parameters
    ----------
    name : str
        A field of ``NewStudy``.
    hold, cavity : str
    """
    if name == "engine" and hold == "unbalance":
        return False  # a table on mounts moves on the reference engine alone
    of_others = {n for held, names in _OF_HOLD.items() if held != hold for n in names}
    return name not in of_others and (cavity != "none" or name not in _OF_CAVITY)


_UNITS = {
    "mm": {"um": 1e-3, "mm": 1.0, "cm": 10.0, "m": 1e3},
    "mm/s": {"mm/s": 1.0, "cm/s": 10.0, "m/s": 1e3},
}


def number_in(text: str, unit: str) -> float:
    """A number in a unit, from a text with or without one, such as ``0.25`` or ``0.00025 m``.

    Parameters
    ----------
    text : str
    unit : str

    Raises
    ------
    ValueError
    """
    found = re.fullmatch(r"\s*([-+0-9.eE]+)\s*([^\d\s].*?)?\s*", text)
    if found is None:
        raise ValueError(text)
    # the last digit that a change of unit leaves is none of the answer's
    factor = 1.0 if found[2] is None else _UNITS.get(unit, {unit: 1.0}).get(found[2])
    if factor is None:
        raise ValueError(text)
    return float(f"{float(found[1]) * factor:.12g}")


def fault(name: str, a: NewStudy) -> str:
    """What is valid where an answer does not go with those before it, or nothing.

    Parameters
    ----------
    name : str
        The answer's question.
    a : NewStudy
        This answer and those before it; defaults after it.
    """
    low_mm, high_mm = a.solid_ends_mm
    if name == "highest_hz" and a.lowest_hz >= a.highest_hz:
        return f"more than the lowest frequency, {a.lowest_hz:g} Hz"
    if name == "most_g" and len(a.borne) < 2:
        peaks = sorted(a.stage(f).peak_acceleration_g for f in a.frequencies_hz)
        return f"at least {peaks[1]:.3g} g, so that two settings are left"
    if name == "cavity_depth_mm":
        room_mm = a.width_mm if a.cavity == "tube" else a.height_mm - WALL_MM
        if a.cavity_depth_mm >= room_mm:
            return f"less than {room_mm:g} mm, so that it lies in the box"
    if name == "opening_mm":
        room_mm = a.height_mm if a.cavity == "tube" else a.width_mm
        if a.opening_mm + 2 * WALL_MM >= room_mm:
            room_mm -= 2 * WALL_MM
            return f"less than {room_mm:g} mm, so that it lies in the box with its walls"
    if name == "hole_height_mm" and (low_mm < 0 or high_mm > a.height_mm):
        least, most = a.middle_mm - low_mm, a.height_mm - (high_mm - a.middle_mm)
        return f"from {least:g} to {most:g} mm, so that hole and walls lie in the box"
    if name == "sand_height_mm":
        if a.level_mm > a.height_mm:
            return f"at most the height of the box, {a.height_mm:g} mm"
        if a.poured_mm <= 0:
            return f"more than {a.level_mm - a.poured_mm:.4g} mm, which the hole's walls take up"
    if name == "material":
        names = sands()
        return "" if a.material in names else f"one of {', '.join(names)}"
    if name == "engine":
        names = engines()
        return "" if a.engine in names else f"one of {', '.join(names)}"
    if name == "size_scale" and a.cavity != "none":
        largest_mm = largest_grain_mm(a.material)
        if largest_mm * a.size_scale >= a.opening_mm:
            most = a.opening_mm / largest_mm
            return f"less than {most:.3g}: the largest grain must be smaller than the hole"
    return ""


def sands() -> list[str]:
    """Names of the sands that a study can use."""
    assert DEFAULT_KIND.material is not None
    return materials(DEFAULT_KIND.material)


def engines() -> list[str]:
    """Names of the engines that compute discs on this machine as a study states them by default."""
    return [n for n in ENGINE_NAMES if engine_problem(Scenario(engine=Engine(name=n))) is None]


def largest_grain_mm(material: str) -> float:
    """Diameter of the largest grains of a sand that is computed at its real size.

    Parameters
    ----------
    material : str
    """
    path = next(p for folder in MATERIALS if (p := folder / f"{material}.yaml").is_file())
    origin = Origin()
    tree = merge({}, read_yaml(path, path.name), origin, path.name)
    sand = validated(Sand, tree.get("sand", {}) | {"size_scale": 1.0}, origin, "sand")
    return 1e3 * sand.classes(2)[-1].diameter_m


def finer_scale(a: NewStudy) -> float | None:
    """The scale at which a hole is five grains wide, or nothing where it is already.

    Parameters
    ----------
    a : NewStudy
    """
    if a.cavity == "none":
        return None
    most = a.opening_mm / largest_grain_mm(a.material) / _LEAST_GRAINS_WIDE
    return None if a.size_scale <= most else int(10 * most) / 10


def remarks(a: NewStudy) -> list[str]:
    """What to know of a study that is written: its settings, and what was not asked.

    Parameters
    ----------
    a : NewStudy
    """
    low_mm, high_mm = a.solid_ends_mm
    lines = ["frequency, Hz   amplitude, mm   velocity, mm/s   acceleration, g"]
    for stage in a.borne:
        omega, size_mm = stage.angular_frequency_rad_s, 1e3 * stage.amplitude_m
        peak_g = stage.peak_acceleration_g
        row = f"{stage.frequency_hz:<15.4g} {size_mm:<15.3g} {size_mm * omega:<16.3g} {peak_g:.3g}"
        idle = peak_g < 1.0 and a.direction == "vertical"
        lines.append(row + ("   moves nothing: below 1 g" if idle else ""))
    if a.hold == "unbalance":
        lines.append("These are of the table without sand.")
    borne = {stage.frequency_hz for stage in a.borne}
    for f in (f for f in a.frequencies_hz if f not in borne):
        peak_g = a.stage(f).peak_acceleration_g
        lines.append(f"Left out: {f:g} Hz, {peak_g:.3g} g; the table bears {a.most_g:g} g.")
    if a.cavity != "none":
        lines.append(
            f"The middle of the hole lies {a.middle_mm:.4g} mm over the floor. Its walls are "
            f"{WALL_MM:g} mm thick and reach from {low_mm:.4g} to {high_mm:.4g} mm."
        )
    lines.append(
        f"The sand comes in 3 layers and stands {a.level_mm:.4g} mm over the floor. Without the "
        f"hole it would stand at {a.poured_mm:.4g} mm: to this height the layers in the file add "
        "up."
    )
    if a.cavity != "none" and a.level_mm < high_mm:
        lines.append("The sand does not cover the hole.")
    if finer := finer_scale(a):
        wide = a.opening_mm / largest_grain_mm(a.material) / a.size_scale
        lines.append(
            f"Warning: the hole is only {wide:.1f} of the largest grains wide, so grains may "
            f"block it. --size-scale {finer:g} makes it five grains wide."
        )
    return lines


def plain(known: Mapping[str, Any]) -> NewStudy:
    """Answers with the defaults of what is not known.

    Parameters
    ----------
    known : mapping

    Raises
    ------
    BadInputError
    """
    return validated(NewStudy, dict(known), Origin())
