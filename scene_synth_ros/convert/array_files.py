"""Arrays as the bytes of files: NPY, and NPZ of one array."""

from __future__ import annotations

import io
import zipfile
from typing import Any

import numpy as np
from numpy.typing import NDArray


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
