"""ROS 2's launch on this repository, without an installation."""

import os
import sys
from collections.abc import Mapping
from pathlib import Path

from scene_synth_ros.cli.processes.supervisor import NODES

ROOT = Path(__file__).resolve().parents[2]
_LAUNCH = """
import sys
from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
file, *words = sys.argv[1:]
service = LaunchService(argv=words)
arguments = [tuple(word.split(":=", 1)) for word in words]
service.include_launch_description(
    LaunchDescription([IncludeLaunchDescription(PythonLaunchDescriptionSource(file), launch_arguments=arguments)])
)
sys.exit(service.run())
"""
"""What ``ros2 launch`` does with a file and its arguments."""


def launch_prefix(folder: Path) -> Path:
    """Make a prefix in which launch finds the nodes of this repository."""
    index, programs = folder / "share" / "ament_index" / "resource_index" / "packages", folder / "lib" / "scene_synth_ros"
    for made in (index, programs):
        made.mkdir(parents=True)
    (index / "scene_synth_ros").touch()
    for name, node in NODES.items():
        (programs / name).write_text(f"#!{sys.executable}\nfrom {node.module} import main\nmain()\n")
        (programs / name).chmod(0o755)
    return folder


def launch_command(file: str, **arguments: object) -> list[str]:
    """Return a command that runs a launch file, as ``ros2 launch`` does."""
    return [sys.executable, "-c", _LAUNCH, str(ROOT / "launch" / file), *(f"{name}:={value}" for name, value in arguments.items())]


def launch_environment(prefix: Path, environment: Mapping[str, str], logs: Path) -> dict[str, str]:
    """Return the environment in which launch finds the nodes of a prefix, and writes its logs into a folder."""
    lists = {"PYTHONPATH": (str(ROOT), ""), "AMENT_PREFIX_PATH": (str(prefix), sys.prefix)}
    own = {name: os.pathsep.join([first, os.environ.get(name, default)]) for name, (first, default) in lists.items()}
    return {**environment, **own, "ROS_LOG_DIR": str(logs)}
