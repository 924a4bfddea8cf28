"""Every node comes with the transport that it needs, unless the user has chosen."""

import subprocess
import sys
from pathlib import Path

import pytest
from scene_synth_ros_suite import environment

from scene_description.share import config_path
from scene_synth_ros.suite import transport
from scene_synth_ros.suite.transport import LOCAL_PROFILE, PROFILE_VARIABLE, SKIP_VARIABLE, TRANSPORTS_VARIABLE, choose_transport

SHIPPED = str(config_path("fastdds_large_images.xml"))
SEGMENT = """
import re
from pathlib import Path
from rclpy.node import Node
from scene_synth_ros.suite.process import run_node

class Measured(Node):
    def __init__(self):
        super().__init__("measured")
        spans = re.findall(r"^([0-9a-f]+)-([0-9a-f]+) .*/fastrtps_[0-9a-f]{16}$", Path("/proc/self/maps").read_text(), re.MULTILINE)
        print(max(int(end, 16) - int(begin, 16) for begin, end in spans))
        self.exit_code = 0

    def close(self):
        pass

run_node(Measured, [])
"""


@pytest.fixture(autouse=True)
def empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_who_has_chosen_nothing_gets_the_shipped_profile() -> None:
    surroundings: dict[str, str] = {}
    assert choose_transport(surroundings) == ""
    assert surroundings == {PROFILE_VARIABLE: SHIPPED}
    assert choose_transport(surroundings) == "", "a child process inherits it"


@pytest.mark.parametrize("own", [{PROFILE_VARIABLE: "/my.xml"}, {TRANSPORTS_VARIABLE: "LARGE_DATA"}])
def test_what_the_user_has_chosen_stays_and_is_told(own: dict[str, str]) -> None:
    surroundings = dict(own)
    line = choose_transport(surroundings)
    assert surroundings == own
    ((name, value),) = own.items()
    assert line.startswith(f"the transport is your own, {name}={value}; ")


def test_a_profile_in_the_working_directory_is_the_users_unless_fast_dds_skips_it(empty_folder: Path) -> None:
    (empty_folder / LOCAL_PROFILE).write_text("<dds/>")
    surroundings: dict[str, str] = {}
    assert str(empty_folder / LOCAL_PROFILE) in choose_transport(surroundings) and not surroundings
    surroundings = {SKIP_VARIABLE: "1"}
    assert choose_transport(surroundings) == "" and surroundings[PROFILE_VARIABLE] == SHIPPED


def test_another_middleware_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(transport, "get_rmw_implementation_identifier", lambda: "rmw_cyclonedds_cpp")
    surroundings: dict[str, str] = {}
    assert choose_transport(surroundings) == "" and not surroundings


@pytest.mark.parametrize("own", [False, True])
def test_a_node_process_has_shared_memory_for_large_images(own: bool) -> None:
    env = {name: value for name, value in environment().items() if name not in (PROFILE_VARIABLE, TRANSPORTS_VARIABLE)}
    env |= {TRANSPORTS_VARIABLE: "DEFAULT"} if own else {}
    done = subprocess.run([sys.executable, "-c", SEGMENT], env=env, capture_output=True, text=True, timeout=300, check=True)
    assert (int(done.stdout) > 16_000_000) != own
    assert ("the transport is your own, FASTDDS_BUILTIN_TRANSPORTS=DEFAULT" in done.stderr) == own
