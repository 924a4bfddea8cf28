"""From linear luminance to display colour: exposure, white balance, local tone mapping, tone curve, sRGB, 8 bits.

The curve ``camera`` is an S in the logarithm, as cameras have it: black b becomes 0, x = max(light - b, 0) / (1 - b), and what is shown is
y = A x^s / (x^s + B) by channel, s = 1.6, with y(0.18) = 0.18 and y(4) = 1 (the response of Naka and Rushton, J. Physiol. 185, 1966).

Response curves of cameras tell which of 256 codes light gets, 1 being the white of the exposure; what is brighter is clipped.  ``rec709``:
the transfer function of ITU-R BT.709 without its footroom.  ``gamma``: a power.  ``table``: brightness at even steps of light, as measured
curves are told, those of the EMoR data base among them (M. D. Grossberg and S. K. Nayar, "Modeling the space of camera response functions",
IEEE PAMI 26, 2004).
"""

import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from renderer.core.color import linear_from_srgb
from renderer.core.kernel import entry
from renderer.film.local_tone import merge_exposures
from renderer.film.white_balance import Chromaticity, adaptation
from scene_description.color_temperature import D65_XY
from scene_description.products import inverse, matmul

FILMIC_KNEE = 0.4
"""Display-linear value up to which the filmic curve is the identity."""
FILMIC_WHITE = 100.0
"""Multiple of the luminance that saturates the plain curve at which the filmic one does."""
CAMERA_GREY, CAMERA_WHITE, CAMERA_STEEPNESS = 0.18, 4.0, 1.6
"""Of the camera's curve: light that is shown as it is, light that is shown as white, and the exponent s."""
MOST_BLACK = 0.016
"""Most light, in multiples of white, that the camera's curve shows as black."""

_CELL_BITS = 15
_FIRST_WORD, _LAST_WORD = (int(np.float32(value).view(np.int32)) for value in (2.0**-14, 2.0**7))


class Exposure(NamedTuple):
    """How luminance is shown.

    ev100: exposure value at ISO 100; white_xy: chromaticity (CIE x, y) of the light that shall look white; black: light that the curve
    ``camera`` shows as black, in multiples of white.
    """

    ev100: float
    white_xy: Chromaticity = D65_XY
    black: float = 0.0


def white_luminance(exposure_ev100: float) -> float:
    """Return the luminance in cd/m2 that saturates a sensor at an exposure value: 1.2 * 2^EV100 (ISO 12232, saturation-based speed)."""
    return 1.2 * float(2.0**exposure_ev100)


def encode_srgb(linear: NDArray[np.float32], curve: str = "srgb", black: float = 0.0) -> NDArray[np.uint8]:
    """Return 8-bit sRGB (IEC 61966-2-1) of linear values; 0 is black, 1 the plain curve's white.

    ``curve``: ``srgb`` clips beyond 1; ``filmic`` is the same up to ``FILMIC_KNEE`` and rolls off from there in the logarithm, so that
    what is brighter keeps its shape up to ``FILMIC_WHITE``; ``camera`` has a toe from ``black`` on and a shoulder up to ``CAMERA_WHITE``.

    By table: each code begins where curve and transfer function, inverted, pass half a code; no power is computed per pixel.
    """
    values = np.ascontiguousarray(linear, np.float32)
    codes = np.empty(values.shape, np.uint8)
    _look_up_codes(values.reshape(-1), values.reshape(-1).view(np.int32), *_table(curve, black), codes.reshape(-1))
    return codes


def to_display(radiance: NDArray[np.float32], exposure: Exposure, curve: str = "srgb", local_stops: float = 0.0) -> NDArray[np.uint8]:
    """Return what a camera shows of luminance (height, width, 3) in cd/m2: sRGB, uint8.

    ``local_stops``: of local tone mapping, as :func:`renderer.film.local_tone.merge_exposures` has it; 0 for none.
    """
    light = balance(radiance, exposure)
    return encode_srgb(merge_exposures(light, local_stops) if local_stops else light, curve, exposure.black)


