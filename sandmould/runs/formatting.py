"""Names and numbers as a person reads them: units from key suffixes, settings, times, sizes."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from numbers import Real
from typing import Any, TypeGuard

from sandmould.digest import digest

# Longest first: _m_s2 must be found before _m_s, and both before _s.
_UNITS = (
    ("_w_m2_k", "W/m²/K"), ("_w_m_k", "W/m/K"), ("_j_kg_k", "J/kg/K"), ("_j_kg", "J/kg"),
    ("_kg_m3", "kg/m³"), ("_n_m3", "N/m³"), ("_m_s2", "m/s²"), ("_m2_s", "m²/s"),
    ("_m2k_w", "m² K/W"), ("_rad_s", "rad/s"), ("_m_s", "m/s"), ("_n_m", "N/m"),
    ("_kg_m", "kg m"), ("_kg_s", "kg/s"),
    ("_mm", "mm"), ("_um", "µm"), ("_ms", "ms"), ("_kpa", "kPa"), ("_rpm", "rpm"),
    ("_per_s", "1/s"), ("_fraction", ""), ("_bytes", "bytes"), ("_mb", "MB"), ("_deg", "°"),
    ("_hz", "Hz"), ("_pa", "Pa"), ("_kg", "kg"), ("_m3", "m³"), ("_m2", "m²"), ("_g", "g"),
    ("_m", "m"), ("_s", "s"), ("_h", "h"), ("_n", "N"), ("_j", "J"), ("_k", "K"),
)  # fmt: skip
_NAMES = {
    "engine.name": "engine",
    "background_damping.form": "background damping",
    "dt_max_s": "largest step",
    "source_share": "c_poi",
    "coordination": "coordination number",
    "coordination_bearing": "coordination of bearing grains",
    "rolling_arm_fraction": "rolling arm",
    "solid_fraction": "solid fraction",
    "part_solidification_time_s": "solidification time of the part",
    "cut_off_fraction": "share of the part that is cut off from the risers",
    "low_niyama_fraction": "share of the part below Niyama's limit",
    "bed_height_m": "bed height",
    "low_m": "lower corner",
    "high_m": "upper corner",
    "displacement_m": "amplitude",
    "drive_displacement_m": "amplitude of the box",
    "drive_velocity_m_s": "velocity of the box",
    "drive_acceleration_g": "acceleration of the box",
    "overlap_p99_fraction": "overlap that 99 of 100 contacts do not exceed",
    "pattern_tip_deflection_m": "deflection of the pattern's tip",
    "pattern_tip_filled_m": "deflection of the pattern's tip after filling",
    "pattern_tip_recovered_m": "deflection given back by vibration",
    "pattern_tip_answered_m": "deflection of the pattern's tip at rest under its mean load",
    "pattern_largest_displacement_m": "largest displacement of the pattern",
    "pattern_distance_largest_m": "largest distance of the pattern from its drawing",
    "pattern_distance_rms_m": "RMS distance of the pattern from its drawing",
    "pattern_outside_tolerance_fraction": "share of the pattern's surface beyond its tolerance",
    "pattern_pressure_above_pa": "pressure on what faces up of the pattern",
    "pattern_pressure_below_pa": "pressure on what faces down of the pattern",
    "pattern_von_mises_largest_pa": "largest von Mises stress of the pattern",
    "pattern_compression_largest_pa": "largest compression of the pattern",
    "pattern_crushed_fraction": "share of the foam that is crushed",
    "pattern_support_x_n": "force of the supports on the pattern along x",
    "pattern_support_y_n": "force of the supports on the pattern along y",
    "pattern_support_z_n": "force of the supports on the pattern along z",
    "pattern_work_j": "work of the sand on the pattern",
    "pattern_energy_j": "energy in the pattern",
    "pattern_stored_fraction": "energy in the pattern over the work of the sand on it",
    "pattern_frequency_fraction": "first frequency of the pattern over its own",
    "pattern_outside_fraction": "share of the wall time that the pattern took",
    "pattern_loop_error_fraction": "error of the loop between sand and pattern",
    "pattern_residual_fraction": "residual of the loop over the displacement",
    "pattern_under_fraction": "sand in the space under the pattern",
    "apparent_density_raw_kg_m3": "apparent density by the printed formula, Rojek 2004, eq. (55)",
    "apparent_density_corrected_kg_m3": "apparent density, corrected for walls",
}

_OF_THING = {
    "_window_sd_pa": "deviation of short means of the pressure at",
    "_sd_pa": "deviation of the pressure at",
    "_mean_pa": "mean pressure at",
    "_error_pa": "error of the mean pressure at",
    "_filled_depth_m": "filled depth of the",
    "_void_fraction": "share of voids in the",
    "_largest_void_m2": "largest void in the",
    "_largest_void_m3": "largest void in the",
    "_voids": "number of voids in the",
}
"""Measures at a probe of a flow, and of a cavity."""
_SHOWN = {"m": (1e3, "mm"), "m²": (1e6, "mm²"), "m³": (1e6, "cm³")}
_PREFIXES = ((1e9, 1e9, "G"), (1e6, 1e6, "M"), (1e4, 1e3, "k"))
"""From which value on, the factor and its letter."""
_PREFIXED = ("Pa", "N/m")
"""Units in which moduli and stiffnesses of millions are common."""


_LONGEST_LIST, _MOST_KINDS = 40, 3
"""Letters of a list that is written out."""
_MOST_PLACES = 6
"""After the point, beyond which a small number is shown with an exponent."""
_ONE_NUMBER = 1e-9
"""Numbers that differ by less, as a share, are one: round-off of a unit."""


_PLACE = re.compile(r"(\.\d+)+$")
"""Of a number in a list."""
_AXES = "xyz"
FILL, OF_BED = "_fill_fraction", "_fill_of_bed_fraction"
"""Ends of the measures of a filled space: over its own space, and over what fits."""


def filled_space(measure: str) -> str:
    """Name of the tube or cavity whose fill a measure is; the measure itself for others."""
    return measure.removesuffix(OF_BED).removesuffix(FILL)


def unit_of(key: str) -> str:
    """Unit that a key's suffix states; empty for a pure number."""
    of_list = _PLACE.sub("", key)
    for name in (of_list, of_list.rpartition(".")[0]):  # of the section, as initial_k.casting
        for suffix, unit in _UNITS:
            if name.endswith(suffix):
                return unit
    return ""


