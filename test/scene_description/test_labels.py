"""Labels: the standard's classes and ids, palettes that keep ids apart."""

from __future__ import annotations

import numpy as np

from scene_description import NYU40
from scene_description.labels import LABEL_ID, instance_palette, label_palette


def test_ids_and_names_are_those_of_nyu_depth_v2() -> None:
    assert [label.id for label in NYU40] == list(range(41))
    known = {"wall": 1, "floor": 2, "cabinet": 3, "bed": 4, "chair": 5, "sofa": 6, "table": 7, "door": 8, "window": 9, "bookshelf": 10}
    known |= {"picture": 11, "desk": 14, "ceiling": 22, "television": 25, "night stand": 32, "lamp": 35, "otherprop": 40}
    assert {name: LABEL_ID[name] for name in known} == known
    assert len(LABEL_ID) == 41


def test_label_palette_gives_every_class_its_own_colour_and_void_black() -> None:
    palette = label_palette()
    assert palette.shape == (41, 3)
    assert palette.dtype == np.uint8
    assert len(np.unique(palette, axis=0)) == 41
    assert palette[0].tolist() == [0, 0, 0]
    assert palette[LABEL_ID["bed"]].tolist() == list(NYU40[4].color)


def test_instance_palette_keeps_neighbouring_ids_apart() -> None:
    palette = instance_palette(300)
    assert palette.dtype == np.uint8
    assert palette[0].tolist() == [0, 0, 0]
    assert len(np.unique(palette, axis=0)) == 300
    steps = np.linalg.norm(np.diff(palette[1:].astype(float), axis=0), axis=1)
    assert steps.min() > 60.0
    np.testing.assert_array_equal(palette[:50], instance_palette(50))
