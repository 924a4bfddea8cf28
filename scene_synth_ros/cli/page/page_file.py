"""The page of a bag: what is shown of it, what is missing, and the file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from renderer.film.false_color import DEPTH_STOPS, FAR_M
from scene_description.whole import write_whole
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.cli.page.bag_contents import BagContents
from scene_synth_ros.cli.page.bag_index import BagIndex, index_bag
from scene_synth_ros.cli.page.page_images import MOST_MM, NO_HIT_MM
from scene_synth_ros.cli.page.run_facts import changed_parameters, run_facts
from scene_synth_ros.pages.document import WebFiles, page_document

MAX_BYTES = 200_000_000
"""Of all images of a page."""
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
    bag: Path, path: Path, *, rooms: int, frames: int, max_size: int, progress: Callable[[str, int], None] = lambda _what, _count: None
) -> PageReport:
    """Write the page of a bag.

    Args:
        bag: folder of the bag, or one of its files.
        path: of the page; replaced as a whole.
        rooms: most rooms to show, evenly spread.
        frames: most frames of a room to show, evenly spread.
        max_size: pixels of an image's longer side; larger ones are reduced.
        progress: told what is done, and how many messages of it.

    Raises:
        BagReadError: the bag cannot be read at all.
        OSError: the page cannot be written.
    """
    with BagReader(bag) as reader:
        index = index_bag(reader, rooms, frames, lambda count: progress("looked at", count))
        contents = BagContents(reader, index, max_size, MAX_BYTES, lambda count: progress("taken", count))
        notes = (*_missing(index, contents), *contents.notes, *reader.faults)
        document = page_document(FILES, _page_data(reader, index, contents, notes))
    write_whole(path, document)
    shown = sum(len(room.stamps_ns) for room in index.rooms)
    return PageReport(len(index.rooms), index.rooms_found, shown, index.frames_found, len(document), notes)


def _page_data(reader: BagReader, index: BagIndex, contents: BagContents, notes: tuple[str, ...]) -> dict[str, Any]:
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


def _missing(index: BagIndex, contents: BagContents) -> list[str]:
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
    return lines