def name_of(key: str) -> str:
    """Last part of a key path in words, without its unit.

    Examples
    --------
    >>> name_of("vibration.0.frequency_hz")
    'frequency'
    >>> name_of("shapes.1.high_m.2")
    'upper corner z'
    """
    head, _, last = key.rpartition(".")
    if head and last.isdigit():
        is_axis = int(last) < len(_AXES) and unit_of(head) == "m"
        return f"{name_of(head)} {_AXES[int(last)] if is_axis else last}"
    if key in _NAMES or last in _NAMES:
        return _NAMES.get(key) or _NAMES[last]
    if (space := filled_space(last)) != last:
        share = " as a share of what fits" if last.endswith(OF_BED) else ""
        return f"fill of the {space.replace('_', ' ')}{share}"
    for ending, what in _OF_THING.items():
        if last.endswith(ending):
            return f"{what} {last.removesuffix(ending).replace('_', ' ')}"
    suffix = next((s for s, _ in _UNITS if last.endswith(s)), "")
    if suffix == "_fraction":
        suffix = ""
    return last.removesuffix(suffix).replace("_", " ")


def titled(key: str) -> str:
    """Name with its unit, as an axis or a table shows it."""
    unit = unit_of(key)
    return f"{name_of(key)}, {unit}" if unit else name_of(key)


def opened(text: str) -> str:
    """A text that begins a sentence: the first letter is large, units stay as they are."""
    return text[:1].upper() + text[1:]


def number(value: Any, digits: int = 3) -> str:
    """A number with so many significant digits, without an exponent where it can be helped."""
    try:
        x = float(value)
    except (TypeError, ValueError):
        return str(value)
    if not math.isfinite(x):
        return "–"
    if x == 0:
        return "0"
    size = math.floor(math.log10(float(f"{abs(x):.{digits - 1}e}")))
    if not -4 <= size < 7:
        return f"{x:.{digits - 1}e}".replace("-", "−")
    places = max(0, digits - 1 - size)
    text = f"{x:,.{places}f}".replace(",", "\u202f").replace("-", "−")
    return text.rstrip("0").rstrip(".") if "." in text and float(x).is_integer() else text


def as_given(value: float) -> str:
    """A number that a person wrote, such as a target: without zeros that he did not write."""
    digits, exponent, power = number(value, 6).partition("e")
    return (digits.rstrip("0").rstrip(".") if "." in digits else digits) + exponent + power


def rounded(value: float) -> float:
    """Three significant digits of a value, for a text that shows more than it knows."""
    return float(f"{value:.3g}")


def with_margin(mean: float, half_width: float) -> str:
    """A mean with its half width, both to the second digit of the half width."""
    if not math.isfinite(half_width) or half_width <= _ONE_NUMBER * abs(mean):
        return number(mean)
    return " ± ".join(_as_exact((mean, half_width), half_width))


