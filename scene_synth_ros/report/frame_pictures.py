"""Pictures of the worst frames: colour, truth, estimate and error, the error on one scale for all frames of a task."""

import json
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image as Picture

from renderer import LAYERS
from scene_synth_ros.bags.bag_images import has_channels, layer_picture, layer_topics
from scene_synth_ros.bags.bag_reader import BagReader, BagReadError
from scene_synth_ros.bags.indexed_bag import IndexedBag, MessageReadError, open_bag
from scene_synth_ros.mcap.contents import McapReadError
from scene_synth_ros.messages.cdr import CdrReadError, read_text
from scene_synth_ros.messages.image_reader import CodecError
from scene_synth_ros.messages.streams import ESTIMATES, IMAGE_FORMS, LABELS, Stream, find_streams
from scene_synth_ros.pages.document import data_uri
from scene_synth_ros.report.error_images import ERROR_IMAGES, ErrorImage, confusions, error_picture, legend, same_size, scale_end

Images = dict[int, dict[str, NDArray[Any]]]
"""Stamp -> layer -> pixels."""
TopicsOf = Callable[[Mapping[str, str]], Mapping[str, str]]
"""Topic -> type of a bag -> layer -> the topic to take it from."""

_UNREADABLE = (CodecError, CdrReadError, MessageReadError, RuntimeError, ValueError, KeyError, IndexError, TypeError, OverflowError)
"""What a message that was damaged, or made to do harm, may raise while it is read."""


def _is_estimate(stream: Stream) -> bool:
    return f"{stream.base}/".startswith(f"{ESTIMATES}/")


def truth_topics(camera: str) -> TopicsOf:
    """Return what finds the topics of the truth, of a camera by its name; empty: of the first."""

    def find(types: Mapping[str, str]) -> Mapping[str, str]:
        images = {name: stream for name, stream in find_streams(types, *IMAGE_FORMS).items() if not _is_estimate(stream)}
        return layer_topics({name: types[name] for name, stream in images.items() if not camera or stream.is_of(camera)})

    return find


def estimate_topics(chosen: str, layer: str, *, same_bag: bool) -> TopicsOf:
    """Return what finds the topic of the estimates of a layer: the chosen one, else that of estimates.

    Else it is, in a bag of estimates, the layer's own name; in the bag of the truth there is none.
    """

    def find(types: Mapping[str, str]) -> Mapping[str, str]:
        if chosen:
            return {layer: chosen}
        named = layer_topics({name: types[name] for name, stream in find_streams(types, *IMAGE_FORMS).items() if _is_estimate(stream)})
        return named if layer in named or same_bag else layer_topics(types)

    return find


def frame_images(bag: Path, layers: Collection[str], stamps: Collection[int], topics_of: TopicsOf) -> tuple[Images, list[str]]:
    """Return the images of some frames, and lines for people about what is missing."""
    found: Images = {stamp: {} for stamp in stamps}
    notes: list[str] = []
    try:
        opened = open_bag(bag)
        topics = {layer: topic for layer, topic in topics_of(opened.types).items() if layer in layers and topic in opened.types}
        opened.prepare(topics.values())
        for layer, topic in topics.items():
            for stamp in stamps:
                try:
                    if (topic, stamp) in opened:
                        found[stamp][layer] = _image(opened, topic, stamp)
                except _UNREADABLE as error:
                    notes.append(f"{bag}: {topic}: an image cannot be shown ({' '.join(str(error).split())[:100]})")
    except (BagReadError, McapReadError, OSError) as error:
        notes.append(" ".join(str(error).split())[:300])
    return found, notes


def _image(bag: IndexedBag, topic: str, stamp: int) -> NDArray[Any]:
    pixels = bag.image(topic, stamp).pixels
    if not pixels.size or pixels.dtype.kind not in "uif":
        raise ValueError("an image without numbers")
    return pixels


