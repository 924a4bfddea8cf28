"""Statistics by which pictures are told from photographs; all are of the display's codes, 0 to 255.

Luma is 0.299 R + 0.587 G + 0.114 B (ITU-R BT.601).  Colourfulness: D. Hasler and S. Suesstrunk, "Measuring colourfulness in natural
images", Human Vision and Electronic Imaging VIII (2003).  Contrast: deviation of luma over 255.  Grain: of the twentieth of tiles that are
flattest, the deviation that a plane leaves.  Corners: E. Rosten and T. Drummond, "Machine learning for high-speed corner
detection", ECCV 2006, threshold 20.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

TILE = 16
"""Edge of a tile in pixels."""
FLAT_DEVIATION = 2.0
"""Deviation of luma below which a tile counts as flat."""
FLAT_GRADIENT, EDGE_GRADIENT = 1.0, 12.0
"""Gradient of luma in codes a pixel below which a pixel counts as flat, and above which as an edge."""

_LEAST_POWER = 1e-12
_LUMA = np.array([0.299, 0.587, 0.114])
_PLANE = np.stack(np.meshgrid(np.arange(TILE), np.arange(TILE)), axis=-1).reshape(-1, 2)
_BASIS = np.linalg.qr(np.column_stack([_PLANE, np.ones(TILE * TILE)]).astype(np.float64))[0]


class _Seen(NamedTuple):
    """A picture and what several figures need: luma and its gradient, (h, w) float64, tiles (n, 256)."""

    picture: NDArray[np.uint8]
    luma: NDArray[np.float64]
    gradient: NDArray[np.float64]
    tiles: NDArray[np.float64]


def figures(picture: NDArray[np.uint8]) -> dict[str, float]:
    """Return the figures of a picture (h, w, 3), sRGB, by name."""
    luma = picture.astype(np.float64) @ _LUMA
    gradient = np.hypot(cv2.Sobel(luma, cv2.CV_64F, 1, 0), cv2.Sobel(luma, cv2.CV_64F, 0, 1)) / 8.0
    rows, columns = luma.shape[0] // TILE, luma.shape[1] // TILE
    tiles = luma[: rows * TILE, : columns * TILE].reshape(rows, TILE, columns, TILE).swapaxes(1, 2).reshape(-1, TILE * TILE)
    seen = _Seen(picture, luma, gradient, tiles)
    return {name: float(measure(seen)) for name, measure in FIGURES.items()}


def _colourfulness(seen: _Seen) -> float:
    red, green, blue = np.moveaxis(seen.picture.astype(np.float64), -1, 0)
    across = np.stack([red - green, 0.5 * (red + green) - blue])
    return float(np.linalg.norm(across.std(axis=(1, 2))) + 0.3 * np.linalg.norm(across.mean(axis=(1, 2))))


def _grain(seen: _Seen) -> float:
    left = seen.tiles - seen.tiles @ _BASIS @ _BASIS.T
    deviations = np.sort(np.sqrt((left**2).sum(axis=1) / (TILE * TILE - 3)))
    return float(deviations[: max(len(deviations) // 20, 1)].mean())


def _slope(seen: _Seen) -> float:
    """Return the slope of the radial power spectrum, log over log, from 0.15 to 0.45 cycles a pixel, of the middle square."""
    edge = min(seen.luma.shape)
    top, left = ((length - edge) // 2 for length in seen.luma.shape)
    square = seen.luma[top : top + edge, left : left + edge]
    window = np.hanning(edge)
    power = np.abs(np.fft.fft2((square - square.mean()) * np.outer(window, window))) ** 2
    frequency = np.fft.fftfreq(edge)
    radius = np.rint(np.hypot(frequency[:, None], frequency[None]) * edge).astype(int).ravel()
    radial = np.bincount(radius, power.ravel()) / np.maximum(np.bincount(radius), 1)
    at = np.arange(int(0.15 * edge), int(0.45 * edge))
    return float(np.polyfit(np.log(at), np.log(radial[at] + _LEAST_POWER), 1)[0])


def _corners(seen: _Seen) -> float:
    detector: Any = cv2.FastFeatureDetector_create(20)  # type: ignore[attr-defined]
    return float(len(detector.detect(np.ascontiguousarray(seen.picture[..., ::-1]))))


FIGURES: dict[str, Callable[[_Seen], float]] = {
    **{f"luma, percentile {p}": lambda seen, p=p: np.percentile(seen.luma, p) for p in (1, 5, 50, 95, 99)},  # type: ignore[misc]
    "luma <= 25, %": lambda seen: 100.0 * (seen.luma <= 25.0).mean(),
    "all channels >= 254, %": lambda seen: 100.0 * (seen.picture.min(axis=2) >= 254).mean(),
    "a channel >= 250, %": lambda seen: 100.0 * (seen.picture.max(axis=2) >= 250).mean(),
    "colourfulness": _colourfulness,
    "contrast": lambda seen: seen.luma.std() / 255.0,
    "grain": _grain,
    "flat tiles, %": lambda seen: 100.0 * (seen.tiles.std(axis=1) < FLAT_DEVIATION).mean(),
    "flat pixels, %": lambda seen: 100.0 * (seen.gradient < FLAT_GRADIENT).mean(),
    "edges, %": lambda seen: 100.0 * (seen.gradient > EDGE_GRADIENT).mean(),
    "corners": _corners,
    "slope of the spectrum": _slope,
}
"""Name -> the figure of a picture."""
