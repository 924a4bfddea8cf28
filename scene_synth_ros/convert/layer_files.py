"""A layer of a frame as the bytes of a file: pictures as PNG or as the JPEG that was recorded, numbers as NPY, NPZ or TIFF."""

from __future__ import annotations

import io
import zipfile
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from renderer.files.image_io import encode_image

if TYPE_CHECKING:
    from scene_synth_ros.dataset import Frame

_SUFFIX = {"png": "png", "jpeg": "jpg"}


def picture_file(frame: Frame, layer: str) -> tuple[str, bytes] | None:
    """Return suffix and bytes of a layer of 8 or 16 bits; None of a layer of floating-point numbers.

    What the bag holds as PNG or JPEG is taken as it is.
    """
    recorded = frame.encoded(layer)
    if recorded is not None:
        data, form = recorded
        return _SUFFIX[form], data
    pixels = frame[layer]
    return None if pixels.dtype.kind == "f" else ("png", encode_image(pixels, "png"))


def npy_file(pixels: NDArray[Any]) -> bytes:
    """Return an array as an NPY file."""
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, np.ascontiguousarray(pixels), allow_pickle=False)
    return buffer.getvalue()


def npz_file(name: str, pixels: NDArray[Any]) -> bytes:
    """Return an array as an NPZ file under a name, compressed quickly; equal arrays have equal bytes."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        member = zipfile.ZipInfo(f"{name}.npy")
        member.compress_type = zipfile.ZIP_DEFLATED
        archive.writestr(member, npy_file(pixels), compresslevel=1)
    return buffer.getvalue()