def class_names(bag: Path) -> dict[int, str]:
    """Return the names of the classes as the labels of a bag tell them, nothing where it has none."""
    try:
        with BagReader(bag) as reader:
            topics = [topic for topic, stream in find_streams(reader.types, LABELS).items() if stream.layer == "semantic"]
            message = next(reader.messages(topics), None) if topics else None
            labels = json.loads(read_text(message.data))["labels"] if message else {}
            return {int(key): str(row["name"])[:100].replace("_", " ") for key, row in labels.items()}
    except (BagReadError, OSError, AttributeError, *_UNREADABLE):
        return {}


def reduced(pixels: NDArray[Any], max_size: int) -> NDArray[Any]:
    """Return an image whose longer side has at most so many pixels; whole rows and columns are left out, evenly."""
    step = max(1.0, max(pixels.shape[:2]) / max_size)
    rows, columns = (np.minimum(((np.arange(max(1, round(n / step))) + 0.5) * step).astype(np.int64), n - 1) for n in pixels.shape[:2])
    smaller: NDArray[Any] = pixels[rows][:, columns]
    return smaller


Pixels = NDArray[Any]
COLOR = "color"
_Request = tuple[Path, list[str], int, str, TopicsOf]
"""Bag, layers, stamp, what tells the topics apart, what finds them."""
_ImagesOf = Mapping[tuple[Path, str], Images]
"""(bag, name of the topics) -> images."""


class Wanted(NamedTuple):
    """A frame of a task.

    Attributes:
        task: whose.
        stamp_ns: of the frame.
        bag: of the frame; ``camera`` is the name of the camera that was judged, "" for the first.
        estimates: bag of the estimate, None where none is known; ``topic`` is the one that was chosen, "" for none.
    """

    task: str
    stamp_ns: int
    bag: Path
    camera: str
    estimates: Path | None
    topic: str


@dataclass(frozen=True, slots=True, kw_only=True)
class FramePictures:
    """Pictures of frames.

    Attributes:
        frames: in their order, name -> ``data:`` address.
        words: what is told of each frame's error, "" for nothing.
        legends: the scale of each task's errors.
        notes: lines for people about what is missing.
    """

    frames: tuple[Mapping[str, str], ...]
    words: tuple[str, ...]
    legends: Mapping[str, Mapping[str, Any]]
    notes: tuple[str, ...]


@dataclass(slots=True)
class _FramePixels:
    """Pixels of a frame, reduced."""

    color: Pixels | None = None
    truth: Pixels | None = None
    estimate: Pixels | None = None
    error: Pixels | None = None
    pictures: dict[str, str] = field(default_factory=dict)


def frame_pictures(wanted: Sequence[Wanted], max_size: int, max_bytes: int, progress: Callable[[str], None]) -> FramePictures:
    """Take the images of frames from their bags and return their pictures.

    ``max_bytes`` bounds all pictures; later frames have none.
    """
    notes: list[str] = []
    truths = _read([(w.bag, _layers(w.task), w.stamp_ns, w.camera, truth_topics(w.camera)) for w in wanted], notes, progress)
    guesses = _read([_estimate(w) for w in wanted if w.estimates and w.task in ERROR_IMAGES], notes, progress)
    frames = [_frame(w, truths, guesses, max_size) for w in wanted]
    for w, frame in zip(wanted, frames, strict=True):
        if w.task in ERROR_IMAGES and frame.truth is not None and w.estimates not in (None, w.bag) and frame.estimate is None:
            notes.append(f"{w.estimates}: no estimate of {w.task} at {w.stamp_ns} ns that fits the truth")
    legends, left = {}, max_bytes
    for task in dict.fromkeys(w.task for w in wanted):
        row = ERROR_IMAGES.get(task)
        own = [frame for w, frame in zip(wanted, frames, strict=True) if w.task == task]
        end = scale_end([frame.error for frame in own if frame.error is not None])
        if row is not None and any(frame.error is not None for frame in own):
            legends[task] = legend(row, end)
        for frame in own:
            if left > 0:
                frame.pictures = _pictures(frame, row, end)
                left -= sum(map(len, frame.pictures.values()))
    if left <= 0:
        notes.append("the pictures have their largest size; further frames have none: give --worst or --max-size a smaller number")
    return FramePictures(
        frames=tuple(frame.pictures for frame in frames),
        words=tuple(_words(w, frame) for w, frame in zip(wanted, frames, strict=True)),
        legends=legends,
        notes=tuple(dict.fromkeys(notes)),
    )


