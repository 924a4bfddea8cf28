"""Annotations of frames as one file in the form of COCO's instances, as pycocotools reads it (cocodataset.org, "Data format").

Categories are the classes of the label standard that the frames were annotated in, under their ids.  ``bbox`` is the visible box, ``area``
the number of visible pixels.  Beyond COCO's own keys an annotation has ``instance_id``, ``visible_fraction`` and ``truncation``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from renderer.core.errors import RenderError
from scene_description.annotations import FrameAnnotations, ObjectAnnotation
from scene_description.label_standards import StandardName, label_standard


class CocoImage(NamedTuple):
    """A frame of the file: the name of its picture, and what is told of it, with masks."""

    file_name: str
    annotations: FrameAnnotations


def coco_instances(images: Sequence[CocoImage], classes: StandardName = "nyu40") -> dict[str, Any]:
    """Return the content of the file; images and annotations are numbered from 1.  ``classes``: as of the ``Annotator``.

    Raises:
        RenderError: an object has no mask.
    """
    categories = label_standard(classes).classes
    rows = [(number, item) for number, image in enumerate(images, start=1) for item in image.annotations.objects]
    return {
        "info": {"description": "scene_synth_ros", "version": "1"},
        "licenses": [],
        "images": [
            {"id": number, "file_name": name, "width": told.width, "height": told.height, "scene": told.scene, "stamp_ns": told.stamp_ns}
            for number, (name, told) in enumerate(images, start=1)
        ],
        "annotations": [_annotation(number, image, item) for number, (image, item) in enumerate(rows, start=1)],
        "categories": [{"id": key, "name": label.name, "supercategory": "indoor"} for key, label in categories.items()],
    }


def _annotation(number: int, image: int, item: ObjectAnnotation) -> dict[str, Any]:
    if item.mask is None:
        raise RenderError(f"COCO: expected masks, got none of object {item.id}; annotate with masks")
    box = item.visible_box
    return {
        "id": number,
        "image_id": image,
        "category_id": item.label,
        "bbox": [box.x, box.y, box.width, box.height],
        "area": item.visible_pixels,
        "segmentation": {"size": list(item.mask.size), "counts": item.mask.counts},
        "iscrowd": 0,
        "instance_id": item.id,
        "visible_fraction": item.visible_fraction,
        "truncation": item.truncation,
    }
