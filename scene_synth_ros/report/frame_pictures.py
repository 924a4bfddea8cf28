"""Pictures of the worst frames: colour, truth, estimate and error, the error on one scale for all frames of a task."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image as Picture

from renderer import LAYERS
from scene_synth_ros.bags.bag_images import layer_picture
from scene_synth_ros.pages.document import data_uri
from scene_synth_ros.report.error_images import ERROR_IMAGES, ErrorImage, confusions, error_picture, legend, same_size, scale_end
from scene_synth_ros.report.frame_images import Images, TopicsOf, class_names, estimate_topics, fits, frame_images, reduced, truth_topics

Pixels = NDArray[Any]
COLOR = "color"
_Request = tuple[Path, list[str], int, str, TopicsOf]
"""Bag, layers, stamp, what tells the topics apart, what finds them."""


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
class _Frame:
    """Pixels of a frame, reduced."""

    color: Pixels | None = None
    truth: Pixels | None = None
    estimate: Pixels | None = None
    error: Pixels | None = None
    pictures: dict[str, str] = field(default_factory=dict)


def frame_pictures(wanted: Sequence[Wanted], max_size: int, max_bytes: int, progress: Callable[[str], None]) -> FramePictures:
    """Take the images of frames from their bags and return their pictures.

    Args:
        wanted: the frames.
        max_size: pixels of a picture's longer side.
        max_bytes: of all pictures; later frames have none.
        progress: told the bag that is read.
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


def _words(wanted: Wanted, frame: _Frame) -> str:
    if wanted.task != "semantic" or frame.truth is None or frame.estimate is None:
        return ""
    return confusions(frame.truth, frame.estimate, class_names(wanted.bag))


def _layers(task: str) -> list[str]:
    return [COLOR, ERROR_IMAGES[task].layer] if task in ERROR_IMAGES else [COLOR]


def _estimate(wanted: Wanted) -> _Request:
    """Return what to read for an estimate."""
    assert wanted.estimates is not None
    layer = ERROR_IMAGES[wanted.task].layer
    topics = estimate_topics(wanted.topic, layer, wanted.camera, same_bag=wanted.estimates == wanted.bag)
    return wanted.estimates, [layer], wanted.stamp_ns, _name(wanted, layer), topics


def _name(wanted: Wanted, layer: str) -> str:
    return f"{wanted.topic} {wanted.camera} {layer}"


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


def _frame(wanted: Wanted, truths: Mapping[tuple[Path, str], Images], guesses: Mapping[tuple[Path, str], Images], max_size: int) -> _Frame:
    images = truths[wanted.bag, wanted.camera][wanted.stamp_ns]
    frame, color, row = _Frame(), images.get(COLOR), ERROR_IMAGES.get(wanted.task)
    if color is not None and (color.ndim == 2 or color.shape[2] == 3):
        frame.color = reduced(color, max_size)
    if row is None or not fits(images.get(row.layer), row.layer):
        return frame
    truth = images[row.layer]
    frame.truth = row.read(reduced(truth, max_size))
    guess = guesses[wanted.estimates, _name(wanted, row.layer)][wanted.stamp_ns].get(row.layer) if wanted.estimates else None
    if guess is not None and fits(guess, row.layer):
        frame.estimate = row.match(frame.truth, row.read(reduced(same_size(truth, guess), max_size)))
        with np.errstate(all="ignore"):
            frame.error = row.of(frame.truth, frame.estimate)
    return frame


def _pictures(frame: _Frame, row: ErrorImage | None, end: float) -> dict[str, str]:
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
