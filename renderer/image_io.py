"""Writes images to files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from renderer.errors import RenderError


def write_png(path: Path, image: NDArray[np.uint8] | NDArray[np.uint16]) -> None:
    """Write a PNG: uint8 (height, width) or (height, width, 3), or uint16 (height, width), losslessly.

    Raises:
        RenderError: the array has another shape or type.
        OSError: the file cannot be written.
    """
    grey = image.ndim == 2 and image.dtype in (np.uint8, np.uint16)
    color = image.ndim == 3 and image.shape[2] == 3 and image.dtype == np.uint8
    if not (grey or color) or image.size == 0:
        raise RenderError(f"{path}: expected uint8 or uint16 (h, w), or uint8 (h, w, 3), got {image.dtype} {image.shape}")
    Image.fromarray(np.ascontiguousarray(image)).save(path, format="PNG")
