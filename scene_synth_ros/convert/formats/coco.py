"""COCO: instances with masks and, where classes are recorded, panoptic segments (https://cocodataset.org/#format-data).

``images/``, ``annotations/instances.json`` (``instances_<split>.json`` of a split), ``panoptic/`` with a PNG of segment ids a frame and
``annotations/panoptic.json``.  Masks are the pixels of the instance layer as run lengths.  A segment's id is that of the object, or of
walls, floor and ceiling ``STUFF`` plus their class; as in every panoptic PNG it is R + 256 G + 65536 B.
"""

import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.annotations.annotator import pixel_box
from renderer.annotations.coco import Segment, coco_head, image_row, seen_share, segment_row
from renderer.annotations.pixels import COUNT, LEFT, RIGHT, empty_tally, tally_ids
from renderer.annotations.run_lengths import mask_of
from scene_description import SceneSynthError
from scene_description.annotations import Box2D
from scene_synth_ros.convert.files import write_picture, write_png
from scene_synth_ros.convert.writer import ConvertError, Sequence, Source, Writer
from scene_synth_ros.dataset import Frame

STUFF = 65536
"""Added to the class of pixels without an object, for the ids of their segments."""
_STUFF_NAMES = ("wall", "floor", "ceiling")

_INSTANCES = {"images": "images", "annotations": "instances"}
_PANOPTIC = {"images": "images", "annotations": "panoptic"}
"""List of a document -> its rows."""


class _Stuff(NamedTuple):
    """The pixels of a class that belong to no object: the class, how many, the box around them."""

    label: int
    pixels: int
    box: Box2D


class _Item(NamedTuple):
    """A frame: its row without number, its objects, what is known of how much is seen of each, its stuff."""

    row: dict[str, Any]
    segments: list[Segment]
    shares: Mapping[int, dict[str, float]]
    stuff: list[_Stuff]


class FormatWriter(Writer):
    """Writes COCO's files."""

    def begin(self, out: Path, source: Source) -> None:
        """Make the folders."""
        super().begin(out, source)
        self._is_panoptic = "semantic" in source.roles
        for name in ("images", "annotations", *(("panoptic",) if self._is_panoptic else ())):
            (out / name).mkdir()
        self._lists = {name: JsonRows(out / f"{name}.part") for name in ("images", "instances", "panoptic")}
        self._names: dict[int, str] = {}

    def begin_sequence(self, sequence: Sequence) -> Sequence:
        """Take the names of the classes.

        Raises:
            ConvertError: rooms have class ids of different standards.
        """
        names = class_names(self.source.frame(sequence, 0))
        if any(self._names.get(key, name) != name for key, name in names.items()):
            raise ConvertError(f"coco: {self.source.name}: expected classes of one standard, got another in {sequence.name}; use --rooms")
        self._names |= names
        return sequence

    def encode(self, frame: Frame, number: int, state: Sequence) -> _Item:
        """Write picture and panoptic image; return the rows."""
        roles, name = self.source.roles, f"{state.name}_{number:06d}"
        picture = write_picture(frame, roles["picture"], self.out / "images" / name)
        instance = np.ascontiguousarray(frame[roles["instance"]], np.uint16)
        labels = frame.labels(roles["instance"])
        segments = segments_of(instance, {key: int(row["class"]) for key, row in labels.items()})  # type: ignore[call-overload]
        told = frame.detections
        shares = {} if told is None else {item.id: seen_share(item) for item in told.objects}
        stuff: list[_Stuff] = []
        if self._is_panoptic:
            classes = np.where(instance == 0, frame[roles["semantic"]], 0).astype(np.uint16)
            stuff = [_Stuff(key, int(tally[COUNT]), pixel_box(tally)) for key, tally in _tallies(classes).items()]
            write_png(self.out / "panoptic" / f"{name}.png", panoptic_pixels(instance, classes))
        height, width = instance.shape
        row = image_row(0, picture, width, height, frame.info.scene_id, frame.stamp_ns)
        return _Item(row, segments, shares, stuff)

    def take(self, item: _Item, state: Sequence) -> None:
        """Number the rows."""
        del state
        images, instances = self._lists["images"], self._lists["instances"]
        number = images.count + 1
        images.add(item.row | {"id": number})
        for segment in item.segments:
            instances.add(segment_row(instances.count + 1, number, segment, item.shares.get(segment.instance, {})))
        if self._is_panoptic:
            rows = [_segment_info(segment.instance, segment.label, segment.pixels, segment.box) for segment in item.segments]
            rows += [_segment_info(STUFF + stuff.label, stuff.label, stuff.pixels, stuff.box) for stuff in item.stuff]
            name = Path(item.row["file_name"]).with_suffix(".png").name
            self._lists["panoptic"].add({"image_id": number, "file_name": name, "segments_info": rows})

    def finish(self) -> tuple[str, ...]:
        """Write the JSON files."""
        ending = f"_{self.source.split}.json" if self.source.split else ".json"
        names, folder = dict(sorted(self._names.items())), self.out / "annotations"
        write_document(folder / f"instances{ending}", coco_head(names), {key: self._lists[name] for key, name in _INSTANCES.items()})
        if self._is_panoptic:
            head = coco_head(names)
            for row in head["categories"]:
                row["isthing"] = int(row["name"] not in _STUFF_NAMES)
            write_document(folder / f"panoptic{ending}", head, {key: self._lists[name] for key, name in _PANOPTIC.items()})
        for rows in self._lists.values():
            rows.close().unlink()
        return super().finish()


