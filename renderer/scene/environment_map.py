"""Environment maps of the user: equirectangular pictures of all that is around, Radiance ``.hdr`` (RGBE) or ``.exr``.

RGBE after G. Ward, "Real Pixels" (Graphics Gems II, 1991), run-length coded or plain.  The middle column looks along world +x before the
map is turned, columns go clockwise as seen from above, as in a picture of the horizon seen from inside.  What is brighter than ``BRIGHT``
times the mean is split off, to be sampled by direction (:mod:`renderer.path.infinite_light`).
"""

import math
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.color import LUMINANCE
from renderer.core.equirectangular import pixel_solid_angles
from renderer.core.errors import MeshFileError
from renderer.core.kernel import entry
from renderer.files.exr_files import read_exr_color
from renderer.files.mesh_files import find_mesh_file
from renderer.scene.flat_scene import NO_MAP
from scene_description import read_at_most
from scene_description.products import matmul
from scene_description.types import EnvironmentMap

MAX_WIDTH, MAX_HEIGHT = 8192, 4096
_MAX_BYTES = 8 * MAX_WIDTH * MAX_HEIGHT
MAX_FILE_BYTES = 600_000_000
KEPT_WIDTH = 2048
"""Wider maps are averaged down to it."""
BRIGHT = 4.0
"""Multiple of the mean luminance beyond which light is sampled by direction."""
MOST_CD_M2 = 1e10
"""Brighter pixels are clamped; the sun's disc has 2e9."""

_MOST_FAULTY = 0.01
_MAX_HEADER_LINES = 1000


class MapImages(NamedTuple):
    """``table`` and ``bright`` of ``renderer.scene.flat_scene.Sky``, float32, cd/m2; ``bright`` is empty where nothing stands out."""

    table: NDArray[np.float32]
    bright: NDArray[np.float32]


def load_environment_map(environment: EnvironmentMap, folder: Path) -> MapImages:
    """Read, check, scale, turn and split a map that lies below a folder.

    Numbers below 0 and those that are none become 0, infinite ones the largest finite one, with a warning.

    Raises:
        MeshFileError: the path leaves the folder, the file is broken, too large or of another form, or too much of it is no number.
        RenderError: an EXR file, and the library is missing.
    """
    path = find_mesh_file(folder, environment.file)
    if path.stat().st_size > MAX_FILE_BYTES:
        raise MeshFileError(f"{environment.file}: expected at most {MAX_FILE_BYTES} bytes, got {path.stat().st_size}")
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise MeshFileError(f"{environment.file}: expected a file .hdr or .exr, got '{path.suffix}'")
    image = reader(path)
    height, width = image.shape[:2]
    if width < 4 or abs(width - 2 * height) > 0.05 * width:
        raise MeshFileError(f"{environment.file}: expected an equirectangular map, twice as wide as high, got {width} x {height}")
    image = clean_map(image, environment.file) * np.float32(environment.luminance_scale)
    image = np.minimum(_reduced(image), np.float32(MOST_CD_M2))
    turned = np.roll(image, -round(environment.yaw_rad / (2.0 * math.pi) * image.shape[1]), axis=1)
    return split_map(turned)


def clean_map(image: NDArray[np.float32], name: str) -> NDArray[np.float32]:
    """Return a map without faulty numbers.

    Raises:
        MeshFileError: more than a hundredth of it is no finite number, or nothing of it shines.
    """
    nan, infinite, negative = np.isnan(image), np.isposinf(image), image < 0.0
    faulty = (nan | infinite | np.isneginf(image)).any(axis=2).mean()
    if faulty > _MOST_FAULTY:
        raise MeshFileError(f"{name}: expected finite luminance, got {faulty:.1%} of the pixels infinite or no number")
    finite = np.where(nan | infinite | negative, np.float32(0.0), image)
    if not finite.any():
        raise MeshFileError(f"{name}: expected a map that shines somewhere, got none above 0")
    if (nan | infinite | negative).any():
        count = int((nan | infinite | negative).any(axis=2).sum())
        warnings.warn(f"{name}: {count} pixels are negative, infinite or no number; clamped", RuntimeWarning, stacklevel=2)
        finite = np.where(infinite, finite.max(), finite)
    return finite.astype(np.float32)


def split_map(image: NDArray[np.float32]) -> MapImages:
    """Split a map into a smooth part and what stands out of it; both keep the pixels' colours."""
    luminance = matmul(image.astype(np.float64), LUMINANCE)
    mean = float(np.average(luminance.mean(axis=1), weights=pixel_solid_angles(*image.shape[:2])))
    share = np.maximum(1.0 - BRIGHT * mean / np.maximum(luminance, 1e-300), 0.0)[..., None].astype(np.float32)
    bright = image * share if share.any() else NO_MAP
    return MapImages(np.ascontiguousarray(image * (1 - share)), np.ascontiguousarray(bright))


