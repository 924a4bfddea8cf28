"""What is told of the objects of a frame: boxes, shares, key points, relations, masks, and COCO's file of them."""

from renderer.annotations.annotator import Annotator
from renderer.annotations.pixels import warm_up

__all__ = ["Annotator", "warm_up"]
