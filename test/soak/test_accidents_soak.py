"""Nodes, runs and launches that are ended at random moments; slow, run by ``make soak``.  Seeds are drawn from the clock and printed.

Whatever is ended, and however: all its processes are gone in time, the status is right and a line names the culprit; the bag, if need be
repaired, holds the run's first frames without a gap, every one whole, and all that were whole in the file; what is missing is told; nothing
stays in the temporary folder but, of a run that was killed itself, what the next one removes.

Launches need ROS 2's launch and are skipped where there is none.
"""

import os
import random
import signal
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple
from unittest import mock

import pytest
from launches import launch_command, launch_environment, launch_prefix
from scene_synth_ros_suite import Child, environment, marked_processes, node_pids, record_command, stop, wait_until

from scene_synth_ros.bags.bag_inspect import inspect_bag
from scene_synth_ros.bags.bag_reader import BagReader, BagReadError
from scene_synth_ros.bags.bag_repair import repair_bag
from scene_synth_ros.messages.stamps import announced_room
from scene_synth_ros.workers.temporary_folder import remove_abandoned_folders

pytestmark = pytest.mark.soak

ENDS = int(os.environ.get("SOAK_ENDS", "100"))
END_S, LATEST_S = 20.0, 5.0
LATER, SOME_FRAMES = 0.7, 200_000
"""Share of the ends that come when some frames have been recorded, so many bytes; the others come while nodes begin."""
ALONE = 0.5
"""Share of the stops of all that reach only the process that has started the nodes, as of a service; the others come of a terminal."""
SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGKILL)
NODES = ("grammar_node", "renderer_node", "recorder_node")
ROOMS, FRAMES = 200, 40
LAYERS = {"color": "", "depth": "", "normals": "image_color", "semantic": "image_color labels label_info"}
LAYERS["instance"] = LAYERS["semantic"]
CAMERA = {"/synth/camera/pose"} | {
    f"/synth/camera/{layer}/{name}" for layer, more in LAYERS.items() for name in ("image_raw", "camera_info", *more.split())
}
"""The topics of each frame."""
PROFILE = f"""
/**/grammar_node:
  ros__parameters: {{rooms: {ROOMS}, frames_per_room: {FRAMES}, scene: {{room_type: hallway}}}}
/**/renderer_node:
  ros__parameters:
    camera: {{width: 96, height: 72}}
    render: {{samples_per_pixel: 1, auto_exposure: false}}
"""


class Suite(NamedTuple):
    """A suite that will be ended: its process, whose signals it may get, the bag that it records, the folders that it writes into."""

    process: Child
    nodes: tuple[str, ...]
    bag: Path
    temporary: Path
    marker: str

    def pids(self) -> dict[str, int]:
        return node_pids(self.marker)

    def loading(self) -> bool:
        """Return whether every node loads its own modules; before that it is Python that is ended."""
        return all(b"numpy" in Path(f"/proc/{pid}/maps").read_bytes() for pid in self.pids().values())

    def left(self) -> list[int]:
        """Return the processes that live, whatever they are."""
        return [int(process.name) for process in marked_processes(self.marker)]


class Ended(NamedTuple):
    """How a suite was ended, what it said, how long it took."""

    who: str
    how: signal.Signals
    said: str
    seconds: float


def folders(folder: Path) -> tuple[Path, dict[str, str]]:
    """Make a folder for a suite; return its temporary folder and its environment."""
    temporary = folder / "tmp"
    temporary.mkdir(parents=True)
    return temporary, environment() | {"TMPDIR": str(temporary), "SCENE_SYNTH_TEST": f"{os.getpid()}-{folder}"}


def started(words: list[str], env: dict[str, str]) -> Child:
    """Start a command in a session of its own, which hears SIGINT: what the shell of a job in the background starts ignores it."""
    return Child(words, env=env, start_new_session=True, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))


