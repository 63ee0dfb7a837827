"""The kinds of values that a key may have; a bound is one that no laboratory meets."""

from __future__ import annotations

import unicodedata
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field

LONGEST_LABEL = 200
LONGEST_NAME = 255
SLOWEST, FASTEST = 0.01, 1e7  # frames/s
NOT_ON_A_LINE = {"Cc", "Cs", "Zl", "Zp"}  # control, half a surrogate pair, line and paragraph separators
FORMULA = ("=", "+", "-", "@")  # how a formula begins in a spreadsheet


def is_one_line(text: str) -> bool:
    """Whether ``text`` can stand in a line of a message or a table, and in the name of a file."""
    return not any(unicodedata.category(letter) in NOT_ON_A_LINE for letter in text)


def is_formula(text: str) -> bool:
    """Whether a spreadsheet that opens a table would reckon with ``text`` instead of showing it; numbers may be."""
    try:
        float(text)
    except ValueError:
        return text.lstrip().startswith(FORMULA)
    return False


def _one_line(text: str) -> str:
    if not text.strip():
        raise ValueError("must not be empty")
    if not is_one_line(text):
        raise ValueError(f"must be one line of text without control characters, not {text!r:.60}")
    return text


def _name(text: str) -> str:
    if any(len(part.encode("utf-8", "replace")) > LONGEST_NAME for part in text.replace("\\", "/").split("/")):
        raise ValueError(f"must not be longer than the name of a file can be, {LONGEST_NAME} bytes")
    return _one_line(text)


def _label(text: str) -> str:
    if len(text) > LONGEST_LABEL:
        raise ValueError(f"must have at most {LONGEST_LABEL} characters, not {len(text)}")
    if is_formula(text):
        raise ValueError(f"must not begin with {text.lstrip()[0]}, which makes it a formula where tables are opened")
    return _one_line(text)


def _as_text(value: Any) -> Any:
    """Labels such as ``condition: 2`` are text even where they look like numbers."""
    return str(value) if isinstance(value, int | float) and not isinstance(value, bool) else value


def _counted(value: Any) -> Any:
    if (
        isinstance(value, int | float)
        and not isinstance(value, bool)
        and not (value >= 0 and float(value).is_integer())
    ):
        raise ValueError(f"must be text or a whole number from 0, not {value!r}")
    return value


Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[float, Field(strict=True, gt=0, allow_inf_nan=False)]
Uncertainty = Annotated[float, Field(strict=True, ge=0, allow_inf_nan=False)]
Index = Annotated[int, Field(strict=True, ge=0)]
Text = Annotated[str, AfterValidator(_name)]
Label = Annotated[str, BeforeValidator(_as_text), AfterValidator(_label)]
Repeat = Annotated[Label, BeforeValidator(_counted)]

FrameRate = Annotated[float, Field(strict=True, ge=SLOWEST, le=FASTEST, allow_inf_nan=False)]
Row = Annotated[float, Field(strict=True, ge=-20_000, le=20_000, allow_inf_nan=False)]
RowUncertainty = Annotated[float, Field(strict=True, ge=0, le=1000, allow_inf_nan=False)]
Distance = Annotated[float, Field(strict=True, gt=0, le=1000, allow_inf_nan=False)]
Delay = Annotated[float, Field(strict=True, ge=-1000, le=1000, allow_inf_nan=False)]
Exposure = Annotated[float, Field(strict=True, gt=0, le=10, allow_inf_nan=False)]
Height = Annotated[float, Field(strict=True, ge=1e-6, le=1000, allow_inf_nan=False)]
Speed = Annotated[float, Field(strict=True, ge=1e-4, le=1000, allow_inf_nan=False)]
Gravity = Annotated[float, Field(strict=True, ge=1e-6, le=1000, allow_inf_nan=False)]
LiquidDensity = Annotated[float, Field(strict=True, ge=1, le=25_000, allow_inf_nan=False)]
Viscosity = Annotated[float, Field(strict=True, ge=1e-7, le=1e4, allow_inf_nan=False)]
SurfaceTension = Annotated[float, Field(strict=True, ge=1e-6, le=10, allow_inf_nan=False)]
FewestFrames = Annotated[int, Field(strict=True, ge=3, le=1_000_000)]

# by hand, in corrections.yaml
AfterImpact = Annotated[float, Field(strict=True, ge=0, le=1000, allow_inf_nan=False)]
Level = Annotated[float, Field(strict=True, ge=-100, le=100, allow_inf_nan=False)]
LevelUncertainty = Annotated[float, Field(strict=True, ge=1e-8, le=100, allow_inf_nan=False)]
Stretch = Annotated[float, Field(strict=True, ge=0.2, le=5, allow_inf_nan=False)]
StretchUncertainty = Annotated[float, Field(strict=True, ge=1e-7, le=5, allow_inf_nan=False)]
TimeUncertainty = Annotated[float, Field(strict=True, ge=0, le=1, allow_inf_nan=False)]
Which = Annotated[int, Field(strict=True, ge=1, le=1000)]
