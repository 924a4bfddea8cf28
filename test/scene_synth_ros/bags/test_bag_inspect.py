"""Reports on bags with one known fault each."""

import shutil

import numpy as np
import pytest
from bag_samples import PERIOD_NS, START_NS, TOPICS, camera_info, frame_messages, image, text, write_bag
from mcap.reader import make_reader

from scene_synth_ros.bags.bag_inspect import inspect_bag
from scene_synth_ros.bags.bag_repair import repair_bag
from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.bags.run_info import parameters_file
from scene_synth_ros.cli.command_line import main
from scene_synth_ros.cli.commands.inspect_command import render_report

COLOR = "/synth/camera/color/image_raw"
DEPTH = "/synth/camera/depth/image_raw"


def scene(first, frames, stamp_ns=None):
    path = [{"stamp_ns": START_NS + (first + i) * PERIOD_NS} for i in range(frames)]
    return ("/synth/scene", path[0]["stamp_ns"] if stamp_ns is None else stamp_ns, text({"camera_path": path}))


def frames(*indices, without=()):
    messages = []
    for index in indices:
        stamp_ns = START_NS + index * PERIOD_NS
        messages += [
            (COLOR, stamp_ns, image(stamp_ns, "rgb8", np.zeros((2, 2, 3), np.uint8))),
            (COLOR.replace("image_raw", "camera_info"), stamp_ns, camera_info(stamp_ns)),
            (DEPTH, stamp_ns, image(stamp_ns, "32FC1", np.zeros((2, 2), np.float32))),
            (DEPTH.replace("image_raw", "camera_info"), stamp_ns, camera_info(stamp_ns)),
        ]
    return [message for message in messages if (message[0], (message[1] - START_NS) // PERIOD_NS) not in without]


def report_on(folder, messages, topics=TOPICS, **options):
    with BagWriter(folder, **options) as writer:
        for topic, (type_name, qos) in topics.items():
            writer.add_topic(topic, type_name, [qos])
        for topic, log_ns, data in messages:
            writer.write(topic, data, log_ns, log_ns)
    return inspect_bag(folder)


def test_a_sound_bag_has_no_faults(tmp_path):
    messages = [scene(0, 4), *frames(0, 1, 2, 3), scene(4, 4), *frames(4, 5, 6, 7)]
    report = report_on(tmp_path / "bag", messages, custom_data={"seed": "7"})
    assert report.faults == report.notes == ()
    assert (report.rooms, report.message_count, report.files) == (2, 34, 1)
    color = next(topic for topic in report.topics if topic.name == COLOR)
    assert (color.count, color.rate_hz, color.gaps, color.period_ns) == (8, 10.0, 0, PERIOD_NS)
    lines = render_report(report).splitlines()
    assert lines[0].endswith("34 messages, 2 rooms, 0.700 s") and "  seed: 7" in lines and lines[-1] == "no faults"
    (row,) = (line.split() for line in lines if COLOR in line)
    assert row[:5] == [COLOR, "sensor_msgs/msg/Image", "8", "10", "0"]


def test_annotations_come_with_every_frame_of_their_camera(tmp_path):
    name = "/synth/camera/annotations"
    told = [(name, START_NS + i * PERIOD_NS, text({"stamp_ns": START_NS + i * PERIOD_NS})) for i in range(3)]
    topics = {**TOPICS, name: ("std_msgs/msg/String", TOPICS[COLOR][1])}
    whole = [scene(0, 3), *(message for i in range(3) for message in (*frames(i), told[i]))]
    assert report_on(tmp_path / "whole", whole, topics).faults == ()
    (fault,) = report_on(tmp_path / "lacking", whole[:-1], topics).faults
    assert fault.startswith(f"{name}: ")


def test_a_gap_within_a_room_is_a_fault_between_rooms_it_is_not(tmp_path):
    inside = report_on(tmp_path / "a", [scene(0, 3), *frames(0, 1, 2, 4, 5)])
    assert next(fault for fault in inside.faults if "gaps" in fault) == f"{COLOR}: 1 gaps of more than 1.5 periods"
    assert len(inside.faults) == 4
    between = report_on(tmp_path / "b", [scene(0, 3), *frames(0, 1, 2), scene(6, 3), *frames(6, 7, 8)])
    assert between.faults == ()


def test_a_layer_that_lacks_a_frame(tmp_path):
    report = report_on(tmp_path / "bag", [scene(0, 3), *frames(0, 1, 2, without={(DEPTH, 1)})])
    assert f"{DEPTH}: 1 of 3 frames of its camera are missing, first at {START_NS // 10**9}.100000000 s" in report.faults


def test_frames_that_a_scene_announces(tmp_path):
    lost = report_on(tmp_path / "a", [scene(0, 4), *frames(0, 1, 2), scene(4, 2), *frames(4, 5)])
    assert next(fault for fault in lost.faults if "1 of 6 frames of its camera are missing" in fault).startswith(COLOR)
    stopped = report_on(tmp_path / "b", [scene(0, 2), *frames(0, 1), scene(2, 4), *frames(2, 3)])
    assert stopped.faults == ()
    assert stopped.notes == ("/synth/camera: the last room has 2 of its 4 frames",)
    assert "note: /synth/camera: the last room has 2 of its 4 frames" in render_report(stopped)


def test_a_scene_that_is_repeated_from_before_announces_only_what_is_to_come(tmp_path):
    def repeated(first, count, now):
        topic, _, data = scene(first, count)
        return topic, START_NS + now * PERIOD_NS, data

    snapshot = [repeated(0, 4, 2), *frames(2, 3), scene(4, 4), *frames(4, 5, 6, 7), scene(8, 4), *frames(8)]
    report = report_on(tmp_path / "a", snapshot)
    assert report.faults == ()
    assert report.notes == ("/synth/camera: the last room has 1 of its 4 frames",)
    older = report_on(tmp_path / "b", [repeated(0, 4, 5), repeated(4, 4, 5), *frames(5, 6, 7)])
    assert (older.faults, older.notes, older.rooms) == ((), (), 2)
    lost = report_on(tmp_path / "c", [repeated(0, 4, 1), *frames(1, 2), scene(4, 1), *frames(4)])
    assert f"{COLOR}: 1 of 4 frames of its camera are missing, first at {START_NS // 10**9}.300000000 s" in lost.faults
    again = report_on(tmp_path / "d", [scene(0, 3), *frames(0, 1), repeated(0, 3, 2), scene(3, 1), *frames(3)])
    assert any("1 of 4 frames" in fault for fault in again.faults), "what the first one announces stays announced"


def test_log_times_of_another_clock_leave_the_frames_before_the_first_out(tmp_path):
    late = [(topic, START_NS + 10**15 + number, data) for number, (topic, _, data) in enumerate([scene(0, 4), *frames(1, 2, 3)])]
    assert report_on(tmp_path / "a", [*late]).faults == ()
    lost = [scene(0, 4), *frames(1, 2), scene(4, 1), *frames(4)]
    wall = [(topic, START_NS + 10**15 + number, data) for number, (topic, _, data) in enumerate(lost)]
    assert any("1 of 4 frames of its camera are missing" in fault for fault in report_on(tmp_path / "b", wall).faults)


def test_repeated_stamps_and_decreasing_times(tmp_path):
    repeated = report_on(tmp_path / "a", [scene(0, 2), *frames(0, 1), *frames(1)])
    assert f"{COLOR}: 1 stamps come more than once, first {START_NS // 10**9}.100000000 s" in repeated.faults
    backwards = report_on(tmp_path / "b", [scene(0, 3), *frames(0, 2, 1)], chunk_size=100)
    first = f"{COLOR} at {START_NS + PERIOD_NS} ns after {START_NS + 2 * PERIOD_NS} ns"
    assert f"log time decreases 1 times, first {first}" in backwards.faults
    assert f"{COLOR}: stamps decrease" in backwards.faults


def test_ids_need_labels_and_a_scene(tmp_path):
    stamp = START_NS
    topics = {**TOPICS, "/synth/camera/semantic/image_raw": TOPICS[COLOR]}
    ids = ("/synth/camera/semantic/image_raw", stamp, image(stamp, "mono8", np.zeros((2, 2), np.uint8)))
    bare = report_on(tmp_path / "a", [*frames(0), ids], topics)
    assert bare.faults == ("/synth/camera/semantic/labels: the layer has no labels", "scene: the bag holds no scene description")
    labels = ("/synth/camera/semantic/labels", stamp, text({"0": {"name": "void"}}))
    assert report_on(tmp_path / "b", [scene(0, 1), labels, *frames(0), ids], topics).faults == ()


def test_an_empty_bag_is_a_fault(tmp_path):
    assert report_on(tmp_path / "bag", []).faults == ("the bag holds no messages",)


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("message_count: 1\n", "message_count: 2\n", "metadata.yaml: /synth/scene: 2 messages, 1 were found"),
        ("name: /synth/scene\n", "name: /scene\n", "metadata.yaml: topic /scene with 1 messages is not in the bag"),
        ("type: std_msgs/msg/String\n", "type: std_msgs/msg/Char\n", "type std_msgs/msg/Char, std_msgs/msg/String was found"),
        ("nanoseconds: 200000000\n", "nanoseconds: 100000000\n", "metadata.yaml: times "),
        ("bag_0.mcap\n", "other.mcap\n", "metadata.yaml: file other.mcap is missing"),
    ],
)
def test_metadata_that_disagrees(tmp_path, old, new, fault):
    write_bag(tmp_path / "bag", frames=3)
    path = tmp_path / "bag" / "metadata.yaml"
    path.write_text(path.read_text().replace(old, new))
    assert any(fault in line for line in inspect_bag(tmp_path / "bag").faults)