def ended(suite: Suite, draw: random.Random) -> Ended:
    """End one of a suite's nodes, or what has started them, at a random moment; return when all its processes are gone."""
    who, how = draw.choice((*suite.nodes, "")), draw.choice(SIGNALS)
    try:
        wait_until(lambda: len(suite.pids()) == len(suite.nodes) and suite.loading(), 180, "the nodes", suite.process)
        files = [suite.bag / f"{suite.bag.name}_0.mcap{ending}" for ending in (".active", "")]
        if "recorder_node" in suite.nodes and draw.random() < LATER:
            wait_until(lambda: any(file.is_file() and file.stat().st_size > SOME_FRAMES for file in files), 300, "frames", suite.process)
        time.sleep(draw.uniform(0.0, LATEST_S))
        began = time.monotonic()
        if who or how == signal.SIGKILL or draw.random() < ALONE:
            os.kill(suite.pids()[who] if who else suite.process.pid, how)
        else:
            os.killpg(suite.process.pid, how)
        wait_until(
            lambda: suite.process.poll() is not None and not suite.left(),
            END_S,
            f"the processes to end after {how.name} of {who or 'all'}",
            suite.process,
        )
        return Ended(who, how, "".join(suite.process.said()), time.monotonic() - began)
    finally:
        stop(suite.process)
        for pid in suite.left():
            os.kill(pid, signal.SIGKILL)


def tell(suites: str, ends: list[Ended], tally: Counter[str]) -> None:
    times = sorted(end.seconds for end in ends)
    kinds = Counter(f"{end.who or suites} {end.how.name}" for end in ends)
    print(f"{len(ends)} ends of {suites}: {dict(tally)}; {', '.join(f'{count} {kind}' for kind, count in sorted(kinds.items()))}")
    print(f"all processes gone after {times[len(times) // 2]:.1f} s (median), {times[-1]:.1f} s (longest)")


def test_whoever_is_ended_whenever_the_run_ends_with_its_name_and_a_whole_bag(tmp_path: Path) -> None:
    seed = time.time_ns()
    print(f"seed {seed}")
    draw, ends, tally = random.Random(seed), [], Counter[str]()
    for number in range(ENDS):
        bag = tmp_path / str(number) / "bag"
        temporary, env = folders(bag.parent)
        words = ["--rooms", ROOMS, "--frames", FRAMES, "-p", "grammar_node.scene.room_type:=hallway"]
        process = started(record_command(bag, *words), env)
        suite = Suite(process, NODES, bag, temporary, env["SCENE_SYNTH_TEST"])
        end = ended(suite, draw)
        what = f"{number}: {end.who or 'run'} {end.how.name}\n{end.said}"
        killed = not end.who and end.how == signal.SIGKILL
        assert process.returncode == (1 if end.who else -end.how if killed else 130), what
        assert "Traceback" not in end.said, what
        assert not end.who or end.said.count(f"run: {end.who} was ended by {end.how.name}") == 1, what
        assert killed or end.who or "run: interrupted" in end.said, what
        assert_nothing_left(suite, what, abandoned=killed)
        tally[state_of(bag, what)] += 1
        ends.append(end)
        print(f"{number}: {end.who or 'run'} {end.how.name}, {end.seconds:.1f} s", flush=True)
    tell("run", ends, tally)


LAUNCH_STATUSES = {signal.SIGINT: {0, 1}, signal.SIGTERM: {1, -signal.SIGTERM}, signal.SIGKILL: {-signal.SIGKILL}}
"""How launch itself ends; it may hear of the end of a node that still loaded its modules before it gets its own SIGINT."""


