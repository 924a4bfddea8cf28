"""Several renderers of one run, nodes in one process, a renderer that dies: the bag has every frame once, with the same pixels."""

import json
import os
import signal
from pathlib import Path

import pytest
from rclpy.serialization import deserialize_message
from scene_synth_ros_suite import SMALL, Child, Peer, dds_context, environment, node_pids, record_command, run_suite, stop, wait_until
from std_msgs.msg import String
from std_srvs.srv import Trigger

from grammar.synthesize import CameraTimes, SceneSynthesizer
from scene_description import scene_from_json
from scene_description.share import config_path
from scene_synth_ros.bags.bag_inspect import inspect_bag
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.cli.parameters.run_parameters import RunWords, run_parameters
from scene_synth_ros.offline.offline_bag import OfflineBag
from scene_synth_ros.offline.settings import read_settings
from scene_synth_ros.suite.qos import latched_qos
from scene_synth_ros.verify.bag_verify import verify_bag

pytestmark = pytest.mark.slow

ROOMS, FRAMES, SEED = 3, 2, 9
FRAMES_OF_LONG_ROOMS = 20
"""So many that the run does not end before a service, called when its second room comes, has been heard."""
CHEAP = ["-p", "grammar_node.scene.room_type:=hallway"]
WORDS = ["--rooms", ROOMS, "--frames", FRAMES, "--seed", SEED, *CHEAP]
IMAGES = [f"/synth/camera/{layer}/image_raw" for layer in ("color", "depth", "normals", "semantic", "instance")]


def frames(bag: Path) -> dict[str, list[tuple[int, bytes]]]:
    """Return topic -> log time and pixels (what follows the header, whose padding is not defined) of the images."""
    found: dict[str, list[tuple[int, bytes]]] = {topic: [] for topic in IMAGES}
    with BagReader(bag) as reader:
        for message in reader.messages(IMAGES, file_order=True):
            found[message.topic].append((message.log_ns, message.data[64:]))
    return found


@pytest.fixture(scope="module")
def single(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[tuple[int, bytes]]]:
    """Return what one renderer makes of the rooms, in this process: those of a run over DDS are the same (``test_main_job.py``)."""
    bag = tmp_path_factory.mktemp("single") / "bag"
    words = RunWords(record=bag, rooms=ROOMS, frames=FRAMES, seed=SEED, overrides=(*SMALL, CHEAP[1]))
    settings, synthesizer = read_settings(run_parameters(words)), SceneSynthesizer.from_config()
    with OfflineBag(bag, settings, synthesizer.floor_map) as offline:
        for index in range(ROOMS):
            times = CameraTimes(frames=FRAMES, start_ns=10**9, rate_hz=10.0, first_index=index * FRAMES)
            offline.add_room(synthesizer.synthesize(settings.grammar["scene"], SEED, index, times))
    return frames(bag)


@pytest.mark.parametrize("words", [["--renderers", 2], ["--one-process", "--renderers", 2, "-p", "grammar_node.rooms_ahead:=3"]])
def test_shared_rooms_one_process_and_rooms_ahead_give_the_same_bag(
    tmp_path: Path, single: dict[str, list[tuple[int, bytes]]], words: list[object]
) -> None:
    process = run_suite(tmp_path / "bag", *WORDS, *words, timeout_s=900)
    assert process.returncode == 0, process.stderr + process.stdout
    assert "Traceback" not in process.stderr
    assert frames(tmp_path / "bag") == single
    report = inspect_bag(tmp_path / "bag")
    assert not report.faults and report.rooms == ROOMS


def test_colour_and_truth_of_two_renderers_have_the_same_stamps(tmp_path: Path, single: dict[str, list[tuple[int, bytes]]]) -> None:
    words = ["--params", config_path("runs/split_outputs.yaml")]
    process = run_suite(tmp_path / "bag", *WORDS, *words, timeout_s=900)
    assert process.returncode == 0, process.stderr + process.stdout
    found = frames(tmp_path / "bag")
    assert {topic: messages for topic, messages in found.items() if topic != IMAGES[0]} == {
        t: m for t, m in single.items() if t != IMAGES[0]
    }
    assert [at for at, _ in found[IMAGES[0]]] == [at for at, _ in single[IMAGES[0]]]
    assert not inspect_bag(tmp_path / "bag").faults
    assert verify_bag(tmp_path / "bag").good


def test_a_reset_waits_for_the_rooms_at_work_and_begins_again_without_loss(tmp_path: Path) -> None:
    """With two renderers; a reset of a run with one is in ``simulation/test_simulation_services.py``."""
    bag, env = tmp_path / "bag", environment()
    process = Child(record_command(bag, "--rooms", 3, "--frames", FRAMES_OF_LONG_ROOMS, "--renderers", 2, *CHEAP), env=env)
    try:
        with dds_context(int(env["ROS_DOMAIN_ID"])) as context:
            peer, seen = Peer(context), []
            peer.node.create_subscription(String, "scene", lambda message: seen.append(json.loads(message.data)["index"]), latched_qos(10))
            peer.find(Trigger, "grammar_node/reset")
            peer.spin_until(lambda: 1 in seen, 180, "the second room")
            assert peer.trigger("grammar_node/reset")[0]
            output, errors = process.communicate(timeout=300)
            assert process.returncode == 0, errors + output
    finally:
        stop(process)
    report = inspect_bag(bag)
    assert not report.faults, report.faults
    with BagReader(bag) as reader:
        rooms = [scene_from_json(deserialize_message(message.data, String).data) for message in reader.messages(["/synth/scene"])]
    indices = [room.index for room in rooms]
    assert indices in ([0, 1, 0, 1, 2], [0, 1, 2, 0, 1, 2])
    assert [room.objects for room in rooms[-3:-1]] == [room.objects for room in rooms[:2]]
    assert {topic.count for topic in report.topics if topic.name in IMAGES} == {FRAMES_OF_LONG_ROOMS * len(rooms)}


def test_a_renderer_that_is_killed_is_started_again_and_its_room_is_whole(tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    env = environment()
    marker = f"{os.getpid()}-{bag}"
    env["SCENE_SYNTH_TEST"] = marker
    process = Child(record_command(bag, "--rooms", 2, "--frames", 30, "--respawn", 3, *CHEAP), env=env, start_new_session=True)
    try:
        files = lambda size: [path for path in bag.glob("*.mcap.active") if path.stat().st_size > size]  # noqa: E731
        killed = [0]
        running = lambda: node_pids(marker).get("renderer_node", killed[-1])  # noqa: E731
        for size in (100_000, 1_000_000):
            wait_until(lambda size=size: files(size) and running() != killed[-1], 180, "frames in the bag", process)
            killed.append(running())
            os.kill(killed[-1], signal.SIGKILL)
        output, errors = process.communicate(timeout=900)
        assert process.returncode == 0, errors + output
        assert errors.count("renderer_node was ended by SIGKILL; started again") == 2
        report = inspect_bag(bag)
        assert not report.faults, report.faults
        assert {topic.count for topic in report.topics if topic.name in IMAGES} == {60}
        assert verify_bag(bag).good
    finally:
        stop(process)
