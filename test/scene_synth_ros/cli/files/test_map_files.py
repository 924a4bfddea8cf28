"""The free floor as map.yaml and map.pgm: by hand, and cell by cell as it is published."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from nav2_map import Nav2Map, read_nav2_map
from nav_msgs.msg import OccupancyGrid
from rclpy.serialization import deserialize_message, serialize_message
from sample_scene import sample_scene

from scene_synth_ros.cli.commands.truth_command import scene_floor
from scene_synth_ros.cli.files.truth_files import MapError, floor_of_message, map_pgm, map_yaml
from scene_synth_ros.messages.conversions import occupancy_to_msg


def written(folder: Path, cells: np.ndarray, resolution_m: float, origin_m: tuple[float, float]) -> Nav2Map:
    (folder / "map.pgm").write_bytes(map_pgm(cells))
    (folder / "map.yaml").write_text(map_yaml("map.pgm", resolution_m, origin_m))
    return read_nav2_map(folder / "map.yaml")


def test_the_image_begins_with_the_greatest_y_and_has_the_grey_levels_of_map_saver() -> None:
    cells = np.array([[0, 100, -1], [0, 0, 100]], np.int8)
    head, pixels = map_pgm(cells)[:11], map_pgm(cells)[11:]
    assert head == b"P5\n3 2\n255\n"
    assert list(pixels) == [254, 254, 0, 254, 0, 205]


def test_the_yaml_has_every_field_that_map_server_asks_for() -> None:
    assert map_yaml("map.pgm", 0.05, (-2.35, 1.0)) == (
        "image: map.pgm\nmode: trinary\nresolution: 0.05\norigin: [-2.35, 1.0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.15\n"
    )


def test_every_value_comes_back(tmp_path: Path) -> None:
    cells = np.random.default_rng(1).choice(np.array([0, 100, -1], np.int8), (7, 5))
    found = written(tmp_path, cells, 0.1, (-1.5, 0.25))
    assert np.array_equal(found.data.reshape(7, 5), cells)
    assert (found.width, found.height, found.resolution, found.origin) == (5, 7, 0.1, (-1.5, 0.25, 0.0))


def test_the_files_are_the_published_grid(tmp_path: Path) -> None:
    floor = scene_floor(sample_scene(), None)
    message = occupancy_to_msg(floor.cells, floor.resolution_m, floor.origin_m, 5, "map")
    message = deserialize_message(serialize_message(message), OccupancyGrid)  # its resolution has 32 bits now
    again = floor_of_message(message)
    assert again.resolution_m == floor.resolution_m == 0.05 and again.origin_m == floor.origin_m
    found = written(tmp_path, again.cells, again.resolution_m, again.origin_m)
    assert found.data.tolist() == list(message.data) and {0, 100} <= set(found.data.tolist())
    # the bed covers 0.05 to 2.15 m by 1 to 2.6 m of the room: its middle is taken, the floor beside the door is free
    row = lambda y: int((y - floor.origin_m[1]) / 0.05)  # noqa: E731
    grid = found.data.reshape(found.height, found.width)
    column = lambda x: int((x - floor.origin_m[0]) / 0.05)  # noqa: E731
    assert grid[row(1.8), column(1.1)] == 100 and grid[row(0.5), column(3.5)] == 0


@pytest.mark.parametrize(("field", "value"), [("width", 9), ("resolution", 0.0), ("resolution", float("nan"))])
def test_a_grid_that_contradicts_itself_is_refused(field: str, value: float) -> None:
    message = occupancy_to_msg(np.zeros((2, 3), np.int8), 0.05, (0.0, 0.0), 5, "map")
    setattr(message.info, field, value)
    with pytest.raises(MapError, match="expected"):
        floor_of_message(message)
