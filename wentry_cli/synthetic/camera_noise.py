"""From light to grey levels: uneven light, shot and read noise, quantisation, hot pixels."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from wentry_cli.compiled import compiled


@dataclass(frozen=True)
class Sensor:
    """Noise and depth of a camera.

    ``noise`` is the standard deviation of the noise on the bright ground as a fraction of its level; ``shot_share``
    of its variance grows with the light (shot noise), the rest is there in the dark (read noise).
    """

    bits: int = 8
    level: float = 0.75
    noise: float = 0.01
    shot_share: float = 0.6

    @property
    def white(self) -> int:
        """The greatest grey level."""
        return int(2**self.bits - 1)


@cache
def _normal_deviates() -> NDArray[np.float32]:
    """The deviates of a normal distribution that 65536 equal shares of it have in their middle, of unit variance.

    Two random bytes choose one of them, in much less time than numpy draws one. The greatest is 4.3; of a million
    pixels a dozen would have more.
    """
    deviates = ndtri((np.arange(65_536) + 0.5) / 65_536)
    return np.asarray(deviates / np.std(deviates), np.float32)


@compiled
def _expose(transmission, light, noise, read_variance, shot_variance, white, out):  # type: ignore[no-untyped-def]
    rows, columns = transmission.shape
    deviates, chosen = noise
    for r in range(rows):
        for c in range(columns):
            signal = transmission[r, c] * light[r, c]
            variance = read_variance + shot_variance * max(signal, 0.0)
            value = signal + np.sqrt(variance) * deviates[chosen[r, c]] + 0.5
            out[r, c] = int(min(max(value, 0.0), white))


def make_light(
    shape: tuple[int, int], level: float, gradient: tuple[float, float], vignette: float
) -> NDArray[np.float32]:
    """Diffuse, uneven light: a linear gradient (fractions across the frame), a fall towards the corners, slow waves."""
    rows, columns = shape
    y = (np.arange(rows)[:, None] - 0.5 * (rows - 1)) / rows
    x = (np.arange(columns)[None, :] - 0.5 * (columns - 1)) / columns
    light = 1.0 + gradient[0] * x + gradient[1] * y - 2.0 * vignette * (x * x + y * y)
    light += 0.1 * vignette * np.cos(7.0 * x + 1.0) * np.cos(5.0 * y - 0.5)
    return np.asarray(level * light, np.float32)


def expose_frame(
    transmission: NDArray[np.float32], light: NDArray[np.float32], sensor: Sensor, rng: np.random.Generator
) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """Grey levels of a frame; ``light`` is in grey levels. uint8 for 8 bits, else uint16 with ``bits`` significant."""
    ground = sensor.level * sensor.white
    variance = (sensor.noise * ground) ** 2
    out = np.empty(transmission.shape, np.uint8 if sensor.bits == 8 else np.uint16)
    chosen = np.frombuffer(rng.bytes(2 * out.size), "<u2").reshape(out.shape)
    shot = np.float32(sensor.shot_share * variance / ground)
    read = np.float32((1.0 - sensor.shot_share) * variance)
    _expose(transmission, light, (_normal_deviates(), chosen), read, shot, np.float32(sensor.white), out)
    return out
