"""Pictures and depth of frames as files."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_synth_ros.convert.png_bytes import png_bytes
from scene_synth_ros.dataset import Frame

_LARGEST = 2**16 - 1
_ENDINGS = {"png": "png", "jpeg": "jpg"}


class DepthFile(NamedTuple):
    """Depth as it is stored: (height, width) uint16, 0 where there is none; how many pixels have a depth that is too large to be stored."""

    stored: NDArray[np.uint16]
    beyond: int


def picture_file(frame: Frame, layer: str, *, jpeg: bool = True) -> tuple[str, bytes] | None:
    """Return a layer of 8 or 16 bits as a file, ending and bytes; None of a layer of floating-point numbers.

    The file of a picture that was recorded as PNG or JPEG is taken as it is; everything else becomes PNG.

    Args:
        frame: has the layer.
        layer: its name.
        jpeg: whether the format takes JPEG.
    """
    data, form = frame.encoded(layer) or (b"", "")
    if data and (jpeg or form != "jpeg"):
        return _ENDINGS[form], data
    pixels = frame[layer]
    return None if pixels.dtype.kind == "f" else ("png", png_bytes(pixels))


def write_picture(frame: Frame, layer: str, base: Path, *, jpeg: bool = True) -> str:
    """Write the picture of a frame, uint8 (height, width, 3); return the file's name, that of ``base`` with its ending.

    Args:
        frame: has the layer.
        layer: of the picture.
        base: file without its ending.
        jpeg: whether the format takes JPEG.
    """
    found = picture_file(frame, layer, jpeg=jpeg)
    assert found is not None
    path = base.with_name(f"{base.name}.{found[0]}")
    path.write_bytes(found[1])
    return path.name


def write_png(path: Path, pixels: NDArray[np.uint8] | NDArray[np.uint16]) -> None:
    """Write a PNG, quickly compressed: uint8 (height, width) or (height, width, 3), or uint16 (height, width)."""
    path.write_bytes(png_bytes(pixels))


def depth_steps(depth_m: NDArray[np.float32], steps_a_metre: float) -> DepthFile:
    """Return depth in whole steps.

    Misses (+inf) and what is invalid (NaN) have none, 0, as has what lies beyond the last step.

    Args:
        depth_m: (height, width) float32, metres along the optical axis.
        steps_a_metre: scale of the format.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        steps = np.rint(depth_m * np.float32(steps_a_metre))
        there = np.isfinite(depth_m) & (steps >= 1.0)
        fits = there & (steps <= _LARGEST)
    return DepthFile(np.where(fits, steps, 0.0).astype(np.uint16), int(there.sum() - fits.sum()))


def beyond_note(form: str, pixels: int, steps_a_metre: float) -> tuple[str, ...]:
    """Return the line for people about pixels whose depth was too large; none where there are none."""
    if not pixels:
        return ()
    return (f"{form}: {pixels} pixels lie beyond {_LARGEST / steps_a_metre:.1f} m, the largest depth that it stores; they have none there",)
