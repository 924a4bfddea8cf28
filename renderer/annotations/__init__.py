"""What is told of the objects of a frame: boxes, shares, key points, relations, masks, and COCO's file of them."""

from renderer.annotations.annotator import Annotator

__all__ = ["Annotator"]