def test_statistics_that_disagree_with_the_chunks(tmp_path):
    write_bag(tmp_path / "bag", frames=3, compression="none", chunk_size=10**6)
    path = tmp_path / "bag" / "bag_0.mcap"
    data = path.read_bytes()
    place = data.rindex(frame_messages(2)[0][2][:60])
    path.write_bytes(data[:place] + b"\x55" + data[place + 1 :])
    faults = inspect_bag(tmp_path / "bag").faults
    assert any("chunk: its checksum does not match" in fault for fault in faults)
    assert f"{COLOR}: the index says 3 messages, 0 were found" in faults
    assert "the bag holds no messages" in faults


def test_control_characters_do_not_reach_the_terminal(tmp_path):
    report = report_on(tmp_path / "bag", [scene(0, 1), *frames(0)], custom_data={"note": "\x1b[31mred"})
    assert "note: ?[31mred" in render_report(report)


def promised(folder, messages, *, rooms=3, frames_of_each=4, first_index=0, camera="camera", text=None):
    nodes = {
        "/synth/grammar_node": {"rooms": rooms, "frames_per_room": frames_of_each, "first_index": first_index},
        "/synth/renderer_node": {"streams.camera": camera},
    }
    with BagWriter(folder) as writer:
        writer.set_attachment("parameters.yaml", parameters_file(nodes) if text is None else text)
        for topic, (type_name, qos) in TOPICS.items():
            writer.add_topic(topic, type_name, [qos])
        for topic, log_ns, data in messages:
            writer.write(topic, data, log_ns, log_ns)
    return inspect_bag(folder)


