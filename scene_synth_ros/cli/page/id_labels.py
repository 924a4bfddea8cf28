"""What the ids of a room mean: a name and a colour for each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from renderer.film.false_color import OBJECTS

MAX_NAME = 120


def label_rows(table: Mapping[int, Any]) -> dict[int, dict[str, Any]]:
    """Return id -> name and colour of a table of unknown origin: texts are cut, colours made three bytes."""
    rows: dict[int, dict[str, Any]] = {}
    for key, value in table.items():
        row = value if isinstance(value, Mapping) else {"name": value}
        rows[key] = {"name": str(row.get("name", ""))[:MAX_NAME]}
        color = row.get("color")
        if isinstance(color, list | tuple) and len(color) == 3 and all(isinstance(c, int) and 0 <= c <= 255 for c in color):
            rows[key]["color"] = [int(c) for c in color]
    return rows


def color_ids(room: dict[str, Any]) -> None:
    """Give a row to every id that an image of the room has, and a colour to every row."""
    for frame in room["frames"]:
        for camera in frame["cameras"].values():
            for layer, image in camera["images"].items():
                table = room["labels"].setdefault(layer, {}) if image["form"] == "ids" else {}
                for key in image.get("counts", ()):
                    table.setdefault(key, {"name": ""})
    for table in room["labels"].values():
        for key, row in table.items():
            if "color" not in row:
                row["color"] = [int(value) for value in OBJECTS.of(np.array([key % 65536], np.uint16))[0]]
