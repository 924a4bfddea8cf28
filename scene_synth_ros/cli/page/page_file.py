"""The page of a bag: what is shown of it, what is missing, and the file."""

import dataclasses
import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from renderer.film.false_color import DEPTH_STOPS, FAR_M
from scene_description.whole import write_whole
from scene_synth_ros.bags.bag_images import spread
from scene_synth_ros.bags.bag_reader import BagReader, BagSummary
from scene_synth_ros.bags.run_info import PARAMETERS_NAME, RECORD_NAME, NodeValues, read_parameters
from scene_synth_ros.cli.lines import counted
from scene_synth_ros.cli.page.bag_contents import MAX_NAME, BagContents
from scene_synth_ros.cli.page.bag_index import OTHERS, PageIndex, index_bag
from scene_synth_ros.cli.page.page_images import MOST_MM, NO_HIT_MM
from scene_synth_ros.dataset.places import shard_bags
from scene_synth_ros.messages.stamps import NANOSECONDS
from scene_synth_ros.messages.streams import IMAGE_FORMS, PICTURE, find_streams
from scene_synth_ros.pages.document import WebFiles, page_document
from scene_synth_ros.render.renderer_config import RENDERER_GROUPS
from scene_synth_ros.synthesize.run_config import GRAMMAR_GROUPS

MAX_BYTES = 200_000_000
"""Of all images of a page."""
MOST_SHARDS = 100
"""Shards of a dataset that a page reads."""
MOST_NAMED = 12
"""Topics that a note names."""
FILES = WebFiles(
    "scene_synth_ros.cli.page", "page.html", "page.css", ("values.js", "plan.js", "tables.js", "tiles.js", "viewer.js", "controls.js")
)


class PageReport(NamedTuple):
    """What a page shows of a bag: rooms and frames of how many, the size of the file, and what is missing, lines for people."""

    rooms: int
    rooms_found: int
    frames: int
    frames_found: int
    size: int
    notes: tuple[str, ...]


def write_page(
    bag: Path,
    path: Path,
    *,
    rooms: int,
    frames: int,
    max_size: int,
    progress: Callable[[str, int], None] = lambda _what, _count: None,
) -> PageReport:
    """Write the page of a bag, or of shards of a dataset, evenly spread.

    ``rooms`` and ``frames`` of each are the most that are shown, evenly spread; larger images than ``max_size`` pixels are reduced.

    Raises:
        BagReadError, DatasetError: there is nothing to read.
        OSError: the page cannot be written.
    """
    told: list[str] = []
    shards = shard_bags(bag, told.append)
    chosen = spread(shards, min(rooms, MOST_SHARDS))
    if len(chosen) < len(shards):
        told.append(f"{len(chosen)} of {len(shards)} shards are shown, evenly spread")
    with BagReader(bag, [file for shard in chosen for file in sorted(shard.glob("*.mcap"))]) as reader:
        index = index_bag(reader, rooms, frames, lambda count: progress("looked at", count))
        contents = BagContents(reader, index, max_size, MAX_BYTES, lambda count: progress("taken", count))
        notes = (*told, *_missing(index, contents), *contents.notes, *reader.faults)
        document = page_document(FILES, _page_data(reader, index, contents, notes))
    write_whole(path, document)
    shown = sum(len(room.stamps_ns) for room in index.rooms)
    return PageReport(len(index.rooms), index.rooms_found, shown, index.frames_found, len(document), notes)


def _page_data(reader: BagReader, index: PageIndex, contents: BagContents, notes: tuple[str, ...]) -> dict[str, Any]:
    summary = reader.summary
    path = summary.path.resolve()
    return {
        "title": path.name,
        "notes": notes,
        "rooms_found": index.rooms_found,
        "frames_found": index.frames_found,
        "run": run_facts(summary, index),
        "parameters": changed_parameters(summary),
        "topics": index.topics,
        "cameras": contents.cameras(),
        "rooms": contents.rooms,
        "distances": {"stops": (DEPTH_STOPS * 255.0).tolist(), "far_m": FAR_M, "no_hit": NO_HIT_MM, "most": MOST_MM},
    }


def _missing(index: PageIndex, contents: BagContents) -> list[str]:
    """Return a line for each kind of thing that the bag does not have."""
    layers = {stream.layer for stream in index.streams.values()}
    lines = []
    if not any(topic.messages for topic in index.topics):
        lines.append("the bag holds no messages")
    elif not index.frames_found:
        lines.append("the bag holds no images that have a stamp")
    elif "color" not in layers:
        lines.append("the bag holds no colour")
    if all(room.start_ns is None for room in index.rooms):
        lines.append("the bag holds no scene description: no plan of the room, no objects")
    if index.frames_found and not any(
        camera["pose"] for room in contents.rooms for f in room["frames"] for camera in f["cameras"].values()
    ):
        lines.append("the bag holds no camera poses: the camera is not on the plan")
    return [*lines, *_left_out(index, contents)] if index.frames_found else lines