@pytest.fixture(scope="module")
def prefix(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("launch_ros", reason="no ROS 2 launch; apt install ros-jazzy-launch-ros")
    return launch_prefix(tmp_path_factory.mktemp("prefix"))


def launched(prefix: Path, folder: Path, **arguments: object) -> Suite:
    """Launch a suite that records, or not, by ``arguments``."""
    temporary, env = folders(folder)
    (folder / "small.yaml").write_text(PROFILE)
    env = launch_environment(prefix, env, folder / "log")
    words = launch_command("synth.launch.py", params_file=folder / "small.yaml", bag_path=folder / "bag", **arguments)
    nodes = NODES if arguments else NODES[:2]
    return Suite(started(words, env), nodes, folder / "bag", temporary, env["SCENE_SYNTH_TEST"])


def test_whoever_is_ended_whenever_the_launch_ends_with_its_name_and_a_whole_bag(prefix: Path, tmp_path: Path) -> None:
    """Half of them record; the others have no end, so that any node that ends, ends them."""
    seed = time.time_ns()
    print(f"seed {seed}")
    draw, ends, tally = random.Random(seed), [], Counter[str]()
    for number in range(ENDS):
        suite = launched(prefix, tmp_path / str(number), **({"record": "true"} if number % 2 else {}))
        end = ended(suite, draw)
        what = f"{number}: {end.who or 'launch'} {end.how.name}\n{end.said}"
        status = suite.process.returncode
        assert status in ({1} if end.who else LAUNCH_STATUSES[end.how]), f"{status} {what}"
        assert "Traceback" not in end.said, what
        told = [line for line in end.said.splitlines() if end.who in line and ("ended by" in line or "ended before" in line)]
        assert told or not end.who, what
        assert_nothing_left(suite, what)
        tally[state_of(suite.bag, what) if number % 2 else "no recorder"] += 1
        ends.append(end)
        print(f"{number}: {end.who or 'launch'} {end.how.name}, {end.seconds:.1f} s", flush=True)
    tell("launch", ends, tally)


def assert_nothing_left(suite: Suite, what: str, *, abandoned: bool = False) -> None:
    """Check that the temporary folder is empty; what was ``abandoned`` is removed first, as the next run does it."""
    if abandoned:
        with mock.patch("tempfile.tempdir", str(suite.temporary)):
            remove_abandoned_folders()
    left = [path for path in suite.temporary.iterdir() if not path.name.startswith("launch_params_")]  # launch's own
    assert not left, f"{left} {what}"


class Contents(NamedTuple):
    """What a bag holds of the camera: times of its whole frames, how many others have parts of one, and the stamps that rooms announce."""

    whole: list[int]
    torn: int
    announced: list[int]


def read_contents(bag: Path) -> Contents:
    """Read a bag; one of which nothing can be read holds nothing."""
    topics: dict[int, set[str]] = {}
    announced: set[int] = set()
    with suppress(BagReadError), BagReader(bag) as reader:
        for message in reader.messages():
            if message.topic in CAMERA:
                topics.setdefault(message.log_ns, set()).add(message.topic)
            elif message.topic == "/synth/scene":
                announced.update(announced_room(message.data).stamps_ns)
    whole = sorted(log_ns for log_ns, of_frame in topics.items() if of_frame == CAMERA)
    return Contents(whole, len(topics) - len(whole), sorted(announced))


def state_of(bag: Path, what: str) -> str:
    """Check what a bag, if need be repaired, holds of its run, and that it says how much is missing; return in which state it was."""
    if not bag.exists():
        return "no bag"
    before = read_contents(bag)
    if state := "repaired" if list(bag.glob("*.active")) else "":
        try:
            bag = repair_bag(bag, bag.with_name("repaired")).bag
        except BagReadError:
            assert not before.whole and sum(file.stat().st_size for file in bag.iterdir()) < SOME_FRAMES, what
            return "nothing to repair"
    report, found = inspect_bag(bag), read_contents(bag)
    assert not report.faults, f"{report.faults} {what}"
    assert found.whole == before.whole and not found.torn, f"{len(before.whole)} frames, {len(found.whole)}, {found.torn} torn: {what}"
    assert found.whole == found.announced[: len(found.whole)], what
    said = f"/synth/camera: {len(found.whole)} of the {ROOMS * FRAMES} frames"
    assert [line.startswith(said) for line in report.lacking] == [True], f"{report.lacking} {what}"
    return state or "whole"