def room(index, count=4):
    path = [{"stamp_ns": START_NS + (count * index + i) * PERIOD_NS} for i in range(count)]
    return [
        ("/synth/scene", path[0]["stamp_ns"], text({"index": index, "camera_path": path})),
        *frames(*range(count * index, count * index + count)),
    ]


def test_a_bag_that_lacks_what_its_parameters_promise_says_so(tmp_path):
    whole = [*room(0), *room(1), *room(2)]
    assert promised(tmp_path / "whole", whole).lacking == ()
    for number, (messages, left) in enumerate([([*room(0), *room(1)], 8), ([*room(0), *room(1)[:5]], 5), (room(0)[:5], 1), ([], 0)]):
        report = promised(tmp_path / f"{number}", messages)
        assert report.lacking == (
            f"/synth/camera: {left} of the 12 frames that its parameters promise, 3 rooms x 4; the run or the recording ended early",
        )
        assert f"lacking: {report.lacking[0]}" in render_report(report).splitlines()
        assert "no faults" not in render_report(report).splitlines()


@pytest.mark.parametrize(
    ("messages", "promise"),
    [
        ([*room(1), *room(2)], {}),
        ([scene(0, 4, START_NS + 2 * PERIOD_NS), *frames(2, 3), *room(1), *room(2)], {}),
        ([*room(0)], {"rooms": 0}),
        ([*room(0)], {"camera": "other"}),
        ([*room(0)], {"text": b"a: ["}),
        ([*room(0)], {"text": b"/synth/grammar_node: {ros__parameters: {rooms: x, frames_per_room: [1]}}"}),
        ([*room(1), *room(2)], {"first_index": 1, "rooms": 2}),
    ],
)
def test_parts_of_runs_and_runs_without_end_promise_nothing(tmp_path, messages, promise):
    assert promised(tmp_path / "bag", messages, **promise).lacking == ()


