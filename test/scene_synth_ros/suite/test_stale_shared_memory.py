"""What killed processes leave in shared memory is removed, and the ports that their peers still have mapped are not taken again."""

import fcntl
import mmap
import os
import re
import signal
import sys
from pathlib import Path

import pytest
from scene_synth_ros_suite import Child, environment, stop, wait_until

from scene_synth_ros.suite.stale_shared_memory import avoid_stale_ports, remove_stale_shared_memory

SEGMENT, OTHER_SEGMENT = "fastrtps_00b0970d0c9b9bc0", "fastrtps_a08e4ef2acd17e78"
TALKER = """
from rclpy.node import Node
from std_msgs.msg import String
from scene_synth_ros.suite.process import run_node
from scene_synth_ros.suite.qos import latched_qos

class Talker(Node):
    exit_code = None

    def __init__(self):
        super().__init__("talker")
        self.create_subscription(String, "status", lambda message: print(message.data, flush=True), latched_qos(100))
        self.publisher = self.create_publisher(String, "status", latched_qos(10))
        self.publisher.publish(String(data=NAME))

run_node(Talker)
"""


def lay(folder: Path, name: str) -> list[Path]:
    """Make the files of a port or segment; return them, the lock last."""
    files = [folder / name, folder / f"sem.{name}_mutex", folder / f"{name}_el"]
    for file in files if "port" in name else files[::2]:
        file.write_bytes(bytes(4096))
    return files


def is_free(lock: Path) -> bool:
    with lock.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            return False
        return True


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_what_nobody_owns_is_removed_and_what_others_have_stays(tmp_path: Path) -> None:
    for name in ("fastrtps_port7411", SEGMENT):
        lay(tmp_path, name)
    owned = [lay(tmp_path, name) for name in ("fastrtps_port7413", OTHER_SEGMENT)]
    (tmp_path / "fastrtps_port7400_sl").touch()
    (tmp_path / "notes_el").touch()
    locks = [files[-1].open("rb") for files in owned]
    for lock in locks:
        fcntl.flock(lock, fcntl.LOCK_EX)
    remove_stale_shared_memory(tmp_path)
    kept = {path.name for files in owned for path in files if path.exists()}
    assert len(kept) == 5
    assert names(tmp_path) == {*kept, "fastrtps_port7400_sl", "notes_el"}
    assert not any(is_free(files[-1]) for files in owned)
    for lock in locks:
        lock.close()
    remove_stale_shared_memory(tmp_path)
    assert names(tmp_path) == {"fastrtps_port7400_sl", "notes_el"}


def test_a_dead_port_that_is_mapped_is_kept_taken_for_as_long_as_the_block_runs(tmp_path: Path) -> None:
    mapped, unmapped, segment = lay(tmp_path, "fastrtps_port7411"), lay(tmp_path, "fastrtps_port741"), lay(tmp_path, SEGMENT)
    views = [mmap.mmap(file.fileno(), 0) for file in (path.open("r+b") for path in (mapped[0], segment[0]))]
    with avoid_stale_ports(tmp_path):
        assert names(tmp_path) == {path.name for path in mapped}, f"{unmapped} and {segment} are of no use to anybody"
        assert not is_free(mapped[-1])
    assert is_free(mapped[-1])
    for view in views:
        view.close()
    remove_stale_shared_memory(tmp_path)
    assert not names(tmp_path)


def test_processes_that_start_at_the_same_time_all_keep_it_taken(tmp_path: Path) -> None:
    lock = lay(tmp_path, "fastrtps_port7411")[-1]
    with (tmp_path / "fastrtps_port7411").open("r+b") as file:
        view = mmap.mmap(file.fileno(), 0)
    with avoid_stale_ports(tmp_path):
        with avoid_stale_ports(tmp_path):
            pass
        assert not is_free(lock)
        view.close()
        remove_stale_shared_memory(tmp_path)
        assert lock.exists(), "who starts still counts on it"
    remove_stale_shared_memory(tmp_path)
    assert not lock.exists()


def test_without_shared_memory_nothing_happens(tmp_path: Path) -> None:
    with avoid_stale_ports(tmp_path / "none"):
        pass


def ports(pid: int) -> set[str]:
    """Return the names of the ports that a process owns."""
    links = [os.readlink(link) for link in Path(f"/proc/{pid}/fd").iterdir() if link.exists()]
    return {found[1] for link in links if (found := re.fullmatch(r"/dev/shm/(fastrtps_port\d+)_el", link))}


def maps(pid: int) -> str:
    return Path(f"/proc/{pid}/maps").read_text()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="Fast DDS keeps its files in /dev/shm on Linux only")
def test_a_node_that_starts_after_another_was_killed_takes_none_of_its_ports_and_is_heard() -> None:
    env = environment()
    talkers = []

    def start(name: str) -> Child:
        talkers.append(Child([sys.executable, "-c", TALKER.replace("NAME", repr(name))], env=env))
        return talkers[-1]

    try:
        living = start("living")
        killed = start("killed")
        wait_until(lambda: "killed\n" in living.said()[0], 120, "the first to hear the second", living)
        wait_until(lambda: any(f"{port}\n" in maps(living.pid) for port in ports(killed.pid)), 120, "a mapped port", killed)
        shared = {port for port in ports(killed.pid) if f"{port}\n" in maps(living.pid)}
        killed.send_signal(signal.SIGKILL)
        killed.wait()
        successor = start("successor")
        wait_until(
            lambda: "successor\n" in living.said()[0] and "living\n" in successor.said()[0], 120, "each to hear the other", successor
        )
        assert ports(successor.pid) and not ports(successor.pid) & shared
    finally:
        for talker in talkers:
            stop(talker)