def from_display(codes: NDArray[np.uint8], exposure: Exposure, curve: str = "srgb") -> NDArray[np.float32]:
    """Return the luminance (height, width, 3) in cd/m2 that codes show, each the middle of its code.

    Code 0 stands for the black of the exposure, 255 for the least that is shown as white; local tone mapping and grain stay in it.
    """
    light = _light_of(curve, linear_from_srgb(np.arange(256) / 255.0), exposure.black)
    balanced = light[codes].astype(np.float64) * white_luminance(exposure.ev100)
    return np.asarray(matmul(balanced, inverse(adaptation(exposure.white_xy)).T), np.float32)


def balance(radiance: NDArray[np.float32], exposure: Exposure) -> NDArray[np.float32]:
    """Return luminance (height, width, 3) in cd/m2 in multiples of the exposure's white, with white balance."""
    scale = np.float32(1.0 / white_luminance(exposure.ev100))
    if tuple(exposure.white_xy) == D65_XY:
        return radiance * scale
    matrix = (adaptation(exposure.white_xy) * scale).astype(np.float32)
    balanced = np.empty(radiance.shape, np.float32)
    _balance(np.ascontiguousarray(radiance).reshape(-1, 3), matrix, balanced.reshape(-1, 3))
    return balanced


@entry
def _look_up_codes(
    values: NDArray[np.float32],
    words: NDArray[np.int32],
    first_codes: NDArray[np.uint8],
    thresholds: NDArray[np.float32],
    codes: NDArray[np.uint8],
) -> None:
    """Write how many thresholds each value reaches; ``words``: the values' bits, which order as they do from 0 on.

    A value's cell, its exponent and leading bits, tells the code up to one.
    """
    for i in range(len(values)):
        word = max(_FIRST_WORD, min(_LAST_WORD, words[i]))
        code = np.int32(first_codes[(word - _FIRST_WORD) >> _CELL_BITS])
        codes[i] = code + (1 if code < 255 and values[i] >= thresholds[code] else 0)


@entry
def _balance(radiance: NDArray[np.float32], matrix: NDArray[np.float32], balanced: NDArray[np.float32]) -> None:
    """Multiply each colour by the matrix, in an order that is the same on every processor."""
    for i in range(len(radiance)):
        r, g, b = radiance[i, 0], radiance[i, 1], radiance[i, 2]
        for c in range(3):
            balanced[i, c] = matrix[c, 0] * r + matrix[c, 1] * g + matrix[c, 2] * b


