"""Flicker of cached and of path-traced pictures: frames of a slow walk, each warped into the next by true depth and poses.

python -m benchmarks.flicker_bench [--types TYPE ...] [--frames N] [--references DIR] [--samples N] [--preset NAME] [--write]

A pixel counts where what it shows is matt and was seen in the frame before, where all four pixels around the place that it comes from
show the same part.  The difference is the mean over its channels, in codes of 255.  Pictures are 320x240.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from benchmarks.sampled_rooms import ROOM_TYPES, SIZE, References, Walk, walks
from benchmarks.table import DOCS, Row, at_most, markdown_table, render_table, write_section
from grammar import room_types
from renderer import FlatScene, warm_up

FRAMES, SAMPLES = 30, 128
VISIBLE = 0
LEAST_ROUGHNESS, MOST_METALLIC = 0.5, 0.1


class Flicker(NamedTuple):
    """Of one room: mean absolute difference, codes of 255, of cached and of traced frames; the share of pixels that count."""

    name: str
    cached: float
    traced: float
    share: float


def measure(
    types: Sequence[str] = ROOM_TYPES, frames: int = FRAMES, references: References | None = None, preset: str = "stream"
) -> list[Row]:
    """Return the rows of each room."""
    references, rows = references or References(None, SAMPLES), []
    warm_up(integrator="cached")
    for walk in walks(tuple(types), frames, preset, references):
        found = flicker(walk)
        limit = round(found.traced + 1.0, 2)
        rows += [
            at_most(f"{found.name}: cached, {frames} frames of {SIZE[0]}x{SIZE[1]}", found.cached, "codes", limit),
            Row(f"  path traced, {references.samples} samples, denoised", found.traced, "codes"),
            Row("  pixels that count", 100.0 * found.share, "%"),
        ]
        print(render_table("", rows[-3:]), flush=True)
    return rows


def flicker(walk: Walk) -> Flicker:
    """Return the flicker of a walk's frames."""
    cached, traced, shares = [], [], []
    for index in range(1, len(walk.truth)):
        before, now = walk.truth[index - 1], walk.truth[index]
        counts = is_matt(walk.room.flat, now) & is_followed(before, now)
        for kept, pictures in ((cached, walk.cached), (traced, walk.traced)):
            kept.append(warped_difference(pictures[index - 1], pictures[index], now["flow_backward"], counts))
        shares.append(counts.mean())
    return Flicker(walk.room.name, *(float(np.mean(values)) for values in (cached, traced, shares)))


def is_matt(flat: FlatScene, truth: dict[str, NDArray[Any]]) -> NDArray[np.bool_]:
    """Return the pixels (h, w) whose surface is rough, no metal, lets nothing through and has no coat."""
    materials = flat.materials
    plain = np.append(False, (materials.transmission == 0.0) & (materials.clearcoat == 0.0))
    rough = (truth["roughness"] >= LEAST_ROUGHNESS) & (truth["metallic"] <= MOST_METALLIC)
    return np.asarray(rough & np.isfinite(truth["depth"]) & plain[truth["material"]])


def is_followed(before: dict[str, NDArray[Any]], now: dict[str, NDArray[Any]]) -> NDArray[np.bool_]:
    """Return the pixels (h, w) of a frame whose place in the frame before lies amid four pixels of the same part that it was seen by."""
    height, width = now["part"].shape
    place = _places(now["flow_backward"])
    seen = (now["occlusion_backward"] == VISIBLE) & np.isfinite(place).all(axis=0)
    row, column = (np.nan_to_num(axis, nan=-1.0) for axis in place)
    seen &= (row >= 0) & (column >= 0) & (row <= height - 1) & (column <= width - 1)
    for round_row in (np.floor, np.ceil):
        for round_column in (np.floor, np.ceil):
            at = (np.clip(round_row(row), 0, height - 1).astype(int), np.clip(round_column(column), 0, width - 1).astype(int))
            seen &= (before["part"][at] == now["part"]) & (before["instance"][at] == now["instance"])
    return seen


def warped_difference(
    before: NDArray[np.uint8], now: NDArray[np.uint8], flow_backward: NDArray[np.float32], counts: NDArray[np.bool_]
) -> float:
    """Return the mean absolute difference, codes, of a picture (h, w, 3) and the one before, read bilinearly where flow (h, w, 2) leads."""
    place = _places(flow_backward)[:, counts]
    warped = np.stack([map_coordinates(before[..., channel].astype(np.float64), place, order=1) for channel in range(3)], axis=-1)
    return float(np.abs(warped - now[counts]).mean()) if counts.any() else 0.0


def _places(flow: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return rows and columns (2, h, w) to which flow leads."""
    return np.indices(flow.shape[:2]) + np.moveaxis(flow.astype(np.float64), -1, 0)[::-1]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of benches on slow walks."""
    parser.add_argument("--types", nargs="+", choices=room_types(), default=list(ROOM_TYPES), help="room types (default: three)")
    parser.add_argument("--frames", type=int, default=FRAMES, help="of each room (default: %(default)s)")
    parser.add_argument("--references", type=Path, metavar="DIR", help="path-traced pictures are kept here, rendered if missing")
    parser.add_argument("--samples", type=int, default=SAMPLES, help="of the path-traced pictures (default: %(default)s)")
    parser.add_argument("--preset", choices=("realtime", "stream"), default="stream", help="of the cached pictures (default: %(default)s)")
    parser.add_argument("--write", action="store_true", help="put the table into docs/cache.md")


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.flicker_bench")
    add_arguments(parser)
    arguments = parser.parse_args()
    rows = measure(arguments.types, arguments.frames, References(arguments.references, arguments.samples), arguments.preset)
    print(render_table("Flicker", rows))
    if arguments.write:
        caption = f"`{arguments.preset}`; asked is what path-traced frames have, plus 1:\n\n"
        write_section(DOCS / "cache.md", "flicker", caption + markdown_table(rows))


if __name__ == "__main__":
    main()
