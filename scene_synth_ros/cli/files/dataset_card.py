"""The card of a dataset, ``README.md`` with pictures: what is in it, how it was made, what its rooms and images are like."""

import io
import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from grammar.drawing.top_view import top_view
from renderer.film.layer import Layer
from renderer.film.layers import layers_in
from scene_synth_ros.bags.bag_images import layer_picture, spread
from scene_synth_ros.bags.dataset_files import shard_folder
from scene_synth_ros.cli.files.card_samples import ROOMS_SAMPLED, ImageNumbers, SampledFrame, sampled_frames, spread_row
from scene_synth_ros.cli.lines import markdown_table
from scene_synth_ros.cli.pictures.contact_sheet import small_picture
from scene_synth_ros.cli.pictures.picture_grid import Tile, png_bytes, write_grid
from scene_synth_ros.shards.completion import Manifest, RoomRow
from scene_synth_ros.shards.plan import DatasetPlan
from scene_synth_ros.shards.provenance import read_provenance
from scene_synth_ros.shards.store import Store

CARD_NAME, PICTURES = "README.md", "card"
_TILE_WIDTH, _COLUMNS = 256, 4
_SHOWN, _PLANS = 12, 8
_BAR = 24
_SPREAD = ("", "least", "median", "mean", "most")
_PICTURES = {"rooms.jpg": "A frame of some rooms", "layers.jpg": "Every layer of one frame", "layouts.jpg": "Some rooms from above"}


def write_card(plan: DatasetPlan, manifest: Manifest, store: Store) -> None:
    """Write the card of a dataset and its pictures beside its shards; the same dataset gives the same card.

    Raises:
        OSError: it cannot be written.
        ShardError: a shard cannot be read, or has lost a room since it was made.
    """
    numbers, shown = ImageNumbers(), []
    drawn_rooms = spread(range(min(ROOMS_SAMPLED, manifest["rooms"])), _SHOWN)
    for number, frame in enumerate(sampled_frames(plan, manifest, lambda shard: store.fetched(shard_folder(shard)))):
        numbers.take(frame)
        shown += [frame] if number in drawn_rooms else []
    rows = layers_in(plan.settings_of(0).renderers["renderer_node"]["streams"].semantic_classes)
    with store.workspace(PICTURES) as work:
        (work / PICTURES).mkdir()
        drawn = _draw(shown, rows, work / PICTURES)
        store.put_folder(work / PICTURES, PICTURES)
    store.write(CARD_NAME, card_text(plan, manifest, numbers, drawn).encode())


