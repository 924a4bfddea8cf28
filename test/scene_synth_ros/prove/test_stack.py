"""Messages read together say what each says alone, of whatever length they are."""

import numpy as np
import pytest

from scene_synth_ros.messages.cdr import CdrReader, CdrReadError, CdrWriter
from scene_synth_ros.prove.decode import JointRows, PoseRows, joint_rows, transform_rows
from scene_synth_ros.prove.stack import Stack, UnlikeError, read_table


def joints(stamp: int, frame: str, names: tuple[str, ...], angles: tuple[float, ...]) -> memoryview:
    writer = CdrWriter()
    writer.numbers("i", stamp)
    writer.numbers("I", 500)
    writer.text(frame)
    writer.numbers("I", len(names))
    for name in names:
        writer.text(name)
    writer.numbers("I", len(angles))
    writer.numbers("d", *angles)
    return memoryview(bytes(writer.message()))


def test_rows_are_in_the_order_of_their_messages_whatever_their_lengths() -> None:
    told = [joints(k, "base" if k % 3 else "a", ("left", "right"), (0.1 * k, -0.2 * k)) for k in range(20)]
    table = read_table(told, joint_rows, JointRows)
    assert table.stamps.tolist() == [k * 10**9 + 500 for k in range(20)]
    assert table.frames.tolist() == ["base" if k % 3 else "a" for k in range(20)] and table.names[7].tolist() == ["left", "right"]
    np.testing.assert_array_equal(table.position, np.outer(np.arange(20), (0.1, -0.2)))
    reader = CdrReader(told[4])
    assert reader.header() == (table.stamps[4], table.frames[4])


def test_messages_of_one_size_whose_texts_are_of_two_are_told_apart() -> None:
    told = [joints(1, frame, ("a",), (2.5,)) for frame in ("b", "bcd")]
    assert len(told[0]) == len(told[1])
    with pytest.raises(UnlikeError):
        joint_rows(Stack(told))
    assert read_table(told, joint_rows, JointRows).frames.tolist() == ["b", "bcd"]


def test_what_is_cut_off_or_no_message_is_refused() -> None:
    whole = joints(1, "b", ("a",), (2.5,))
    with pytest.raises(CdrReadError):
        read_table([whole[:-4]], joint_rows, JointRows)
    with pytest.raises(CdrReadError):
        read_table([memoryview(b"\x07\x07\x07\x07")], joint_rows, JointRows)
    with pytest.raises((CdrReadError, ValueError)):
        read_table([whole], transform_rows, PoseRows)
