"""What filters and the search for near-equal views ask of a frame: a few numbers and two small pictures, read from the dataset."""

from __future__ import annotations

from collections.abc import Mapping
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from scene_description.labels import instance_labels
from scene_description.products import matmul
from scene_synth_ros.splits.assignment import SplitError

if TYPE_CHECKING:
    from scene_synth_ros.dataset import Frame


GRID = (24, 32)
"""Rows and columns of the small pictures."""
Need = Literal["instance", "color", "settings", "annotations"]
"""What a filter needs: a layer, or what goes with every frame."""
Wanted = Need | Literal["pose", "ids", "thumbnail", "classes"]
"""What of a frame is read: what filters need, for near-equal views its pose and small pictures, for a balance its classes."""
_LUMA = np.array([0.2126, 0.7152, 0.0722])


@dataclass(frozen=True, slots=True, kw_only=True)
class SeenObject:
    """An object in a frame.

    Attributes:
        category: as in the scene description.
        image_share: of the image's pixels that are the object's.
        visible_fraction: of the object's own pixels that nothing hides, as the annotations have it; None where they are not recorded.
    """

    category: str
    image_share: float
    visible_fraction: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameFacts:
    """What filters ask of a frame; None is what was not asked for or is not recorded.

    Attributes:
        number: of the frame in its room, from 0.
        objects: those in view, the room's shell not among them.
        brightness: mean of the colour's luma, 0 to 1.
        exposure_ev100: that the colour was exposed with.
        position_m: of the camera in the map, (3,).
        axes: rotation of the optical frame in the map, (3, 3).
        ids: object ids at the points of ``GRID``.
        thumbnail: luma at the points of ``GRID``, 0 to 255, uint8; means over cells.
        classes: name -> pixels, void left out.
    """

    number: int
    objects: tuple[SeenObject, ...] | None = None
    brightness: float | None = None
    exposure_ev100: float | None = None
    position_m: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    axes: NDArray[np.float64] = field(default_factory=lambda: np.eye(3))
    ids: NDArray[np.uint16] | None = None
    thumbnail: NDArray[np.uint8] | None = None
    classes: Mapping[str, int] | None = None


def small_luma(color: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the mean luma (Rec. 709) of each cell of ``GRID`` of a colour image (height, width, 3), rounded; no cell is empty."""
    rows, columns = _edges(color.shape[0], GRID[0]), _edges(color.shape[1], GRID[1])
    sums = np.add.reduceat(np.add.reduceat(color.astype(np.uint32), rows[:-1], axis=0), columns[:-1], axis=1)
    counts = np.diff(rows)[:, None] * np.diff(columns)[None, :]
    return np.asarray(np.rint(matmul(sums, _LUMA) / counts), np.uint8)


def small_ids(ids: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Return the ids in the middle of each cell of ``GRID`` of an image (height, width)."""
    rows, columns = _edges(ids.shape[0], GRID[0]), _edges(ids.shape[1], GRID[1])
    return np.asarray(ids[np.ix_((rows[:-1] + rows[1:]) // 2, (columns[:-1] + columns[1:]) // 2)])


def seen_objects(
    ids: NDArray[np.uint16], categories: Mapping[int, str], fractions: Mapping[int, float] | None = None
) -> tuple[SeenObject, ...]:
    """Return the objects of an id image, by id.

    Args:
        ids: (height, width); 0 is the shell.
        categories: id -> category; ids that it does not know are no objects.
        fractions: id -> visible fraction, where annotations tell it.
    """
    counts = np.bincount(ids.ravel())
    told = fractions or {}
    return tuple(
        SeenObject(category=categories[number], image_share=float(counts[number]) / ids.size, visible_fraction=told.get(number))
        for number in map(int, np.flatnonzero(counts))
        if number and number in categories
    )


def _edges(length: int, cells: int) -> NDArray[np.intp]:
    """Return the first pixel of each cell and the end; a side shorter than the grid has a cell for each pixel."""
    return np.linspace(0, length, min(cells, length) + 1).astype(np.intp)


def facts_of(frame: Frame, wanted: AbstractSet[Wanted]) -> FrameFacts:
    """Return what is wanted of a frame.

    Raises:
        SplitError: the settings or annotations that a filter needs were not recorded.
        DatasetError: another part of the frame cannot be read.
    """
    luma = small_luma(frame["color"]) if wanted & {"color", "thumbnail"} else None
    pose = frame.matrix if "pose" in wanted else None
    return FrameFacts(
        number=frame.number,
        objects=_objects(frame, "annotations" in wanted) if "instance" in wanted else None,
        brightness=float(luma.mean()) / 255.0 if luma is not None else None,
        exposure_ev100=_exposure(frame) if "settings" in wanted else None,
        **({} if pose is None else {"position_m": pose[:3, 3], "axes": pose[:3, :3]}),
        ids=small_ids(frame["instance"]) if "ids" in wanted else None,
        thumbnail=luma if "thumbnail" in wanted else None,
        classes=_classes(frame) if "classes" in wanted else None,
    )


def _classes(frame: Frame) -> dict[str, int]:
    names = {int(number): str(row["name"]) for number, row in frame.labels("semantic").items()}
    ids, counts = np.unique(frame["semantic"], return_counts=True)
    return {names.get(number, f"class {number}"): count for number, count in zip(ids.tolist(), counts.tolist(), strict=True) if number}


def _objects(frame: Frame, annotated: bool) -> tuple[SeenObject, ...]:
    categories = {number: str(row["name"]) for number, row in instance_labels(frame.scene).items() if number}
    fractions = None
    if annotated:
        if frame.detections is None:
            raise SplitError(
                f"{frame}: --visible-fraction needs annotations, got none; record them: -p renderer_node.streams.annotations:=true"
            )
        fractions = {item.id: item.visible_fraction for item in frame.detections.objects}
    return seen_objects(frame["instance"], categories, fractions)


def _exposure(frame: Frame) -> float:
    told = (frame.settings or {}).get("exposure_ev100")
    if not isinstance(told, int | float):
        raise SplitError(f"{frame}: --ev100 needs the exposure in the renderer's settings, got none; record the topic <renderer>/settings")
    return float(told)