def test_a_bag_that_nobody_closed_tells_what_its_run_promised_once_it_is_repaired(tmp_path):
    nodes = {"/synth/grammar_node": {"rooms": 3, "frames_per_room": 4}, "/synth/renderer_node": {"streams.camera": "camera"}}
    with BagWriter(tmp_path / "bag") as writer:
        for topic, (type_name, qos) in TOPICS.items():
            writer.add_topic(topic, type_name, [qos])
        writer.set_attachment("parameters.yaml", parameters_file({}))
        writer.set_attachment("parameters.yaml", parameters_file(nodes))
        for topic, log_ns, data in room(0):
            writer.write(topic, data, log_ns, log_ns)
        writer.flush()
        (tmp_path / "killed").mkdir()
        shutil.copy(tmp_path / "bag" / "bag_0.mcap.active", tmp_path / "killed")
    repaired = repair_bag(tmp_path / "killed", tmp_path / "repaired").bag
    told = "/synth/camera: 4 of the 12 frames that its parameters promise, 3 rooms x 4; the run or the recording ended early"
    assert inspect_bag(tmp_path / "bag").lacking == inspect_bag(repaired).lacking == (told,)
    with open(tmp_path / "bag" / "bag_0.mcap", "rb") as file:
        names = [attachment.name for attachment in make_reader(file).iter_attachments()]
    assert names == ["parameters.yaml", "parameters.yaml", "manifest.json"]


@pytest.mark.parametrize("stranger", ["/other/cam", "/synth/robot"])
def test_cameras_of_others_are_not_judged_by_the_run(tmp_path, stranger):
    """A camera of others that was recorded beside the suite's, in its namespace too, keeps its own time, and loses what it loses."""
    times = [START_NS + number * 7_000_000 for number in (0, 1, 9)]
    strangers = [(f"{stranger}/image_raw", time, image(time, "rgb8", np.zeros((2, 2, 3), np.uint8))) for time in times]
    nodes = {
        "/synth/grammar_node": {"rooms": 3, "frames_per_room": 4, "first_index": 0},
        "/synth/renderer_node": {"streams.camera": "camera"},
    }
    with BagWriter(tmp_path / "bag") as writer:
        writer.set_attachment("parameters.yaml", parameters_file(nodes))
        for topic, (type_name, qos) in {**TOPICS, f"{stranger}/image_raw": TOPICS[COLOR]}.items():
            writer.add_topic(topic, type_name, [qos])
        for topic, log_ns, data in sorted([*room(0), *room(1), *room(2), *strangers], key=lambda message: message[1]):
            writer.write(topic, data, log_ns, log_ns)
    report = inspect_bag(tmp_path / "bag")
    assert (report.faults, report.lacking) == ((), ())


def test_the_command_fails_where_something_is_lacking(tmp_path, capsys):
    promised(tmp_path / "bag", room(0))
    with pytest.raises(SystemExit) as status:
        main(["inspect", str(tmp_path / "bag")])
    assert status.value.code == 1
    assert capsys.readouterr().out.splitlines()[-2].startswith("lacking: /synth/camera: 4 of the 12 frames")
