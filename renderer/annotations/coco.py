"""Annotations of frames as one file in the form of COCO's instances, as pycocotools reads it (cocodataset.org, "Data format").

Categories are the classes of the label standard that the frames were annotated in, under their ids.  ``bbox`` is the visible box, ``area``
the number of visible pixels.  Beyond COCO's own keys an annotation has ``instance_id``, ``visible_fraction`` and ``truncation``.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from renderer.core.errors import RenderError
from scene_description.annotations import Box2D, FrameAnnotations, Mask, ObjectAnnotation
from scene_description.label_standards import StandardName, label_standard


class CocoImage(NamedTuple):
    """A frame of the file: the name of its picture, and what is told of it, with masks."""

    file_name: str
    annotations: FrameAnnotations


class Segment(NamedTuple):
    """The visible pixels of an object: its id, its class, how many pixels, the box around them, and their mask."""

    instance: int
    label: int
    pixels: int
    box: Box2D
    mask: Mask


def coco_instances(images: Sequence[CocoImage], classes: StandardName = "nyu40") -> dict[str, Any]:
    """Return the content of the file; images and annotations are numbered from 1.  ``classes``: as of the ``Annotator``.

    Raises:
        RenderError: an object has no mask.
    """
    rows = [(number, item) for number, image in enumerate(images, start=1) for item in image.annotations.objects]
    head = coco_head({key: label.name for key, label in label_standard(classes).classes.items()})
    return {
        "info": head["info"],
        "licenses": head["licenses"],
        "images": [
            image_row(number, name, told.width, told.height, told.scene, told.stamp_ns)
            for number, (name, told) in enumerate(images, start=1)
        ],
        "annotations": [segment_row(number, image, _segment(item), seen_share(item)) for number, (image, item) in enumerate(rows, start=1)],
        "categories": head["categories"],
    }


def coco_head(categories: Mapping[int, str]) -> dict[str, Any]:
    """Return what a file has besides its images and annotations; ``categories``: id -> name."""
    return {
        "info": {"description": "scene_synth_ros", "version": "1"},
        "licenses": [],
        "categories": [{"id": key, "name": name, "supercategory": "indoor"} for key, name in categories.items()],
    }


def image_row(number: int, file_name: str, width: int, height: int, scene: str, stamp_ns: int) -> dict[str, Any]:
    """Return the row of an image."""
    return {"id": number, "file_name": file_name, "width": width, "height": height, "scene": scene, "stamp_ns": stamp_ns}


def segment_row(number: int, image: int, segment: Segment, shares: Mapping[str, float]) -> dict[str, Any]:
    """Return the row of an object in an image; ``shares``: as of :func:`seen_share`, empty where they are not known."""
    box, mask = segment.box, segment.mask
    return {
        "id": number,
        "image_id": image,
        "category_id": segment.label,
        "bbox": [box.x, box.y, box.width, box.height],
        "area": segment.pixels,
        "segmentation": {"size": list(mask.size), "counts": mask.counts},
        "iscrowd": 0,
        "instance_id": segment.instance,
        **shares,
    }


def seen_share(item: ObjectAnnotation) -> dict[str, float]:
    """Return how much of an object is seen, and how much of it lies outside the image."""
    return {"visible_fraction": item.visible_fraction, "truncation": item.truncation}


def _segment(item: ObjectAnnotation) -> Segment:
    if item.mask is None:
        raise RenderError(f"COCO: expected masks, got none of object {item.id}; annotate with masks")
    return Segment(item.id, item.label, item.visible_pixels, item.visible_box, item.mask)
