"""The variants of a sweep as one picture: a frame of each, labelled with what was changed."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path

from renderer import LAYERS
from scene_synth_ros.bags.bag_images import layer_picture, layer_topics, read_pixels
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.cli.pictures.picture_grid import Tile, write_grid
from scene_synth_ros.cli.usage import UsageError
from scene_synth_ros.sweep.sweep_document import short

SHOWN = ("color_sensed", "color", "depth")
"""Layers that may be shown, the best first."""
COLUMNS = 4


def write_sheet(document: Mapping[str, object], folder: Path, path: Path, only: Collection[str] = ()) -> int:
    """Draw the first frame of every variant, as JPEG or PNG by the file's name; return how many there are.

    Args:
        document: ``sweep.json``.
        folder: that it lies in.
        path: of the picture.
        only: ids of the variants to draw; empty: all.

    Raises:
        UsageError: there is no variant, or its bag holds none of ``SHOWN``.
    """
    variants = document["variants"]
    assert isinstance(variants, list)
    tiles = [_tile(variant, folder / variant["bag"]) for variant in variants if not only or variant["id"] in only]
    write_grid(tiles, COLUMNS, path)
    return len(tiles)


def _tile(variant: Mapping[str, object], bag: Path) -> Tile:
    with BagReader(bag) as reader:
        topics = layer_topics({topic.name: topic.type_name for topic in reader.summary.topics})
        layer = next((layer for layer in SHOWN if layer in topics), None)
        message = next(iter(reader.messages([topics[layer]])), None) if layer is not None else None
        if layer is None or message is None:
            raise UsageError(f"{bag}: no picture; expected images of {', '.join(SHOWN)}, got {', '.join(topics) or 'none'}")
        return Tile(_label(variant), layer_picture(LAYERS[layer], read_pixels(message)))


def _label(variant: Mapping[str, object]) -> str:
    base, factors, changed = variant["base"], variant["factors"], variant["changed"]
    assert isinstance(base, Mapping) and isinstance(factors, Mapping) and isinstance(changed, list)
    values = ", ".join(f"{name} {short(factors[name])}" for name in changed) or f"{base['room_type']} of seed {base['seed']}, as it is"
    return f"{variant['id']} {values.replace('_', ' ')}"