def filmic(linear: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the filmic curve: x up to the knee k, then k + c ln(1 + (x - k) / c), so that it is smooth and 1 at ``FILMIC_WHITE``."""
    over = np.maximum(np.asarray(linear, np.float64) - FILMIC_KNEE, 0.0)
    return np.asarray(np.minimum(linear, FILMIC_KNEE) + _SHOULDER * el.log1p(over / _SHOULDER))


def _fit_shoulder() -> float:
    """Return c with c ln(1 + (white - k) / c) = 1 - k, by bisection; the left side grows with c."""
    low, high = 1e-6, 1.0 - FILMIC_KNEE
    for _ in range(200):
        middle = 0.5 * (low + high)
        if middle * math.log1p((FILMIC_WHITE - FILMIC_KNEE) / middle) < 1.0 - FILMIC_KNEE:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def camera_curve(light: NDArray[np.floating], black: float = 0.0) -> NDArray[np.float64]:
    """Return the camera's curve: 0 up to ``black``, 0.18 at 0.18 where black is 0, 1 at ``CAMERA_WHITE``, and further up beyond."""
    power = el.power(np.maximum(np.asarray(light, np.float64) - black, 0.0) / (1.0 - black), CAMERA_STEEPNESS)
    return np.asarray(_CAMERA_GAIN * power / (power + _CAMERA_HALF))


def _fit_camera() -> tuple[float, float]:
    """Return A and B of the camera's curve: y(grey) = grey and y(white) = 1 are linear in both."""
    grey, white = (math.pow(light, CAMERA_STEEPNESS) for light in (CAMERA_GREY, CAMERA_WHITE))
    half = grey * (1.0 - CAMERA_GREY) / (CAMERA_GREY - grey / white)
    return 1.0 + half / white, half


def _unfilm(shown: NDArray[np.float64], black: float) -> NDArray[np.float64]:
    del black
    over = np.maximum(shown - FILMIC_KNEE, 0.0)
    return np.asarray(np.minimum(shown, FILMIC_KNEE) + _SHOULDER * el.expm1(over / _SHOULDER))


def _unphotograph(shown: NDArray[np.float64], black: float) -> NDArray[np.float64]:
    power = _CAMERA_HALF * shown / (_CAMERA_GAIN - shown)
    return np.asarray(black + (1.0 - black) * el.power(power, 1.0 / CAMERA_STEEPNESS))


_SHOULDER = _fit_shoulder()
_CAMERA_GAIN, _CAMERA_HALF = _fit_camera()
_HALF_CODES = (np.arange(255) + 0.5) / 255.0
_HALF_LIGHT = linear_from_srgb(_HALF_CODES)
_INVERSES: dict[str, Callable[[NDArray[np.float64], float], NDArray[np.float64]]] = {
    "camera": _unphotograph,
    "filmic": _unfilm,
    "srgb": lambda shown, black: shown,
}
"""Name -> what light is shown as linear values in [0, 1], given the black."""


def _light_of(curve: str, shown: NDArray[np.float64], black: float) -> NDArray[np.float32]:
    return np.asarray(_INVERSES[curve](shown, black), np.float32)


@lru_cache(maxsize=64)
def _table(curve: str, black: float) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Return codes of the lowest values of cells, and the thresholds; a cell, 1/256 octave, has one threshold at most."""
    first = _light_of(curve, _HALF_LIGHT, black)
    lowest = np.arange(_FIRST_WORD, _LAST_WORD + 1, 1 << _CELL_BITS, dtype=np.int32).view(np.float32)
    return np.searchsorted(first, lowest, side="right").astype(np.uint8), first


TONE_CURVES = tuple(_INVERSES)
"""Names of the curves."""


def thresholds(response: str, gamma: float, points: Sequence[float]) -> NDArray[np.float32]:
    """Return from which light on each of the codes 1 to 255 is given, (255,): where the curve passes half a code; infinite where never.

    Args:
        response: ``srgb``, ``rec709``, ``gamma`` or ``table``.
        gamma: brightness is light to the power of 1 / gamma.
        points: of the table, at least 2, in [0, 1], none below the one before.
    """
    if response == "table":
        return _where_reached(np.asarray(points, np.float64))
    light = {
        "srgb": _HALF_LIGHT,
        "rec709": np.where(_HALF_CODES < 0.081, _HALF_CODES / 4.5, el.power((_HALF_CODES + 0.099) / 1.099, 1.0 / 0.45)),
        "gamma": el.power(_HALF_CODES, gamma),
    }
    return np.asarray(light[response], np.float32)


def encode(light: NDArray[np.float32], first: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return how many of the thresholds ``first`` (255,) light reaches, pixel by pixel and channel by channel."""
    return np.searchsorted(first, light, side="right").astype(np.uint8)


def _where_reached(points: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return the least light at which a curve, straight between its points, reaches half a code."""
    after = np.searchsorted(points, _HALF_CODES, side="left")
    upper = np.clip(after, 1, len(points) - 1)
    low, high = points[upper - 1], points[upper]
    within = np.divide(_HALF_CODES - low, high - low, out=np.zeros(255), where=high > low)
    light = (upper - 1 + within) / (len(points) - 1)
    return np.where(after == 0, -np.inf, np.where(after == len(points), np.inf, light)).astype(np.float32)
