"""The free floor as Nav2's ``map_server`` reads it: ``map.pgm`` and ``map.yaml``.

``map_server`` turns a pixel p into the occupancy (255 - p) / 255, and in its trinary mode calls a cell occupied above
``occupied_thresh``, free below ``free_thresh``, unknown between them.  The image begins with the row of greatest y, an OccupancyGrid with
that of the lowest; ``origin`` is the pose of the image's lower left corner.
"""

from __future__ import annotations

import math

import numpy as np
from nav_msgs.msg import OccupancyGrid
from numpy.typing import NDArray

from grammar.synthesize import FloorMap
from scene_description import SceneSynthError

FREE_PIXEL, UNKNOWN_PIXEL, OCCUPIED_PIXEL = 254, 205, 0
"""What ``map_saver`` writes for each."""

OCCUPIED_THRESH, FREE_THRESH = 0.65, 0.15
"""205 is an occupancy of 0.196: above this ``free_thresh``, so that unknown stays unknown."""

MAX_CELLS = 100_000_000


class MapError(SceneSynthError):
    """A map that cannot be written; one line."""


def map_pgm(cells: NDArray[np.int8]) -> bytes:
    """Return the image of a grid (h, w): 0 free, 100 occupied, -1 unknown, row 0 at the lowest y; a binary PGM of 8 bits."""
    pixels = np.full(cells.shape, UNKNOWN_PIXEL, np.uint8)
    pixels[cells == 0] = FREE_PIXEL
    pixels[cells == 100] = OCCUPIED_PIXEL
    height, width = cells.shape
    return f"P5\n{width} {height}\n255\n".encode() + np.flipud(pixels).tobytes()


def map_yaml(image: str, resolution_m: float, origin_m: tuple[float, float]) -> str:
    """Return the text beside the image of that name."""
    x, y = (repr(float(value)) for value in origin_m)
    lines = (
        f"image: {image}",
        "mode: trinary",
        f"resolution: {resolution_m!r}",
        f"origin: [{x}, {y}, 0.0]",
        "negate: 0",
        f"occupied_thresh: {OCCUPIED_THRESH}",
        f"free_thresh: {FREE_THRESH}",
    )
    return "\n".join(lines) + "\n"


def floor_of_message(grid: OccupancyGrid) -> FloorMap:
    """Return the free floor that was published.

    Raises:
        MapError: its numbers of rows, columns and cells do not agree, or its place is not finite.
    """
    width, height, cells = grid.info.width, grid.info.height, np.frombuffer(grid.data, np.int8)
    place = grid.info.origin.position
    if width * height != cells.size or not 0 < cells.size <= MAX_CELLS:
        raise MapError(f"map: expected {width} x {height} cells, at most {MAX_CELLS}, got {cells.size}")
    if not all(map(math.isfinite, (place.x, place.y, grid.info.resolution))) or grid.info.resolution <= 0.0:
        raise MapError(f"map: expected a finite origin and a resolution above 0, got {place.x}, {place.y}, {grid.info.resolution}")
    resolution_m = float(str(np.float32(grid.info.resolution)))  # the message has 32 bits: the shortest number that is the same there
    return FloorMap(cells.reshape(height, width), resolution_m, (place.x, place.y))