def class_names(frame: Frame) -> dict[int, str]:
    """Return class id -> name: all of the standard where classes are recorded, else those of the objects."""
    try:
        return {key: str(row["name"]) for key, row in frame.labels("semantic").items()}
    except SceneSynthError:
        rows = frame.labels("instance").values()
        return {int(row["class"]): str(row["class_name"]) for row in rows if "class_name" in row}  # type: ignore[call-overload]


def segments_of(instance: NDArray[np.uint16], classes: Mapping[int, int]) -> list[Segment]:
    """Return the objects of an instance image (height, width), by id; ``classes``: object -> class, 0 where it is not known."""
    columns = np.ascontiguousarray(instance.T)
    return [
        Segment(key, classes.get(key, 0), int(tally[COUNT]), pixel_box(tally), mask_of(columns, key, int(tally[LEFT]), int(tally[RIGHT])))
        for key, tally in _tallies(instance).items()
    ]


def panoptic_pixels(instance: NDArray[np.uint16], stuff: NDArray[np.uint16]) -> NDArray[np.uint8]:
    """Return the ids of segments as colours (height, width, 3): objects, and classes where there is none; black where both are 0."""
    low = np.where(instance > 0, instance, stuff)
    return np.stack([low & 255, low >> 8, (stuff > 0) * (STUFF >> 16)], axis=-1).astype(np.uint8)


def _tallies(ids: NDArray[np.uint16]) -> dict[int, NDArray[np.int64]]:
    """Return id -> tally of every id but 0 that has a pixel."""
    height, width = ids.shape
    tallies = empty_tally(int(ids.max()) + 1, width, height)
    tally_ids(ids, tallies)
    return {int(key): tallies[key] for key in np.flatnonzero(tallies[:, COUNT]) if key}


def _segment_info(key: int, label: int, pixels: int, box: Box2D) -> dict[str, Any]:
    corners = [int(box.x), int(box.y), int(box.width), int(box.height)]
    return {"id": key, "category_id": label, "area": pixels, "bbox": corners, "iscrowd": 0}


class JsonRows:
    """A list of a JSON document in the making, in a file of its own, so that memory does not grow with it.

    Args:
        path: of that file, which its owner removes.
    """

    def __init__(self, path: Path) -> None:
        self._path, self._file = path, path.open("wb")
        self.count = 0

    def add(self, row: Any) -> None:
        """Append a row."""
        self._file.write((b",\n" if self.count else b"") + json.dumps(row).encode())
        self.count += 1

    def close(self) -> Path:
        """Return the file, with all rows in it."""
        self._file.close()
        return self._path


def write_document(path: Path, head: Mapping[str, Any], lists: Mapping[str, JsonRows]) -> None:
    """Write a document: what ``head`` has, then the lists, by their names.

    Raises:
        OSError: a file cannot be written.
    """
    with path.open("wb") as document:
        document.write(json.dumps(head).removesuffix("}").encode())
        for name, rows in lists.items():
            document.write(b", " + json.dumps(name).encode() + b": [\n")
            with rows.close().open("rb") as part:
                shutil.copyfileobj(part, document)
            document.write(b"\n]")
        document.write(b"}\n")
