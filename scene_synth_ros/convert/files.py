"""Files of frames: pictures and depth as PNG, arrays as NPY and NPZ, points and meshes as PLY, JSON."""

import io
import json
import struct
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_synth_ros.dataset import Frame

_LARGEST = 2**16 - 1
_ENDINGS = {"png": "png", "jpeg": "jpg"}
_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_HEADER = struct.Struct(">IIBBBBB")
_GREY, _RGB = 0, 2
_UP = 2
_LEVEL, _WINDOW, _MEMORY = 1, 15, 9
_COLORS = ("uchar red", "uchar green", "uchar blue")
_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])


class DepthFile(NamedTuple):
    """Depth as it is stored: (height, width) uint16, 0 where there is none; how many pixels have a depth that is too large to be stored."""

    stored: NDArray[np.uint16]
    beyond: int


def picture_file(frame: Frame, layer: str, *, jpeg: bool = True) -> tuple[str, bytes] | None:
    """Return a layer of 8 or 16 bits as a file, ending and bytes; None of a layer of floating-point numbers.

    The file of a picture that was recorded as PNG or JPEG is taken as it is; everything else becomes PNG.

    ``jpeg``: whether the format takes JPEG.
    """
    data, form = frame.encoded(layer) or (b"", "")
    if data and (jpeg or form != "jpeg"):
        return _ENDINGS[form], data
    pixels = frame[layer]
    return None if pixels.dtype.kind == "f" else ("png", png_bytes(pixels))


def write_picture(frame: Frame, layer: str, base: Path, *, jpeg: bool = True) -> str:
    """Write the picture of a frame, uint8 (height, width, 3); return the file's name, that of ``base`` with its ending.

    ``base``: file without its ending.
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

    ``depth_m``: (height, width) float32, metres along the optical axis.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        steps = np.rint(depth_m * np.float32(steps_a_metre))
        there = np.isfinite(depth_m) & (steps >= 1.0)
        fits = there & (steps <= _LARGEST)
    return DepthFile(np.where(fits, steps, 0.0).astype(np.uint16), int(there.sum() - fits.sum()))


def write_depth(path: Path, depth_m: NDArray[np.float32], steps_a_metre: float) -> int:
    """Write depth (height, width) float32, metres along the optical axis, in whole steps; return how many pixels are too far away."""
    depth = depth_steps(depth_m, steps_a_metre)
    write_png(path, depth.stored)
    return depth.beyond


def beyond_note(form: str, pixels: int, steps_a_metre: float) -> tuple[str, ...]:
    """Return the line for people about pixels whose depth was too large; none where there are none."""
    if not pixels:
        return ()
    return (f"{form}: {pixels} pixels lie beyond {_LARGEST / steps_a_metre:.1f} m, the largest depth that it stores; they have none there",)


def png_bytes(pixels: NDArray[np.uint8] | NDArray[np.uint16]) -> bytes:
    """Return an image as a PNG file, made in a hurry: uint8 (height, width) or (height, width, 3), or uint16 (height, width).

    One filter serves all rows in place of a search for the best (https://www.w3.org/TR/png-3/): rows are told as their differences to the
    row above, ``Up``.  Eight bits are then compressed by runs, where longer repetitions are rare in noisy pictures and cost most of the
    time; depth in sixteen bits has them, and keeps zlib's ordinary search at level 1.
    """
    deep = pixels.dtype == np.uint16
    height, width = pixels.shape[:2]
    octets = np.ascontiguousarray(pixels, ">u2" if deep else "u1").view(np.uint8).reshape(height, -1)
    rows = np.empty((height, octets.shape[1] + 1), np.uint8)
    rows[:, 0] = _UP
    rows[0, 1:] = octets[0]
    np.subtract(octets[1:], octets[:-1], out=rows[1:, 1:])
    packer = zlib.compressobj(_LEVEL, zlib.DEFLATED, _WINDOW, _MEMORY, zlib.Z_DEFAULT_STRATEGY if deep else zlib.Z_RLE)
    header = _HEADER.pack(width, height, 16 if deep else 8, _GREY if pixels.ndim == 2 else _RGB, 0, 0, 0)
    return _SIGNATURE + _chunk(b"IHDR", header) + _chunk(b"IDAT", packer.compress(rows.data) + packer.flush()) + _chunk(b"IEND", b"")


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(data, zlib.crc32(kind)))


def write_json(path: Path, document: Mapping[str, Any], indent: int | None = 1) -> None:
    """Write a JSON document that people may look at, a line at its end; ``indent`` None writes it on one line without an end."""
    path.write_text(json.dumps(document, indent=indent) + ("" if indent is None else "\n"), encoding="utf-8")


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


def ply_points(points: NDArray[np.float64], colors: NDArray[np.uint8]) -> bytes:
    """Return points (n, 3) with colours (n, 3) uint8."""
    rows = np.zeros(len(points), np.dtype([("place", "<f4", 3), ("color", "u1", 3)]))
    rows["place"], rows["color"] = points, colors
    properties = [*(f"float {name}" for name in "xyz"), *_COLORS]
    return _header(len(points), properties) + rows.tobytes()


def ply_mesh(vertices: NDArray[np.float32], normals: NDArray[np.float32], colors: NDArray[np.uint8], faces: NDArray[np.uint32]) -> bytes:
    """Return a mesh: vertices (n, 3), unit normals (n, 3), colours (n, 3) uint8, faces (m, 3) counter-clockwise from outside."""
    rows = np.zeros(len(vertices), np.dtype([("place", "<f4", 3), ("normal", "<f4", 3), ("color", "u1", 3)]))
    rows["place"], rows["normal"], rows["color"] = vertices, normals, colors
    corners = np.zeros(len(faces), _FACE)
    corners["count"], corners["corners"] = 3, faces
    properties = [*(f"float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")), *_COLORS]
    return _header(len(vertices), properties, len(faces)) + rows.tobytes() + corners.tobytes()


def _header(vertices: int, properties: list[str], faces: int | None = None) -> bytes:
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {vertices}", *(f"property {item}" for item in properties)]
    if faces is not None:
        lines += [f"element face {faces}", "property list uchar int vertex_indices"]
    return ("\n".join([*lines, "end_header"]) + "\n").encode()