def _words(wanted: Wanted, frame: _FramePixels) -> str:
    if wanted.task != "semantic" or frame.truth is None or frame.estimate is None:
        return ""
    return confusions(frame.truth, frame.estimate, class_names(wanted.bag))


def _layers(task: str) -> list[str]:
    return [COLOR, ERROR_IMAGES[task].layer] if task in ERROR_IMAGES else [COLOR]


def _estimate(wanted: Wanted) -> _Request:
    """Return what to read for an estimate."""
    assert wanted.estimates is not None
    layer = ERROR_IMAGES[wanted.task].layer
    topics = estimate_topics(wanted.topic, layer, same_bag=wanted.estimates == wanted.bag)
    return wanted.estimates, [layer], wanted.stamp_ns, _name(wanted, layer), topics


def _name(wanted: Wanted, layer: str) -> str:
    return f"{wanted.topic} {layer}"


def _read(requests: Sequence[_Request], notes: list[str], progress: Callable[[str], None]) -> dict[tuple[Path, str], Images]:
    """Return (bag, name of the topics) -> images; each bag is read once for each way to find topics."""
    groups: dict[tuple[Path, str], tuple[set[str], set[int], TopicsOf]] = {}
    for bag, layers, stamp, name, topics in requests:
        names, stamps, _ = groups.setdefault((bag, name), (set(), set(), topics))
        names.update(layers)
        stamps.add(stamp)
    images = {}
    for (bag, name), (names, stamps, topics) in groups.items():
        progress(bag.name)
        images[bag, name], told = frame_images(bag, names, stamps, topics)
        notes += told
    return images


def _frame(wanted: Wanted, truths: _ImagesOf, guesses: _ImagesOf, max_size: int) -> _FramePixels:
    images = truths[wanted.bag, wanted.camera][wanted.stamp_ns]
    frame, color, row = _FramePixels(), images.get(COLOR), ERROR_IMAGES.get(wanted.task)
    if color is not None and (color.ndim == 2 or color.shape[2] == 3):
        frame.color = reduced(color, max_size)
    if row is None or not (row.layer in images and has_channels(images[row.layer], row.layer)):
        return frame
    truth = images[row.layer]
    frame.truth = row.read(reduced(truth, max_size))
    guess = guesses[wanted.estimates, _name(wanted, row.layer)][wanted.stamp_ns].get(row.layer) if wanted.estimates else None
    if guess is not None and has_channels(guess, row.layer):
        frame.estimate = row.match(frame.truth, row.read(reduced(same_size(truth, guess), max_size)))
        with np.errstate(all="ignore"):
            frame.error = row.of(frame.truth, frame.estimate)
    return frame


def _pictures(frame: _FramePixels, row: ErrorImage | None, end: float) -> dict[str, str]:
    """Return the pictures of a frame; truth and estimate are coloured as one image, so that equal colours mean equal values."""
    found = {}
    if frame.color is not None:
        found[COLOR] = _address(np.minimum(frame.color, 255).astype(np.uint8), "JPEG")
    if row is None or frame.truth is None:
        return found
    kind = "PNG" if LAYERS[row.layer].labels is not None else "JPEG"
    both = [frame.truth] if frame.estimate is None else [frame.truth, frame.estimate]
    with np.errstate(all="ignore"):
        colored = np.split(layer_picture(LAYERS[row.layer], np.concatenate(both)), len(both))
    found |= {name: _address(pixels, kind) for name, pixels in zip(("truth", "estimate"), colored, strict=False)}
    if frame.error is not None:
        found["error"] = _address(error_picture(frame.error, row, end), kind)
    return found


def _address(pixels: Pixels, kind: str) -> str:
    return data_uri(Picture.fromarray(np.ascontiguousarray(pixels)), kind)