def card_text(plan: DatasetPlan, manifest: Manifest, numbers: ImageNumbers, pictures: Sequence[str]) -> str:
    """Return the card."""
    rooms = [row for completion in manifest["shards"] for row in completion["rooms"]]
    files = [row for completion in manifest["shards"] for row in completion["files"]]
    size, frames = sum(row["bytes"] for row in files), manifest["frames"]
    types = Counter(row["room_type"] for row in rooms)
    what = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in types.most_common())
    parts = [
        "# Dataset of synthetic rooms",
        f"{len(rooms)} rooms ({what}), {frames} frames, {size / 1e6:.1f} MB in {plan.shards} shards"
        + (f", {size / frames / 1e6:.2f} MB a frame." if frames else ".")
        + f" Made with seed {plan.seed}; "
        + ("**by several programs or kinds of machine, see below**." if _is_mixed(manifest) else "the same plan gives the same bytes."),
        *(f"**{_PICTURES[name]}**\n\n![{_PICTURES[name]}]({PICTURES}/{name})" for name in pictures),
        "## What is here",
        markdown_table(
            ("file", "what"),
            [
                ("`dataset.json`", f"the plan: rooms, seed, parameters (SHA-256 `{plan.sha256[:16]}...`)"),
                ("`shards/00000/`", "a rosbag2 bag (MCAP) of the shard's rooms: `ros2 bag play`, Foxglove, `scene_synth inspect`"),
                ("`shards/00000.json`", "its rooms, the SHA-256 of its files, scenes and topics"),
                ("`manifest.json`", "the same of all shards"),
            ],
        ),
        "Made again by `scene_synth generate --plan dataset.json --out DIR`, made complete by `scene_synth generate --resume --out DIR`.",
        "## Topics",
        markdown_table(("topic", "shards that have it"), _topics(manifest)),
        *_failed(manifest),
        "## Made by",
        *_makers(manifest),
        "## Rooms",
        markdown_table(_SPREAD, _layout_rows(rooms)) if rooms else "None.",
        "## Objects",
        _histogram(("category", "objects", "rooms that have it"), _objects(rooms)),
        "## Images",
        f"Of the middle frame of {numbers.frames} rooms, evenly spread over the dataset.",
        markdown_table(_SPREAD, numbers.rows()),
        "## Classes by pixels",
        _histogram(("class", "share of pixels (%)", "frames that show it (%)"), _classes(numbers)),
        "## Parameters",
        "What was given; every other parameter has its default, and each bag has them all as `parameters.yaml`.",
        f"```json\n{json.dumps(plan.parameters, indent=1, sort_keys=True)}\n```",
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _topics(manifest: Manifest) -> list[tuple[str, str]]:
    counts = Counter(topic for completion in manifest["shards"] for topic in completion["layers"])
    return [(f"`{topic}`", str(count)) for topic, count in sorted(counts.items())]


def _is_mixed(manifest: Manifest) -> bool:
    first = manifest["shards"][0]["provenance"]
    return any(completion["provenance"] != first for completion in manifest["shards"])


def _makers(manifest: Manifest) -> Iterator[str]:
    """Yield what made the shards: of the first one everything, of others in what they differ from it."""
    makers = Counter(json.dumps(completion["provenance"]) for completion in manifest["shards"])
    (first, count), *others = ((read_provenance(json.loads(maker)), count) for maker, count in makers.items())
    yield f"{count} of {len(manifest['shards'])} shards by this" + (":" if others else ", as all there are:")
    rows = [(what, ", ".join(f"{name} {value}" for name, value in facts.items())) for what, facts in first.to_mapping().items()]
    yield markdown_table(("what", "is"), rows)
    for other, count in others:
        yield f"{count} by another: {other.difference(first, named=100)}."


def _failed(manifest: Manifest) -> Iterator[str]:
    if manifest["failed"]:
        yield "## Rooms that could not be made"
        yield markdown_table(("room", "attempts", "error"), [(str(r["index"]), str(r["attempts"]), r["error"]) for r in manifest["failed"]])


def _layout_rows(rooms: Sequence[RoomRow]) -> list[tuple[str, ...]]:
    objects = [sum(row["objects"].values()) for row in rooms]
    areas = [row["floor_area_m2"] for row in rooms]
    figures: dict[str, Sequence[float]] = {
        "objects in a room": objects,
        "categories in a room": [len(row["objects"]) for row in rooms],
        "floor (m²)": areas,
        "objects a square metre": [count / area for count, area in zip(objects, areas, strict=True)],
    }
    return [spread_row(name, [float(value) for value in values]) for name, values in figures.items()]


def _objects(rooms: Sequence[RoomRow]) -> list[tuple[str, float, str]]:
    counts: Counter[str] = Counter()
    having: Counter[str] = Counter()
    for row in rooms:
        counts.update(row["objects"])
        having.update(row["objects"].keys())
    ordered = sorted(counts.items(), key=lambda item: (-item[1], item[0]))
    return [(name.replace("_", " "), float(count), f"{having[name]} of {len(rooms)}") for name, count in ordered]


def _classes(numbers: ImageNumbers) -> list[tuple[str, float, str]]:
    total = max(1, numbers.pixels.total())
    ordered = sorted(numbers.pixels.items(), key=lambda item: (-item[1], item[0]))
    return [(name, 100.0 * count / total, f"{100.0 * numbers.seen[name] / numbers.frames:.0f}") for name, count in ordered]


def _histogram(head: tuple[str, str, str], rows: Sequence[tuple[str, float, str]]) -> str:
    """Return a table with a bar for each number, the longest for the largest."""
    most = max((number for _, number, _ in rows), default=1.0)
    told = [(name, f"{number:.2f}".rstrip("0").rstrip("."), "█" * round(_BAR * number / most), more) for name, number, more in rows]
    return markdown_table((head[0], head[1], "", head[2]), told) if rows else "None."


def _draw(frames: Sequence[SampledFrame], rows: Mapping[str, Layer], folder: Path) -> list[str]:
    """Write the pictures that there can be; return their names."""
    drawn = []
    layer = next((name for name in ("color", "semantic", *rows) if frames and name in frames[0].images), None)
    if layer is not None:
        tiles = [Tile(_title(frame), _small(rows[layer], frame.images[layer])) for frame in frames]
        write_grid(tiles, _COLUMNS, folder / "rooms.jpg")
        images = frames[0].images
        write_grid([Tile(name, _small(rows[name], images[name])) for name in images], _COLUMNS, folder / "layers.jpg")
        drawn += ["rooms.jpg", "layers.jpg"]
    if frames:
        write_grid([Tile(_title(frame), _plan(frame)) for frame in frames[:_PLANS]], _COLUMNS, folder / "layouts.jpg")
        drawn.append("layouts.jpg")
    return drawn


def _title(frame: SampledFrame) -> str:
    return f"room {frame.scene.index}: {frame.scene.category.replace('_', ' ')}, {len(frame.scene.objects)} objects"


def _small(layer: Layer, pixels: NDArray[np.generic]) -> NDArray[np.uint8]:
    picture = Image.fromarray(layer_picture(layer, pixels)).convert("RGB")
    return np.asarray(small_picture(layer, picture, _TILE_WIDTH))


def _plan(frame: SampledFrame) -> NDArray[np.uint8]:
    """Return a room from above, fitted into a square."""
    with Image.open(io.BytesIO(png_bytes(top_view(frame.scene)))) as drawing:
        image = drawing.convert("RGB")
    image.thumbnail((_TILE_WIDTH, _TILE_WIDTH), Image.Resampling.LANCZOS)
    square = Image.new("RGB", (_TILE_WIDTH, _TILE_WIDTH), (255, 255, 255))
    square.paste(image, ((_TILE_WIDTH - image.width) // 2, (_TILE_WIDTH - image.height) // 2))
    return np.asarray(square)
