"""Units by the ending of a key, and what a number was probably meant as that is a thousand times too large or small."""

from __future__ import annotations

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
