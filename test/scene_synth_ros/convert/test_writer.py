"""Frames are encoded in threads and taken in their order; nothing changes with their number."""

import hashlib
import threading
import time

import pytest
from convert_bag import PINHOLE, convert_bag

from scene_synth_ros.convert.formats import FORMATS, writer_of
from scene_synth_ros.convert.source import Choice, open_source
from scene_synth_ros.convert.writer import Writer, convert


class Log(Writer):
    """Writes down what is called; earlier frames of a sequence take longer."""

    def begin(self, out, source):
        self.calls, self.threads, self.fail = [f"begin {source.frames}"], set(), None

    def begin_sequence(self, sequence):
        self.calls.append(f"begin {sequence.name}")
        return sequence.name

    def encode(self, frame, number, state):
        self.threads.add(threading.current_thread().name)
        if number == self.fail:
            raise OSError("no space left")
        time.sleep(0.005 * (3 - number))
        return f"{state} {number} {frame.stamp_ns}"

    def take(self, item, state):
        self.calls.append(item)

    def end_sequence(self, state):
        self.calls.append(f"end {state}")

    def finish(self):
        self.calls.append("finish")
        return ("a note",)


def test_frames_are_taken_in_order_and_sequences_end_in_order(tmp_path):
    bag = convert_bag(left=PINHOLE, right=PINHOLE)
    source, log, done = open_source(str(bag.path), "euroc", FORMATS["euroc"], Choice()), Log(), []
    assert convert(tmp_path, source, log, threads=2, progress=done.append) == ("a note",)
    taken = [call for call in log.calls if call.count(" ") == 2]
    stamps = [truth.pose.stamp_ns for name in ("left", "right") for truth in bag.frames[name]]
    names = [f"room_000{room}_{camera} {number}" for room in (0, 1) for camera in ("left", "right") for number in range(3)]
    assert [call.rsplit(" ", 1)[0] for call in taken] == names and sorted(int(call.rsplit(" ", 1)[1]) for call in taken) == sorted(stamps)
    for name in dict.fromkeys(call.split()[0] for call in taken):
        own = [place for place, call in enumerate(log.calls) if name in call.split()]
        assert log.calls[own[0]] == f"begin {name}" and log.calls[own[-1]] == f"end {name}" and len(own) == 5
    assert log.calls[-1] == "finish" and done == list(range(1, 13)) and len(log.threads) == 2


def test_a_fault_of_an_encoder_ends_the_conversion(tmp_path):
    source, log = open_source(str(convert_bag().path), "euroc", FORMATS["euroc"], Choice()), Log()
    begin = log.begin

    def failing(out, chosen):
        begin(out, chosen)
        log.fail = 1

    log.begin = failing
    with pytest.raises(OSError, match="no space left"):
        convert(tmp_path, source, log)
    assert "finish" not in log.calls


@pytest.mark.parametrize("name", FORMATS)
def test_threads_change_no_byte(tmp_path, name):
    found = []
    for threads in (1, 3):
        out = tmp_path / str(threads)
        out.mkdir()
        convert(out, open_source(str(convert_bag().path), name, FORMATS[name], Choice()), writer_of(name), threads=threads)
        found.append(
            {str(path.relative_to(out)): hashlib.sha256(path.read_bytes()).hexdigest() for path in out.rglob("*") if path.is_file()}
        )
    assert found[0] == found[1] and found[0]