def _as_exact(values: Sequence[float], width: float) -> list[str]:
    """Numbers to the second digit of a width, with an exponent where that is very small."""
    if width <= _ONE_NUMBER * max(map(abs, values)):
        return [number(x) for x in values]
    places = max(0, 1 - math.floor(math.log10(width))) if width > 0.0 else 3
    shown = (number(x, 2) if places > _MOST_PLACES else f"{x:.{places}f}" for x in values)
    return [text.lstrip("-") if not text.strip("-0.") else text.replace("-", "−") for text in shown]


def shown_unit(key: str) -> tuple[float, str]:
    """Factor by which a measure is shown, and the unit then: lengths in mm, areas in mm²."""
    unit = unit_of(key)
    return _SHOWN.get(unit, (1.0, unit))


def display_scale(key: str) -> tuple[float, str]:
    """Factor by which a measure is shown, and its name with the unit then."""
    factor, unit = shown_unit(key)
    return factor, f"{name_of(key)}, {unit}" if unit else name_of(key)


def display_number(key: str, value: float, digits: int = 3) -> str:
    """A value of a measure with its unit as it is shown."""
    factor, unit = shown_unit(key)
    return f"{number(factor * value, digits)} {unit}".rstrip()


def display_range(key: str, low: float, high: float) -> str:
    """An interval of a measure with its unit as it is shown, to the second digit of its width."""
    factor, unit = shown_unit(key)
    ends = _as_exact((factor * low, factor * high), factor * (high - low))
    return f"{' to '.join(ends)} {unit}".rstrip()


def factor_text(factor: float, low: float, high: float) -> str:
    """How many times as much something is, with its interval; of less, how many times the other."""
    if factor < 1.0:
        factor, low, high = 1.0 / factor, 1.0 / high, 1.0 / low
    times, *ends = (number(float(f"{x:.2g}"), 2) for x in (factor, low, high))
    return f"{times} times as much ({' to '.join(ends)})"


def value_text(key: str, value: Any) -> str:
    """A swept value with its unit."""
    if isinstance(value, float | int) and not isinstance(value, bool):
        factor, unit = _display_unit(key, value)
        shown = value / factor
        text = f"{shown:.6g}"
        if not math.isclose(float(text), shown, rel_tol=_ONE_NUMBER):
            text = f"{shown:.12g}"
    elif (numbers := _numbers(value)) and unit_of(key):
        factor, unit = _display_unit(key, max(numbers, key=abs))
        text = f"({', '.join(f'{x / factor:.6g}' for x in numbers)})"
    else:
        text, unit = _text(value), unit_of(key)
    return f"{text} {unit}" if unit else text


def _numbers(value: Any) -> list[float]:
    """Numbers of a short list, as such or in JSON; none of any other value."""
    with suppress(ValueError):
        value = json.loads(value) if isinstance(value, str) and value[:1] == "[" else value
    is_list = isinstance(value, list | tuple) and len(value) <= len(_AXES)
    return list(value) if is_list and all(map(is_number, value)) else []


def is_number(value: Any) -> TypeGuard[float]:
    """Whether a swept value is a number, of Python or of numpy, and no truth value."""
    return isinstance(value, Real) and not isinstance(value, bool)


def mark(value: Any) -> str:
    """Four letters and digits that stand for a value too long to be written."""
    text = value if isinstance(value, str) else json.dumps(value)
    with suppress(ValueError):
        text = json.dumps(json.loads(text), sort_keys=True)
    return digest(text)[:4]


def _text(value: Any) -> str:
    """A value that is no number: short ones in full, so that no two look alike."""
    text = json.dumps(value) if isinstance(value, list | dict | tuple) else str(value)
    if text[:1] in ("[", "{"):
        said = _sections_text(text)
        shown = said if 0 < len(said) <= _LONGEST_LIST else text
        return shown if len(shown) <= _LONGEST_LIST else f"{_outline(text)} ({mark(text)})"
    return text.lower() if text in ("True", "False") else text.replace("_", " ")


def _sections_text(text: str) -> str:
    """A list of small sections in JSON: ``5 x 10 mm + 20 mm``; empty for any other value."""
    try:
        sections = json.loads(text)
    except ValueError:
        return ""
    if not isinstance(sections, list) or not all(isinstance(each, dict) for each in sections):
        return ""
    values = [value for each in sections for value in each.values()]
    if any(isinstance(value, list | dict) for value in values):
        return ""
    return " + ".join(map(_section_text, sections))


