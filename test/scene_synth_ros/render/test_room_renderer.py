"""A room's geometry is made when somebody wants a layer of it, once."""

import pytest

from renderer.film.frame import Frame
from scene_description import CameraPose, SceneSynthError
from scene_synth_ros.render.room import RoomRenderer

POSE = CameraPose(stamp_ns=0, position_m=(0.0, 0.0, 1.0), orientation=(0.0, 0.0, 0.0, 1.0))


class Counting:
    def __init__(self) -> None:
        self.made, self.asked = 0, []

    def make(self) -> "Counting":
        self.made += 1
        return self

    def render(self, pose: CameraPose, frame_index: int, layers: tuple[str, ...], **how: object) -> Frame:
        self.asked.append((frame_index, layers, how))
        return Frame({}, None, samples=7)


def test_nothing_is_made_until_a_layer_is_wanted_and_then_once() -> None:
    counting = Counting()
    room = RoomRenderer(counting.make, counting.make)
    assert room.render(POSE, 0, ()) == Frame({}, None) and counting.made == 0
    for index in (1, 2):
        assert room.render(POSE, index, ("depth",), path=()).samples == 7
    assert counting.made == 1 and counting.asked == [(1, ("depth",), {"path": ()}), (2, ("depth",), {"path": ()})]


def test_an_annotator_is_made_when_annotations_are_wanted_and_then_once() -> None:
    counting, annotators = Counting(), Counting()
    room = RoomRenderer(counting.make, annotators.make)
    room.render(POSE, 0, ("depth",))
    assert annotators.made == 0
    for index in (1, 2):
        room.render(POSE, index, ("annotations", "depth"))
    assert annotators.made == 1 and counting.asked[1:] == [(index, ("depth",), {"annotator": annotators}) for index in (1, 2)]


def test_a_room_that_cannot_be_made_says_so_when_it_is_prepared() -> None:
    def make() -> None:
        raise SceneSynthError("no such model")

    with pytest.raises(SceneSynthError, match="no such model"):
        RoomRenderer(make, make).prepare()
