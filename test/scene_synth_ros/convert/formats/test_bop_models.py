"""Models of BOP: equal objects have one, whatever room they stand in and however they are turned; diameters of known shapes."""

import dataclasses
import math

import numpy as np
import pytest
from box_scene import crate, crates_scene

from renderer.annotations.object_meshes import ObjectMeshes
from scene_synth_ros.convert.formats.bop_models import ModelLibrary, diameter


def add(library, *boxes):
    scene, flat = crates_scene([dataclasses.replace(box, category="crate") for box in boxes])
    meshes = ObjectMeshes(flat)
    found = library.add_room(scene, flat, meshes)
    meshes.close()
    return found


def test_equal_objects_have_one_model():
    library, size = ModelLibrary(), (0.5, 0.4, 0.3)
    poses, fresh = add(
        library, crate(2, (1.0, 0.5, 0.0), size, 0.3), crate(5, (-2.0, 1.0, 0.0), size, -2.0), crate(7, (0.0, -2.0, 0.0), (0.5, 0.4, 0.31))
    )
    assert [model.number for model in fresh] == [1, 2] and {key: pose.model for key, pose in poses.items()} == {2: 1, 5: 1, 7: 2}
    assert fresh[0].info() == pytest.approx(
        {
            "diameter": 1000.0 * math.sqrt(0.5),
            "min_x": -250,
            "min_y": -200,
            "min_z": -150,
            "size_x": 500,
            "size_y": 400,
            "size_z": 300,
            "name": "crate",
        }
    )
    np.testing.assert_allclose(poses[5].place_m, (-2.0, 1.0, 0.15), atol=1e-6)
    np.testing.assert_allclose(poses[5].rotation[:, 0], (math.cos(-2.0), math.sin(-2.0), 0.0), atol=1e-6)
    again, fresh = add(library, crate(3, (3.0, 3.0, 0.0), size, 1.0), crate(4, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)))
    assert again[3].model == 1 and again[4].model == 3 and [model.number for model in fresh] == [3]


@pytest.mark.parametrize(
    ("points", "expected"),
    [
        ([[0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 4, 0], [1, 1, 0], [2, 1, 0]], 5.0),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], math.sqrt(2.0)),
        ([[0, 0, 0], [1, 2, 2], [0.1, 0.2, 0.3], [0.5, 0.1, 0.2], [0.2, 0.4, 0.1]], 3.0),
    ],
)
def test_diameters(points, expected):
    assert diameter(np.array(points, np.float64)) == pytest.approx(expected, rel=1e-6)
