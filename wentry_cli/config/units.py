"""Units by the ending of a key, and what a number was probably meant as that is a thousand times too large or small."""

from __future__ import annotations

import re

# ending: unit of the key, a thousandth of it, a thousand of it
UNITS = {
    "_px_per_m": ("px/m", "", "px/mm"),
    "_kg_m3": ("kg/m³", "", "g/cm³"),
    "_m_s2": ("m/s²", "mm/s²", ""),
    "_pa_s": ("Pa s", "mPa s", ""),
    "_n_m": ("N/m", "mN/m", ""),
    "_m_s": ("m/s", "mm/s", ""),
    "_1_s": ("1/s", "", ""),
    "_kg": ("kg", "g", ""),
    "_pa": ("Pa", "", "kPa"),
    "_px": ("px", "", ""),
    "_c": ("°C", "", ""),
    "_m": ("m", "mm", ""),
    "_s": ("s", "ms", ""),
    "fps": ("frames/s", "", ""),
}
# how a unit is called in a sentence; what is not here is called by its sign
NAMES = {"m": "metres", "s": "seconds", "kg": "kilograms"}
# what may stand behind a number in place of the unit of its key, and how much of that unit it is
OTHERS = {
    "px/m": {"px/cm": 100.0, "px/mm": 1000.0},
    "kg/m³": {"kg/m3": 1.0, "kg/m^3": 1.0, "g/cm³": 1000.0, "g/cm3": 1000.0, "g/cm^3": 1000.0, "g/ml": 1000.0},
    "m/s²": {"m/s2": 1.0, "m/s^2": 1.0, "mm/s²": 1e-3, "mm/s2": 1e-3},
    "Pa s": {"Pa·s": 1.0, "mPa s": 1e-3, "mPa·s": 1e-3, "cP": 1e-3},
    "N/m": {"mN/m": 1e-3},
    "m/s": {"mm/s": 1e-3, "cm/s": 1e-2},
    "kg": {"mg": 1e-6, "g": 1e-3},
    "Pa": {"kPa": 1e3, "MPa": 1e6},
    "m": {"µm": 1e-6, "um": 1e-6, "mm": 1e-3, "cm": 1e-2},
    "s": {"µs": 1e-6, "us": 1e-6, "ms": 1e-3},
    "frames/s": {"fps": 1.0, "Hz": 1.0, "1/s": 1.0, "kHz": 1e3},
}
_WITH_COMMA = re.compile(r"[-+]?\d+,\d+")
_WITH_UNIT = re.compile(r"([-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d{1,2})?) ?([^\d\s.,].*)")


def _units_of(key: str) -> tuple[str, str, str]:
    name = key.removesuffix("_unc")
    return next((units for ending, units in UNITS.items() if name.endswith(ending)), ("", "", ""))


def unit_of(key: str) -> str:
    """The unit of ``key`` behind a space; nothing where it has none."""
    unit = _units_of(key)[0]
    return f" {unit}" if unit else ""


def probably_meant(key: str, value: object, *, low: float | None = None, high: float | None = None) -> str:
    """``; 51 mm is 0.051 m``, where ``value`` breaks the bound that is given and a factor of 1000 mends it."""
    unit, thousandth, thousand = _units_of(key)
    if isinstance(value, bool) or not isinstance(value, int | float) or value <= 0:
        return ""
    if high is not None and thousandth and value / 1000 <= high:
        return f"; {value:g} {thousandth} is {value / 1000:g} {unit}"
    if low is not None and thousand and value * 1000 >= low:
        return f"; {value:g} {thousand} is {value * 1000:g} {unit}"
    return ""


def with_a_point(value: object) -> str:
    """``; write 0.040``, where ``value`` is a number with a comma; one that may part thousands is shown both ways."""
    if not isinstance(value, str) or not _WITH_COMMA.fullmatch(value.strip()):
        return ""
    whole, _, share = value.strip().partition(",")
    thousands = f"{whole}{share} or " if len(share) == 3 and whole.lstrip("+-0") else ""
    return f"; write {thousands}{whole}.{share}"


def with_its_unit(key: str, value: object) -> str:
    """`` in metres, as 0.0025,``, where ``value`` is a number with a unit that can be turned into that of ``key``."""
    unit = _units_of(key)[0]
    found = _WITH_UNIT.fullmatch(value.strip()) if isinstance(value, str) else None
    share = {unit: 1.0, **OTHERS.get(unit, {})}.get(found[2]) if found and unit else None
    if found is None or share is None:
        return ""
    return f" in {NAMES.get(unit, unit)}, as {float(found[1].replace(',', '.')) * share:.10g},"
