"""OpenEXR files, read and written through the library's own binding ``OpenEXR`` (BSD-3-Clause), the extra ``exr``.

The only file that imports it.
"""

import importlib.util
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.core.errors import MeshFileError, RenderError

_HINT = "install scene_synth_ros[exr]"
_COLOR = ("R", "G", "B")


@cache
def is_installed() -> bool:
    """Return whether EXR files can be read and written."""
    return importlib.util.find_spec("OpenEXR") is not None


def write_exr(path: Path, channels: Mapping[str, NDArray[Any]]) -> None:
    """Write one part of scan lines, compressed losslessly (ZIP).

    ``channels``: name -> image (height, width), float32 or uint32; layers by name, as in ``normals.X``.

    Raises:
        RenderError: the library is missing or failed.
    """
    library = _library()
    images = {name: np.ascontiguousarray(image) for name, image in channels.items()}
    try:
        header = {"compression": library.ZIP_COMPRESSION, "type": library.scanlineimage}
        library.File(header, images).write(str(path))
    except Exception as error:  # the binding raises what it likes
        raise RenderError(f"{path}: expected an EXR file to be written, got {type(error).__name__}: {error}") from None


def read_exr_color(path: Path, max_width: int, max_height: int) -> NDArray[np.float32]:
    """Return the channels R, G and B of a file (height, width, 3); one channel Y stands for all three.

    Raises:
        MeshFileError: the file is broken or too large, or has neither.
        RenderError: the library is missing.
    """
    library = _library()
    try:
        low, high = library.File(str(path), header_only=True).header()["dataWindow"]
        width, height = int(high[0]) - int(low[0]) + 1, int(high[1]) - int(low[1]) + 1
    except Exception as error:  # broken headers fail in many ways
        raise MeshFileError(f"{path.name}: expected an EXR image, got a header that does not read ({type(error).__name__})") from None
    if not (0 < width <= max_width and 0 < height <= max_height):
        raise MeshFileError(f"{path.name}: expected at most {max_width} x {max_height} pixels, got {width} x {height}")
    try:
        found = library.File(str(path), separate_channels=True).channels()
        planes = {name: np.asarray(channel.pixels) for name, channel in found.items()}
    except Exception as error:  # broken data fails in many ways
        raise MeshFileError(f"{path.name}: expected an EXR image that decodes, got {type(error).__name__}") from None
    chosen = ("Y",) * 3 if "Y" in planes else _COLOR
    if any(name not in planes or planes[name].shape != (height, width) for name in chosen):
        raise MeshFileError(f"{path.name}: expected channels R, G and B of one size, got {', '.join(sorted(planes)) or 'none'}")
    return np.stack([planes[name].astype(np.float32) for name in chosen], axis=-1)


def _library() -> Any:
    try:
        import OpenEXR
    except (ImportError, OSError) as error:
        raise RenderError(f"EXR: expected the library OpenEXR to load, got {error}; {_HINT}") from error
    return OpenEXR
