"""The table of layers: what its rows promise, and what is refused."""

from typing import get_args, get_type_hints

import numpy as np
import pytest

from renderer import RenderError
from renderer.film.layers import (
    COLOR_LAYERS,
    GEOMETRIC_LAYERS,
    HIT_LAYERS,
    LAYERS,
    ROWS,
    SAMPLED_LAYERS,
    SENSED_LAYERS,
    check_layers,
    check_names,
)
from renderer.ground_truth.hit_layers import FUNCTIONS
from renderer.path.ground_truth import GeometricImages

SAMPLE = {name: np.ones(row.shape(6, 9), row.dtype) for name, row in LAYERS.items()}


def test_names_and_channels_of_files_are_told_apart() -> None:
    channels = [channel for row in ROWS for channel in row.exr]
    assert len(LAYERS) == len(ROWS) and len(set(channels)) == len(channels)
    assert all(len(row.exr) in (0, row.channels) for row in ROWS)


def test_every_layer_is_traced_looked_up_sampled_or_sensed() -> None:
    assert sorted((*GEOMETRIC_LAYERS, *HIT_LAYERS, *SAMPLED_LAYERS, *SENSED_LAYERS)) == sorted(LAYERS)
    assert {"color", "radiance", "variance"} < set(COLOR_LAYERS) < set(SAMPLED_LAYERS) and "albedo" not in COLOR_LAYERS


def scalar_type(array: object) -> type[np.generic]:
    """Return the scalar of an ``NDArray[...]``, which numpy's versions spell in different ways."""
    waiting = [array]
    while waiting:
        annotation = waiting.pop()
        if isinstance(annotation, type) and issubclass(annotation, np.generic):
            return annotation
        waiting.extend(get_args(annotation))
    raise AssertionError(f"no scalar type in {array}")


def test_the_hit_record_fills_an_image_of_each_geometric_row() -> None:
    fields = get_type_hints(GeometricImages)
    assert set(fields) == set(GEOMETRIC_LAYERS)
    for name, array in fields.items():
        assert np.dtype(scalar_type(array)) == LAYERS[name].dtype, name


def test_each_hit_row_has_its_function() -> None:
    assert set(FUNCTIONS) == set(HIT_LAYERS)


@pytest.mark.parametrize("name", LAYERS)
def test_every_layer_has_a_picture_that_a_png_can_hold(name: str) -> None:
    picture = LAYERS[name].picture.of(SAMPLE[name])
    assert picture.shape in ((6, 9), (6, 9, 3)) and (picture.dtype == np.uint8 or (picture.dtype == np.uint16 and picture.ndim == 2))


def test_what_fits_the_table_is_taken() -> None:
    check_layers(SAMPLE)
    check_layers({})


@pytest.mark.parametrize("image", [np.float32(1.0), np.ones(9, np.float32), np.ones((6, 9, 1), np.float32), np.ones((6, 9), ">f4")])
def test_an_image_of_another_form_is_refused(image: np.ndarray) -> None:
    with pytest.raises(RenderError, match=r"^layer depth: expected float32 \(height, width\), got "):
        check_layers({"depth": np.asarray(image)})


def test_unknown_names_are_refused_with_the_known_ones() -> None:
    with pytest.raises(RenderError, match=f"^layers: expected some of {', '.join(LAYERS)}, got fog, wobble$"):
        check_names({"wobble", "depth", "fog"})
