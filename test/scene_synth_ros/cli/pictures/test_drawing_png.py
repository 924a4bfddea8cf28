"""Painted drawings: shapes where they belong, in their colours."""

import io

import numpy as np
from PIL import Image
from sample_scene import sample_scene

from grammar.drawing.shapes import Drawing, area, dashes, dot, line, words
from grammar.drawing.top_view import top_view
from scene_synth_ros.cli.pictures.drawing_png import png_bytes


def painted(*shapes: object) -> np.ndarray:
    data = png_bytes(Drawing(width=60, height=40, shapes=shapes))
    return np.asarray(Image.open(io.BytesIO(data)))


def test_shapes_are_painted_to_scale_in_their_order() -> None:
    image = painted(
        area([(10, 10), (30, 10), (30, 30), (10, 30)], "#ff0000"),
        area([(20, 10), (40, 10), (40, 30), (20, 30)], "#0000ff", opacity=0.5),
        dot((50, 20), 5, "#00ff00"),
        line([(0, 35), (60, 35)], "#000000", 2.0),
    )
    assert image.shape == (40, 60, 3)
    assert image[20, 15].tolist() == [255, 0, 0] and image[5, 5].tolist() == [255, 255, 255]
    assert np.abs(image[20, 25].astype(int) - (127, 0, 128)).max() <= 2 and np.abs(image[20, 35].astype(int) - (127, 127, 255)).max() <= 2
    assert image[20, 50].tolist() == [0, 255, 0] and image[20, 57].tolist() == [255, 255, 255]
    assert image[35, 30].max() < 130 and image[31, 30].min() == 255


def test_text_is_painted_where_it_is_anchored() -> None:
    for anchor, columns in (("start", slice(30, 60)), ("end", slice(0, 30)), ("middle", slice(15, 45))):
        dark = painted(words((30, 20), "HHH", 12.0, anchor=anchor)).min(2) < 128
        assert dark.sum() > 20 and dark.sum() == dark[10:30, columns].sum()


def test_dashes_cover_their_share_of_a_line() -> None:
    pieces = dashes([(0.0, 0.0), (10.0, 0.0), (10.0, 10.0)], (3.0, 2.0))
    lengths = [abs(bx - ax) + abs(by - ay) for (ax, ay), (bx, by) in pieces]
    assert sum(lengths) == 12.0 and pieces[0] == ((0.0, 0.0), (3.0, 0.0)) and pieces[-1][1] == (10.0, 8.0)


def test_a_top_view_is_painted_as_large_as_its_drawing() -> None:
    drawing = top_view(sample_scene())
    image = Image.open(io.BytesIO(png_bytes(drawing)))
    assert image.size == (round(drawing.width), round(drawing.height))
    assert png_bytes(drawing) == png_bytes(top_view(sample_scene()))
