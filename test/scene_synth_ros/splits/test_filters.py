"""What is told of a frame, and which filter leaves it out."""

import math

import numpy as np
import pytest

from scene_synth_ros.splits.assignment import SplitError
from scene_synth_ros.splits.filters import Asked, needs_of, read_interval, refused_by
from scene_synth_ros.splits.frame_facts import GRID, FrameFacts, SeenObject, seen_objects, small_ids, small_luma

BED = SeenObject(category="bed", image_share=0.3, visible_fraction=0.9)
LAMP = SeenObject(category="desk_lamp", image_share=0.001, visible_fraction=0.2)
FACTS = FrameFacts(number=0, objects=(BED, LAMP), brightness=0.4, exposure_ev100=6.5)


@pytest.mark.parametrize(
    ("asked", "refused"),
    [
        (Asked(), []),
        (Asked(sees=(("bed", "sofa"),)), []),
        (Asked(sees=(("bed",), ("sofa",))), ["sees"]),
        (Asked(sees=(("desk_lamp",),), image_share=0.01), ["sees"]),
        (Asked(sees=(("desk_lamp",),), visible_fraction=0.2), []),
        (Asked(sees=(("desk_lamp",),), visible_fraction=0.21), ["sees"]),
        (Asked(objects=(2.0, math.inf)), []),
        (Asked(objects=(2.0, math.inf), image_share=0.01), ["objects"]),
        (Asked(brightness=(0.0, 0.39), exposure_ev100=(7.0, 9.0)), ["brightness", "ev100"]),
    ],
)
def test_filters(asked: Asked, refused: list[str]) -> None:
    assert refused_by(FACTS, asked) == refused


def test_only_what_is_asked_for_must_be_recorded() -> None:
    assert needs_of(Asked(room_types=("kitchen",))) == set()
    assert needs_of(Asked(sees=(("bed",),), visible_fraction=0.5)) == {"instance", "annotations"}
    assert needs_of(Asked(brightness=(0.1, 0.9), exposure_ev100=(1.0, 2.0))) == {"color", "settings"}


def test_objects_of_an_id_image() -> None:
    ids = np.zeros((10, 20), np.uint16)
    ids[:5, :10], ids[9, 19], ids[0, 19] = 7, 300, 9
    found = seen_objects(ids, {7: "bed", 300: "lamp"}, {7: 0.5})
    assert found == (
        SeenObject(category="bed", image_share=0.25, visible_fraction=0.5),
        SeenObject(category="lamp", image_share=1 / 200, visible_fraction=None),
    )


def test_small_pictures() -> None:
    height, width = 2 * GRID[0], 3 * GRID[1]
    color = np.zeros((height, width, 3), np.uint8)
    color[:2, :3] = (255, 0, 0)
    color[2:4, 3:6, 1] = [[200, 0, 0], [0, 0, 100]]
    luma = small_luma(color)
    assert luma.shape == GRID
    assert (luma[0, 0], luma[1, 1], luma.sum()) == (round(0.2126 * 255), round(0.7152 * 50), round(0.2126 * 255) + round(0.7152 * 50))
    ids = np.arange(height * width, dtype=np.uint16).reshape(height, width)
    assert small_ids(ids)[1, 2] == ids[3, 7]
    assert small_luma(color[:3, :5]).shape == (3, 5)


def test_intervals() -> None:
    assert read_interval("--objects", "3:", 0.0) == (3.0, math.inf)
    assert read_interval("--brightness", ":0.5", 0.0, 1.0) == (0.0, 0.5)
    for words in (":", "5:3", "3", "a:b", "nan:1"):
        with pytest.raises(SplitError, match="expected LOW:HIGH"):
            read_interval("--ev100", words)
    with pytest.raises(SplitError, match="within 0 to 1"):
        read_interval("--brightness", "0.5:2", 0.0, 1.0)
