"""Draws some frames of each room of a bag, every layer coloured for people, as one picture."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from PIL import Image as Picture
from PIL import ImageDraw, ImageFont

from renderer.film.layer import Layer
from renderer.film.layers import layers_in
from scene_description.label_standards import STANDARDS, StandardName
from scene_description.whole import whole_file
from scene_synth_ros.bags.bag_images import layer_picture, layer_topics, spread
from scene_synth_ros.bags.bag_reader import BagMessage, BagReader
from scene_synth_ros.bags.indexed_bag import IndexedBag, open_bag
from scene_synth_ros.cli.options import UsageError
from scene_synth_ros.cli.pictures.picture_grid import FORMATS, INK, PAPER
from scene_synth_ros.messages.cdr import json_object, read_text
from scene_synth_ros.messages.streams import LABELS, SCENE, find_streams

TILE_WIDTH = 256
FRAMES_PER_ROOM = 2
GAP, TITLE_HEIGHT = 4, 22


class SheetRoom(NamedTuple):
    """A room of the bag: its title, and the stamps of its frames."""

    title: str
    stamps: tuple[int, ...]


def write_contact_sheet(bag: Path, path: Path) -> int:
    """Draw the sheet of a bag, as JPEG or PNG by the file's name, and return the number of rooms on it.

    Raises:
        BagReadError: the bag cannot be read.
        UsageError: it holds no room or no image.
    """
    with BagReader(bag) as reader:
        topics, scenes = layer_topics(reader.types), next(iter(find_streams(reader.types, SCENE)), None)
        if scenes is None or not topics:
            got = ", ".join(sorted(reader.types)) or "nothing"
            raise UsageError(f"{bag}: no contact sheet; expected a scene topic and images, got {got}")
        rooms = [_read_room(message) for message in reader.messages([scenes])]
        chosen = {stamp for room in rooms for stamp in spread(room.stamps, FRAMES_PER_ROOM)}
        rows = layers_in(_standard(reader))
    tiles = {(stamp, layer): tile for stamp, layer, tile in _tiles(open_bag(bag), topics, chosen, rows)}
    if not tiles:
        raise UsageError(f"{bag}: no contact sheet; it holds no image of its {len(rooms)} rooms")
    with whole_file(path) as partial:
        _draw(rooms, list(topics), tiles).save(partial, format=FORMATS.get(path.suffix.lower(), "PNG"), quality=85, optimize=True)
    return len(rooms)


def _read_room(message: BagMessage) -> SheetRoom:
    scene = json.loads(read_text(message.data))
    title = f"room {scene['index']}: {scene['category']}, {len(scene['objects'])} objects, seed {scene['seed']}"
    return SheetRoom(title, tuple(pose["stamp_ns"] for pose in scene["camera_path"]))


def _standard(reader: BagReader) -> StandardName:
    """Return the standard of the class ids of a bag, as its labels tell."""
    topics = [topic for topic, stream in find_streams(reader.types, LABELS).items() if stream.layer == "semantic"]
    for message in reader.messages(topics):
        told = json_object(message.data).get("standard", "nyu40")
        return next((name for name in STANDARDS if name == told), "nyu40")
    return "nyu40"


def _tiles(
    bag: IndexedBag, topics: dict[str, str], stamps: set[int], rows: Mapping[str, Layer]
) -> Iterator[tuple[int, str, Picture.Image]]:
    bag.prepare(topics.values())
    for stamp in sorted(stamps):
        for layer, topic in topics.items():
            if (topic, stamp) in bag:
                picture = Picture.fromarray(layer_picture(rows[layer], bag.image(topic, stamp).pixels))
                yield stamp, layer, small_picture(rows[layer], picture, TILE_WIDTH)


def small_picture(layer: Layer, picture: Picture.Image, width: int) -> Picture.Image:
    """Return the picture of a layer in another width."""
    height = max(1, round(width * picture.height / picture.width))
    one_ray = layer.group in ("geometric", "sensed")  # its pixels mean nothing when they are mixed
    return picture.resize((width, height), Picture.Resampling.NEAREST if one_ray else Picture.Resampling.LANCZOS)


def _draw(rooms: list[SheetRoom], layers: list[str], tiles: dict[tuple[int, str], Picture.Image]) -> Picture.Image:
    tile_height = next(iter(tiles.values())).height
    rows = [(room, spread(room.stamps, FRAMES_PER_ROOM)) for room in rooms]
    height = TITLE_HEIGHT + sum(TITLE_HEIGHT + len(stamps) * (tile_height + GAP) for _, stamps in rows) + GAP
    sheet = Picture.new("RGB", (GAP + len(layers) * (TILE_WIDTH + GAP), height), PAPER)
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(14)
    for column, layer in enumerate(layers):
        draw.text((GAP + column * (TILE_WIDTH + GAP), 3), layer, INK, font)
    y = TITLE_HEIGHT
    for room, stamps in rows:
        draw.text((GAP, y + 3), room.title, INK, font)
        y += TITLE_HEIGHT
        for stamp in stamps:
            for column, layer in enumerate(layers):
                if (stamp, layer) in tiles:
                    sheet.paste(tiles[stamp, layer], (GAP + column * (TILE_WIDTH + GAP), y))
            y += tile_height + GAP
    return sheet
