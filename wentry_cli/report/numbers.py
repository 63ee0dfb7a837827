"""Numbers as people read them: a value with its uncertainty, a dash with its reason."""

from __future__ import annotations

import math

DASH = "–"
MINUS = "−"


def with_uncertainty(value: float, uncertainty: float = math.nan, digits: int = 4) -> str:
    """Write ``5.312 ± 0.011``: the uncertainty with two digits, the value as far; without one, ``digits`` digits.

    NaN becomes a dash; a negative number has a true minus sign, as on the axes.
    """
    return true_minus(_with_uncertainty(value, uncertainty, digits))


def fixed(value: float, places: int) -> str:
    """Write a number with ``places`` decimals and a true minus sign; one that rounds to zero has no sign."""
    text = f"{value:.{places}f}"
    return true_minus(text if text.strip("-0.") else text.lstrip("-"))


def true_minus(number: str) -> str:
    """Put the true minus sign into a number that was written with a hyphen."""
    return number.replace("-", MINUS)


def _with_uncertainty(value: float, uncertainty: float, digits: int) -> str:
    if not math.isfinite(value):
        return DASH
    if not (math.isfinite(uncertainty) and uncertainty > 0):
        return _short(value, digits)
    places = 1 - math.floor(math.log10(float(f"{uncertainty:.1e}")))
    if value != 0.0:  # one digit of a value is shown however little is known of it
        places = max(places, min(-math.floor(math.log10(abs(value))), places + 2))
    if not -3 <= places <= 9:
        return f"{value:.{digits}g} ± {_short(float(f'{uncertainty:.1e}'), 2)}"
    if places < 0:
        return f"{round(value, places):.0f} ± {round(uncertainty, places):.0f}"
    return f"{value:.{places}f} ± {uncertainty:.{places}f}"


def _short(value: float, digits: int) -> str:
    text = f"{value:.{digits}g}"
    if "e" not in text:
        return text
    return f"{value:.0f}" if 1.0 <= abs(value) < 1e7 else text


def or_reason(text: str, reason: str) -> str:
    """Add the reason, a word of the tables or a phrase, in brackets to a dash: ``– (clip ended)``."""
    return f"{DASH} ({reason.replace('_', ' ')})" if text == DASH and reason and reason != "ok" else text
