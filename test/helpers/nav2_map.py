"""Reads map.yaml and its image as Nav2's ``map_server`` does in trinary mode, by an image library and none of our code."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import yaml
from PIL import Image


class Nav2Map(NamedTuple):
    """What ``map_server`` would publish: cells row by row from the lowest y, and the fields of ``info``."""

    data: np.ndarray
    width: int
    height: int
    resolution: float
    origin: tuple[float, float, float]


def read_nav2_map(path: Path) -> Nav2Map:
    """Return the map: occupied above ``occupied_thresh``, free below ``free_thresh``; the image's first row has the greatest y."""
    told = yaml.safe_load(path.read_text())
    assert told["mode"] == "trinary" and set(told) == {
        "image", "mode", "resolution", "origin", "negate", "occupied_thresh", "free_thresh",
    }  # fmt: skip
    shade = np.asarray(Image.open(path.with_name(told["image"])), np.float64) / 255.0
    occupancy = shade if told["negate"] else 1.0 - shade
    height, width = occupancy.shape
    data = np.empty(width * height, np.int8)
    for y in range(height):
        for x in range(width):
            cell = -1
            if occupancy[y, x] > told["occupied_thresh"]:
                cell = 100
            elif occupancy[y, x] < told["free_thresh"]:
                cell = 0
            data[width * (height - y - 1) + x] = cell
    return Nav2Map(data, width, height, told["resolution"], tuple(told["origin"]))
