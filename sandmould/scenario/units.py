"""Units that a reader may write where a key states its own, and the number to write instead."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

FACTORS = {
    "m": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "dm": 0.1, "km": 1e3, "um": 1e-6, "nm": 1e-9},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0},
    "h": {"h": 1.0, "min": 1 / 60, "s": 1 / 3600},
    "Hz": {"Hz": 1.0, "kHz": 1e3, "1/s": 1.0, "rpm": 1 / 60, "1/min": 1 / 60},
    "1/s": {"1/s": 1.0, "1/min": 1 / 60},
    "m/s": {"m/s": 1.0, "mm/s": 1e-3, "cm/s": 1e-2, "km/h": 1 / 3.6},
    "m/s2": {"m/s2": 1.0, "mm/s2": 1e-3, "g": 9.80665},
    "g": {"g": 1.0, "m/s2": 1 / 9.80665, "mm/s2": 1e-3 / 9.80665},
    "kg": {"kg": 1.0, "g": 1e-3, "mg": 1e-6, "t": 1e3},
    "kg/m3": {"kg/m3": 1.0, "g/cm3": 1e3, "g/ml": 1e3, "kg/dm3": 1e3, "kg/l": 1e3, "t/m3": 1e3},
    "kg m": {"kg m": 1.0, "kg mm": 1e-3, "kg cm": 1e-2, "g mm": 1e-6},
    "Pa": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "bar": 1e5, "N/mm2": 1e6},
    "N/m": {"N/m": 1.0, "kN/m": 1e3, "N/mm": 1e3, "kN/mm": 1e6, "MN/m": 1e6},
    "deg": {"deg": 1.0, "degrees": 1.0, "°": 1.0, "rad": 57.29577951308232},
}
"""Factor of each unit to that of the key, by the unit of the key."""
CELSIUS = "degC"
"""Taken where a key states kelvin."""
OVER_CELSIUS = f" over {CELSIUS}"
"""After the unit of a curve's values where its temperatures are in degrees C."""
ZERO_K = 273.15
_DEGREES = ("C", "degC", "deg C", "°C", "celsius")
_NUMBER = re.compile(r"\s*([-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?)\s*(\S.*?)\s*$")
_SPELT = str.maketrans({"µ": "u", "μ": "u", "²": "2", "³": "3", "^": None, "*": None, "·": " "})


def in_unit(value: object, stated: object, units: Iterable[str]) -> str:
    """Say which number to write for a value that is stated in another unit of the same kind.

    Such as ``write 0.00015 (m)``; empty where the units do not fit.
    """
    if isinstance(value, bool) or not isinstance(value, int | float):
        return ""
    spelt = str(stated).translate(_SPELT)
    found = ((unit, FACTORS.get(unit, {}).get(spelt)) for unit in units)
    return next((f"write {value * f:.10g} ({unit})" for unit, f in found if f is not None), "")


def number_of(text: str, units: Iterable[str]) -> str:
    """Say which number to write for a text such as ``0.15 mm``, as of ``in_unit``."""
    found = _NUMBER.match(text)
    if not found:
        return ""
    value = float(found[1].replace(",", "."))
    if "K" in units and found[2] in _DEGREES:
        return f"write {{value: {value:g}, unit: {CELSIUS}, source: ...}}"
    return in_unit(value, found[2], units)


def unit_of(unit: str) -> str:
    """The unit that a key must have for a value to be taken in another one."""
    return "K" if unit == CELSIUS else unit.removesuffix(OVER_CELSIUS)


def in_kelvin(value: Any, unit: str) -> Any:
    """A value as it counts: degrees C as kelvin, in a number or in the pairs of a curve."""
    if unit.endswith(OVER_CELSIUS):
        return [[round(place + ZERO_K, 9), of] for place, of in value]
    if unit == CELSIUS and isinstance(value, int | float):
        return round(value + ZERO_K, 9)
    return value