def _left_out(index: PageIndex, contents: BagContents) -> Iterator[str]:
    """Yield a line of topics without messages, one of images that are not at every stamp of their camera, one of what is not shown."""
    counts, types = {topic.name: topic.messages for topic in index.topics}, {topic.name: topic.type_name for topic in index.topics}
    most: dict[str, int] = {}
    for name, shown in index.streams.items():
        most[shown.camera] = max(most.get(shown.camera, 0), counts[name])
    # A layer may be there in a second form, as a picture for people or compressed.
    layers = {(shown.camera, shown.layer) for shown in index.streams.values()}
    forms = {name for name, own in find_streams(types, PICTURE, *IMAGE_FORMS).items() if (own.base, own.layer) in layers}
    parts = [(name, counts[name], most[shown.camera]) for name, shown in index.streams.items() if shown.camera != OTHERS]
    topics = {
        "no messages": [name for name, count in counts.items() if not count],
        "not at every stamp": [f"{name} {count} of {frames}" for name, count, frames in sorted(parts) if 0 < count < frames],
        "in the bag, but not shown": [name for name, count in counts.items() if count and name not in contents.topics | forms],
    }
    for what, names in topics.items():
        more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
        if names:
            yield f"{what}: {', '.join(name[:MAX_NAME] for name in names[:MOST_NAMED])}{more}"


NODE_GROUPS: dict[str, dict[str, type]] = {
    "grammar_node": GRAMMAR_GROUPS,
    "renderer_node": RENDERER_GROUPS,
}
"""How the name of a node begins -> prefix of its parameters -> dataclass that defines them."""

MAX_TEXT, MAX_PARAMETERS = 400, 500


def run_facts(summary: BagSummary, index: PageIndex) -> list[tuple[str, str]]:
    """Return what is known of the run that made the bag, name -> text; what the bag does not say is left out."""
    record = summary.records.get(RECORD_NAME, {})
    facts = [(name.replace("_", " "), record[name]) for name in ("seed", "room_type") if record.get(name)]
    files = counted(len(summary.files), "file")
    facts.append(("bag", f"{files}, {summary.size / 1e6:.1f} MB{'' if summary.finished else ', unfinished'}"))
    facts.append(("frames", f"{index.frames_found} in {counted(index.rooms_found, 'room')}"))
    if index.period_ns:
        facts.append(("rate", f"{NANOSECONDS / index.period_ns:.4g} Hz"))
    if summary.start_ns is not None and summary.end_ns is not None:
        facts.append(("duration", f"{(summary.end_ns - summary.start_ns) / NANOSECONDS:.3f} s"))
    versions = {name.partition(".")[2]: value[:MAX_TEXT] for name, value in record.items() if name.startswith("version.")}
    facts += [(name, versions.pop(name)) for name in ("system", "processor") if name in versions]
    if versions:
        facts.append(("versions", ", ".join(f"{name} {version}" for name, version in versions.items())))
    return [(name, value[:MAX_TEXT]) for name, value in facts]


def changed_parameters(summary: BagSummary) -> list[tuple[str, str, str, str]]:
    """Return (node, parameter, value, default) of the parameters in the bag that are not at their default.

    A default is that of this program; a parameter that it does not know is told with the default ``?``.
    """
    return list(_changed(read_parameters(summary.attachments.get(PARAMETERS_NAME, b""))))[:MAX_PARAMETERS]


def _changed(nodes: NodeValues) -> Iterator[tuple[str, str, str, str]]:
    for node, values in nodes.items():
        short = node.rpartition("/")[2]
        known = next((_defaults(groups) for name, groups in NODE_GROUPS.items() if short.startswith(name)), {})
        for name, value in values.items():
            default = known.get(str(name), "?")
            if default != value:
                yield node[:MAX_TEXT], str(name)[:MAX_TEXT], _text(value), _text(default)


def _defaults(groups: Mapping[str, type]) -> dict[str, Any]:
    defaults = {}
    for prefix, cls in groups.items():
        for field in dataclasses.fields(cls):
            name = f"{prefix}.{field.name}" if prefix else field.name
            defaults[name] = list(field.default) if isinstance(field.default, tuple) else field.default
    return defaults


def _text(value: object) -> str:
    plain = value if isinstance(value, str) else json.dumps(value, default=str)
    return plain[:MAX_TEXT] if plain else '""'