def _outline(text: str) -> str:
    """What a long list has in it: names or kinds of its sections, else how many values."""
    try:
        value = json.loads(text)
    except ValueError:
        return "no."
    sections = value if isinstance(value, list) else [value]
    dicts = [each for each in sections if isinstance(each, dict)]
    kinds = [str(each.get("name") or each.get("kind") or "") for each in dicts]
    if isinstance(value, dict) and not all(kinds):
        stated = {key: each for key, each in value.items() if each not in (None, [], {})}
        return ", ".join(
            f"{name_of(key)} {_stated(key, each)}".rstrip() for key, each in stated.items()
        )
    if not kinds or not all(kinds):
        return f"{len(sections)} values"
    more = len(kinds) - _MOST_KINDS
    return " + ".join(kinds[:_MOST_KINDS]) + (f" + {more} more" if more > 0 else "")


def _stated(key: str, value: Any) -> str:
    """A value within a section; nothing of sections in it."""
    parts = value if isinstance(value, list) else [value]
    return " ".join(value_text(key, part) for part in parts if not isinstance(part, dict | list))


def _section_text(section: Mapping[str, Any]) -> str:
    often = f"{section['repeat']} x " if "repeat" in section else ""
    stated = {k: v for k, v in section.items() if k != "repeat" and v is not None}
    told = (
        value_text(key, value) if unit_of(key) else f"{name_of(key)} {value_text(key, value)}"
        for key, value in stated.items()
    )
    return often + " ".join(told)


def range_text(key: str, low: float, high: float) -> str:
    """Two swept values with one unit, that of the second: ``15 to 24.5 Hz``."""
    factor, _ = _display_unit(key, high)
    return f"{number(low / factor)} to {value_text(key, high)}"


def _display_unit(key: str, value: float) -> tuple[float, str]:
    """What a value is divided by where it is shown, and its unit then."""
    unit = unit_of(key)
    if unit == "m" and 0.0 < abs(value) < 1.0:
        return 1e-3, "mm"
    large = (p for p in _PREFIXES if unit in _PREFIXED and abs(value) >= p[0])
    _, factor, prefix = next(large, (0.0, 1.0, ""))
    return factor, prefix + unit


def setting_text(values: Mapping[str, Any]) -> str:
    """A combination of swept values: ``65 Hz``, or ``frequency 65 Hz, friction 0.8``."""
    if not values:
        return "the one setting"
    if len(values) == 1:
        ((key, value),) = values.items()
        text = value_text(key, value)
        return text if unit_of(key) and is_number(value) else f"{name_of(key)} {text}"
    names = distinct_names(list(values))
    return ", ".join(f"{names[k]} {value_text(k, v)}" for k, v in values.items())


def distinct_names(keys: Sequence[str]) -> dict[str, str]:
    """Names of keys; those with one name get their section's before it."""
    names = {key: name_of(key) for key in keys}
    several = {name for name in names.values() if list(names.values()).count(name) > 1}
    return {
        key: f"{key.rpartition('.')[0].replace('.', ' ').replace('_', ' ')} {name}".strip()
        if name in several
        else name
        for key, name in names.items()
    }


def seconds(value_s: float) -> str:
    """A duration in the unit that suits it."""
    if not math.isfinite(value_s):
        return "–"
    if value_s < 120:
        return f"{number(value_s)} s"
    if value_s < 7200:
        return f"{number(value_s / 60)} min"
    return f"{number(value_s / 3600)} h"


def size(value_bytes: float) -> str:
    """A number of bytes in the unit that suits it."""
    if not math.isfinite(value_bytes):
        return "–"
    return next(
        f"{number(value_bytes / 10**power)} {unit}"
        for power, unit in ((9, "GB"), (6, "MB"), (3, "kB"), (0, "B"))
        if value_bytes >= 10**power or power == 0
    )


def runs_text(count: int) -> str:
    """So many runs."""
    return "1 run" if count == 1 else f"{count} runs"


def with_article(name: str) -> str:
    """A name with its article."""
    return f"an {name}" if name[0] in "aeio" else f"a {name}"


def listed(items: list[str], most: int = 4) -> str:
    """Items as a sentence lists them: ``a, b and c``; of too many the first, and how many more."""
    if len(items) > most:
        items = [*items[: most - 1], f"{len(items) - most + 1} others"]
    if len(items) < 2:
        return "".join(items)
    comma = "; " if any("," in item for item in items) else ", "
    return f"{comma.join(items[:-1])} and {items[-1]}"


def size_text(size_bytes: int) -> str:
    """Write a size as a person would say it."""
    for unit, length in (("GB", 1e9), ("MB", 1e6)):
        if size_bytes >= length:
            return f"{size_bytes / length:.1f} {unit}"
    return f"{size_bytes / 1e3:.0f} kB"
