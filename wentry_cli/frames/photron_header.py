"""The header of a Photron recording: ``.cihx`` (XML) or the older ``.cih`` (lines of ``key : value``).

A header is data from a stranger: its size is bounded, entities and document types are refused, every number has a
range, and nothing is allocated from what it claims.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from xml.parsers import expat

from wentry_cli.errors import InputError
from wentry_cli.frames.reader import RATE_UNKNOWN

LARGEST_HEADER_BYTES = 4 << 20
LARGEST_SIDE_PX = 1 << 16
DEEPEST_ELEMENT = 40

# what is read: its key in the text header and its path in the XML header
KEYS = {
    "width": ("Image Width", "imageDataInfo/resolution/width"),
    "height": ("Image Height", "imageDataInfo/resolution/height"),
    "frames": ("Total Frame", "frameInfo/totalFrame"),
    "start": ("Start Frame", "frameInfo/startFrame"),
    "step": ("Save Step", "frameInfo/skipFrame"),
    "bits": ("Color Bit", "imageDataInfo/colorInfo/bit"),
    "depth": ("EffectiveBit Depth", "imageDataInfo/effectiveBit/depth"),
    "side": ("EffectiveBit Side", "imageDataInfo/effectiveBit/side"),
    "format": ("File Format", "imageFileInfo/fileFormat"),
    "colour": ("Color Type", "imageDataInfo/colorInfo/type"),
    "rate": ("Record Rate(fps)", "recordInfo/recordRate"),
    "shutter": ("Shutter Speed(s)", "recordInfo/shutterSpeed"),
    "shutter_ns": ("Shutter Type2(nsec)", "recordInfo/shutterSpeedNsec"),
}


@dataclass(frozen=True)
class PhotronHeader:
    """What a header says of its MRAW file; ``shift`` moves grey levels stored in the upper bits down."""

    path: Path
    width: int
    height: int
    frames: int
    start: int
    step: int
    stored_bits: int
    bit_depth: int
    shift: int
    fps: float | None
    fps_source: str
    exposure_s: float | None
    notes: tuple[str, ...]

    @property
    def frame_bits(self) -> int:
        """Bits of one frame in the MRAW file: frames follow each other without padding."""
        return self.width * self.height * self.stored_bits


def read_photron_header(path: Path, *, stills: bool = False) -> PhotronHeader:
    """Read ``path``, a ``.cihx`` or ``.cih``; InputError where it is unreadable, damaged or not of an MRAW.

    With ``stills`` it may describe image files instead, beside which the camera's software leaves the same header.
    """
    try:
        with path.open("rb") as file:
            raw = file.read(LARGEST_HEADER_BYTES + 1)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    if len(raw) > LARGEST_HEADER_BYTES:
        raise InputError(f"{path}: larger than {LARGEST_HEADER_BYTES} bytes, which no Photron header is")
    xml = path.suffix.lower() == ".cihx"
    values = _xml_values(raw, path) if xml else _text_values(raw)
    found = {name: values[keys[xml]] for name, keys in KEYS.items() if values.get(keys[xml])}
    fields = _Fields(path, xml, found)
    if not stills:
        _check_mraw(fields)
    return _header(fields)


class _Fields:
    """The values found, with a sentence for each way in which one can be wrong."""

    def __init__(self, path: Path, xml: bool, found: dict[str, str]) -> None:
        self.path, self.xml, self.found = path, xml, found

    def word(self, name: str, default: str = "") -> str:
        return self.found.get(name, default).strip().lower()

    def whole(self, name: str, low: int, high: int, default: int | None = None) -> int:
        text = self.found.get(name)
        if text is None:
            if default is not None:
                return default
            raise InputError(f"{self.path}: '{KEYS[name][self.xml]}' is missing; the header is not complete")
        try:
            value = int(text)
        except ValueError:
            value = low - 1
        if not low <= value <= high:
            raise InputError(
                f"{self.path}: '{KEYS[name][self.xml]}' is '{text.strip()[:40]}', "
                f"not a whole number from {low} to {high}; the header is damaged"
            )
        return value

    def number(self, name: str) -> float | None:
        """Return a positive number, '1/50000' allowed; None where it is missing, zero or not a number."""
        over, _, under = self.found.get(name, "0").strip()[:40].partition("/")
        try:
            value = float(over) / float(under or "1")
        except (ValueError, ZeroDivisionError, OverflowError):
            return None
        return value if 1e-12 < value < 1e12 else None


def _check_mraw(fields: _Fields) -> None:
    """Raise InputError unless the header describes an MRAW that can be read."""
    bits = fields.whole("bits", 1, 64)
    file_format = fields.word("format", "mraw")
    if file_format != "mraw":
        raise InputError(
            f"{fields.path}: describes '{file_format}' files, not an MRAW; give the folder or file of images instead"
        )
    colour = fields.word("colour")
    if bits in (24, 36, 48) or colour in ("color", "colour") or "bayer" in colour:
        raise InputError(f"{fields.path}: a colour MRAW ({bits} bit) is not supported; save it as monochrome")
    if bits not in (8, 12, 16):
        raise InputError(f"{fields.path}: an MRAW of {bits} bit is not supported; save it with 8, 12 or 16 bit")


def _header(fields: _Fields) -> PhotronHeader:
    bits = fields.whole("bits", 1, 64)
    depth = min(fields.whole("depth", 1, 64, default=bits), bits)
    side = fields.word("side", "lower")
    if side not in ("lower", "higher"):
        raise InputError(f"{fields.path}: EffectiveBit Side is '{side[:40]}', neither Lower nor Higher")
    step = max(1, fields.whole("step", 0, 1 << 31, default=1))
    rate = fields.number("rate")
    source = "cihx recordRate / skipFrame" if fields.xml else "cih Record Rate(fps) / Save Step"
    return PhotronHeader(
        path=fields.path,
        width=fields.whole("width", 1, LARGEST_SIDE_PX),
        height=fields.whole("height", 1, LARGEST_SIDE_PX),
        frames=fields.whole("frames", 1, 1 << 31),
        start=fields.whole("start", -(1 << 40), 1 << 40, default=0),
        step=step,
        stored_bits=bits,
        bit_depth=depth,
        shift=bits - depth if side == "higher" else 0,
        fps=rate / step if rate else None,
        fps_source=source if rate else RATE_UNKNOWN,
        exposure_s=_exposure_s(fields),
        notes=(f"one frame in {step} of the camera was saved",) if step > 1 else (),
    )


def _exposure_s(fields: _Fields) -> float | None:
    nanoseconds = fields.number("shutter_ns")
    if nanoseconds:
        return nanoseconds * 1e-9
    shutter = fields.number("shutter")
    if not shutter:
        return None
    return 1.0 / shutter if shutter >= 1.0 else shutter  # '50000' means 1/50000 s, '1/50000' and '2e-05' are times


def _text_values(raw: bytes) -> dict[str, str]:
    """Return the first value of each ``key : value`` line; a resaved header repeats its blocks below."""
    values: dict[str, str] = {}
    for line in raw.decode("utf-8", errors="replace").splitlines():
        key, separator, value = line.partition(":")
        if separator:
            values.setdefault(key.strip(), value.strip())
    return values


def _xml_values(raw: bytes, path: Path) -> dict[str, str]:
    """Return the text of each element under ``<cih>``, keyed by its path; the bytes around the XML are no XML."""
    if b"<!DOCTYPE" in raw or b"<!ENTITY" in raw:
        raise InputError(f"{path}: declares a document type or entities, which no Photron header does; refused")
    begin, end = raw.find(b"<cih>"), raw.rfind(b"</cih>")
    if begin < 0 or end < begin:
        raise InputError(f"{path}: no complete <cih> … </cih> block; the header is cut off or of another kind")
    text = raw[begin : end + len(b"</cih>")].decode("utf-8", errors="replace")
    collector = _Collector()
    parser = expat.ParserCreate("utf-8")
    parser.StartElementHandler = collector.start
    parser.EndElementHandler = collector.end
    parser.CharacterDataHandler = collector.text
    try:
        parser.Parse(text.encode(), True)
    except (expat.ExpatError, _TooDeepError) as error:
        raise InputError(f"{path}: the header is not well-formed XML ({error})") from error
    return collector.values


class _TooDeepError(Exception):
    pass


class _Collector:
    """Text of elements by path; the first of equal paths wins."""

    def __init__(self) -> None:
        self.values: dict[str, str] = {}
        self._names: list[str] = []
        self._text: list[str] = []

    def start(self, name: str, _attributes: dict[str, str]) -> None:
        if len(self._names) >= DEEPEST_ELEMENT:
            raise _TooDeepError(f"elements nested deeper than {DEEPEST_ELEMENT}")
        self._names.append(name)
        self._text.clear()

    def text(self, data: str) -> None:
        self._text.append(data)

    def end(self, _name: str) -> None:
        self.values.setdefault("/".join(self._names[1:]), "".join(self._text).strip())
        self._names.pop()
        self._text.clear()
