"""Rolling shutters are refused where a frame has one pose, and told where the pose is only that of the stamp."""

from types import SimpleNamespace

import pytest

from scene_synth_ros.convert.errors import ConvertError
from scene_synth_ros.convert.shutter import refuse_rolling_shutter, row_time_s, shutter_notes

ROLLING = SimpleNamespace(settings={"camera": {"row_time_s": 2e-5}})
GLOBAL = (SimpleNamespace(settings={"camera": {"row_time_s": 0.0}}), SimpleNamespace(settings=None), SimpleNamespace(settings={}))


def test_a_rolling_shutter_is_told_from_the_settings():
    assert row_time_s(ROLLING) == 2e-5 and [row_time_s(frame) for frame in GLOBAL] == [0.0, 0.0, 0.0]
    with pytest.raises(
        ConvertError, match=r"^bop: camera left: expected a global shutter, .* got 2e-05 s a row; record with camera.row_time_s 0"
    ):
        refuse_rolling_shutter(ROLLING, "left", "bop")
    assert list(shutter_notes(ROLLING, "left", "tum")) == [
        "tum: camera left: the shutter takes 2e-05 s a row, which the format does not tell; poses are the first row's"
    ]
    for frame in GLOBAL:
        refuse_rolling_shutter(frame, "left", "bop")
        assert not shutter_notes(frame, "left", "tum")
