"""What is told of the objects that a frame shows, ``scene_synth_annotations/1``: boxes, key points, shares, relations, masks.

Pixels are image coordinates: the image spans [0, width] x [0, height], so the pixel in column c spans [c, c + 1] and has its centre at
c + 0.5.  Optical frame: x right, y down, z forward, at the pose of the frame's stamp.  An object's own frame has its front along +x.
"""

import json
from dataclasses import dataclass
from typing import Annotated, Final, Literal

from scene_description.strict import Limits, from_json, to_mapping
from scene_description.types import Length, Name, ObjectId, QuaternionItem, Unit

ANNOTATIONS_SCHEMA: Final = "scene_synth_annotations/1"
MAX_TEXT_LENGTH = 32_000_000

Pixels = Annotated[float, Limits(ge=-1e9, le=1e9, unit="px")]
Extent = Annotated[float, Limits(ge=0.0, le=1e9, unit="px")]
Metres = Annotated[float, Limits(ge=-10_000.0, le=10_000.0, unit="m")]
Count = Annotated[int, Limits(ge=0, le=2**40)]
Side = Annotated[int, Limits(ge=1, le=65535, unit="px")]
RelationKind = Literal["on", "on_floor", "on_wall", "on_ceiling", "in_wall", "in_group"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Box2D:
    """A rectangle of the image plane, in image coordinates: its left and upper side, its width and height."""

    x: Pixels
    y: Pixels
    width: Extent
    height: Extent


@dataclass(frozen=True, slots=True, kw_only=True)
class OrientedBox:
    """A box: its centre, its (depth, width, height) along its own x, y and z, and the unit quaternion (x, y, z, w) that turns it."""

    center_m: tuple[Metres, Metres, Metres]
    size_m: tuple[Length, Length, Length]
    orientation: tuple[QuaternionItem, QuaternionItem, QuaternionItem, QuaternionItem]


@dataclass(frozen=True, slots=True, kw_only=True)
class KeyPoint:
    """A corner of an object's oriented box, as the camera sees it.

    ``u_px`` and ``v_px`` are its place in image coordinates, inside the image or not; None behind a camera whose lens sees only what lies
    before it.  ``depth_m`` runs along the optical z; ``behind``: it is not positive.  ``occluded``: a surface,
    of this object or of another, lies between the camera and the corner, more than 5 mm before it.
    """

    depth_m: Metres
    in_image: bool
    behind: bool
    occluded: bool
    u_px: Pixels | None = None
    v_px: Pixels | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Mask:
    """Which pixels an object has, as COCO's compressed run lengths: (height, width), and the string of counts by columns."""

    size: tuple[Side, Side]
    counts: Annotated[str, Limits(max_length=4_000_000)]


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectAnnotation:
    """One piece of furniture or one opening that has at least one pixel of the frame.

    ``visible_box`` bounds its pixels, ``full_box`` what it would cover if it were alone and the image had no border.  ``full_pixels``
    counts the pixels that it would cover if it were alone; ``visible_fraction`` is the share of these that it has.  ``truncation`` is the
    share of the full box that lies outside the image, 0 to 1, as in KITTI.

    ``corners`` are those of its box, first the lower four, counter-clockwise seen from above, from the one at the back on the right
    (-x, -y), then the upper four in the same order.
    """

    id: ObjectId
    category: Name
    label: Annotated[int, Limits(ge=0, le=255)]
    label_name: Name
    visible_box: Box2D
    full_box: Box2D
    visible_pixels: Count
    full_pixels: Count
    visible_fraction: Unit
    truncation: Unit
    camera_box: OrientedBox
    world_box: OrientedBox
    corners: Annotated[tuple[KeyPoint, ...], Limits(min_length=8, max_length=8)]
    mask: Mask | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Relation:
    """What joins an object to another, ``object``, or to a surface of the room; both objects are in the frame.

    ``on``: it rests on the other; ``on_floor``, ``on_ceiling``: on these; ``on_wall``: it hangs on the polygon edge ``wall``; ``in_wall``:
    it is an opening in it; ``in_group``: it belongs to the functional group whose core the other is (its address terminal).
    """

    subject: ObjectId
    kind: RelationKind
    object: ObjectId | None = None
    wall: Annotated[int, Limits(ge=0, le=255)] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameAnnotations:
    """All of a frame: its stamp, the id of its scene, the image's size, objects by ascending id, relations by ascending subject."""

    schema: Literal["scene_synth_annotations/1"] = ANNOTATIONS_SCHEMA
    stamp_ns: Annotated[int, Limits(ge=0, le=2**62, unit="ns")]
    scene: Name
    width: Side
    height: Side
    objects: Annotated[tuple[ObjectAnnotation, ...], Limits(max_length=65535)]
    relations: Annotated[tuple[Relation, ...], Limits(max_length=4 * 65535)]


def annotations_to_json(annotations: FrameAnnotations) -> str:
    """Return the JSON text: fields in the order of the types, those that are None left out, one line."""
    return json.dumps(to_mapping(annotations), allow_nan=False, separators=(",", ":"))


def annotations_from_json(text: str | bytes) -> FrameAnnotations:
    """Read the annotations of a frame.

    Raises:
        FieldError: the text is too long, is no JSON, has another schema, or a field does not fit; one line with the field's path.
    """
    return from_json(FrameAnnotations, text, "annotations", MAX_TEXT_LENGTH)