def read_rgbe(path: Path) -> NDArray[np.float32]:
    """Return the pixels (height, width, 3) of a Radiance picture.

    Raises:
        MeshFileError: the file is no such picture, too large or cut short.
    """
    data = read_at_most(path, _MAX_BYTES, MeshFileError)
    width, height, exposure, start = _read_header(data, path.name)
    codes = np.zeros((height, width, 4), np.uint8)
    if not _decode(np.frombuffer(data, np.uint8), start, codes):
        raise MeshFileError(f"{path.name}: expected {height} lines of {width} pixels, got data that is cut short or broken")
    scale = np.where(codes[..., 3] > 0, np.ldexp(1.0, codes[..., 3].astype(np.int32) - 136), 0.0) / exposure
    return (codes[..., :3] * scale[..., None]).astype(np.float32)


def _read_header(data: bytes, name: str) -> tuple[int, int, float, int]:
    """Return width, height, the exposure that was applied, and where the pixels begin."""
    if not data.startswith((b"#?RADIANCE", b"#?RGBE")):
        raise MeshFileError(f"{name}: expected a Radiance picture, got another format")
    exposure, position = 1.0, 0
    for _ in range(_MAX_HEADER_LINES):
        end = data.find(b"\n", position, position + 4096)
        if end < 0:
            break
        line, position = data[position:end].strip(), end + 1
        if line.startswith(b"FORMAT=") and line != b"FORMAT=32-bit_rle_rgbe":
            raise MeshFileError(f"{name}: expected FORMAT=32-bit_rle_rgbe, got {line[:40]!r}")
        if line.startswith(b"EXPOSURE="):
            try:
                exposure *= float(line[9:])
            except ValueError:
                raise MeshFileError(f"{name}: expected a number for EXPOSURE, got {line[:40]!r}") from None
        words = line.split()
        if len(words) == 4 and words[0] == b"-Y" and words[2] == b"+X" and words[1].isdigit() and words[3].isdigit():
            height, width = int(words[1]), int(words[3])
            if not (0 < width <= MAX_WIDTH and 0 < height <= MAX_HEIGHT):
                raise MeshFileError(f"{name}: expected at most {MAX_WIDTH} x {MAX_HEIGHT} pixels, got {width} x {height}")
            if not (math.isfinite(exposure) and exposure > 0.0):
                raise MeshFileError(f"{name}: expected an exposure above 0, got {exposure}")
            return width, height, exposure, position
    raise MeshFileError(f"{name}: expected a header that ends in '-Y height +X width', got none")


@entry
def _decode(data: NDArray[np.uint8], start: int, codes: NDArray[np.uint8]) -> bool:
    """Fill pixels (height, width, 4) from run-length coded or plain lines; return whether the data held them all."""
    at, end = start, len(data)
    height, width = codes.shape[0], codes.shape[1]
    for row in range(height):
        if at + 4 > end:
            return False
        coded = data[at] == 2 and data[at + 1] == 2 and (data[at + 2] << 8) + data[at + 3] == width and 8 <= width < 32768
        if not coded:
            if at + 4 * width > end:
                return False
            for column in range(width):
                for channel in range(4):
                    codes[row, column, channel] = data[at + 4 * column + channel]
            at += 4 * width
            continue
        at += 4
        for channel in range(4):
            column = 0
            while column < width:
                if at + 2 > end:
                    return False
                count, run = int(data[at]), data[at] > 128
                count = count - 128 if run else count
                if count == 0 or column + count > width or at + 1 + (1 if run else count) > end:
                    return False
                for i in range(count):
                    codes[row, column + i, channel] = data[at + 1 + (0 if run else i)]
                column += count
                at += 2 if run else 1 + count
    return True


def _reduced(image: NDArray[np.float32]) -> NDArray[np.float32]:
    """Average whole blocks until no line is wider than ``KEPT_WIDTH``; lines and columns that fill no block are left out."""
    factor = -(-image.shape[1] // KEPT_WIDTH)
    height, width = image.shape[0] // factor, image.shape[1] // factor
    blocks = image[: height * factor, : width * factor].reshape(height, factor, width, factor, 3)
    return blocks.mean(axis=(1, 3), dtype=np.float64).astype(np.float32) if factor > 1 else image


def _read_exr(path: Path) -> NDArray[np.float32]:
    return read_exr_color(path, MAX_WIDTH, MAX_HEIGHT)


_READERS: dict[str, Callable[[Path], NDArray[np.float32]]] = {".hdr": read_rgbe, ".exr": _read_exr}
