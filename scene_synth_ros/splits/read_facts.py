"""Reads from frames of a dataset what filters and the search for near-equal views ask."""

from __future__ import annotations

from collections.abc import Set as AbstractSet
from typing import TYPE_CHECKING, Literal

from scene_description.labels import instance_labels
from scene_synth_ros.splits.errors import SplitError
from scene_synth_ros.splits.filters import Need
from scene_synth_ros.splits.frame_facts import FrameFacts, SeenObject, seen_objects, small_ids, small_luma

if TYPE_CHECKING:
    from scene_synth_ros.dataset import Frame

Wanted = Need | Literal["pose", "ids", "thumbnail"]
"""What of a frame is read: what filters need, and for near-equal views its pose and small pictures."""


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
    )


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
