"""An installed copy of the repository, and ROS 2's launch on it."""

import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

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


def colcon_install(folder: Path) -> Path:
    """Build the repository with colcon in an empty folder; return where the package is installed."""
    words = ["--log-base", "log", "build", "--base-paths", str(ROOT), "--build-base", "build", "--install-base", "install"]
    environment = {**os.environ, "PATH": _path()}
    process = subprocess.run(
        [sys.executable, "-m", "colcon", *words], cwd=folder, env=environment, capture_output=True, text=True, timeout=300, check=False
    )
    assert process.returncode == 0, process.stdout + process.stderr
    return folder / "install" / "scene_synth_ros"


def site_packages(installed: Path) -> Path:
    """Return where the modules of an installed copy are."""
    (site,) = installed.glob("lib/python3*/site-packages")
    return site


def launch_command(installed: Path, file: str, **arguments: object) -> list[str]:
    """Return a command that runs a launch file of an installed copy, as ``ros2 launch`` does."""
    path = installed / "share" / "scene_synth_ros" / "launch" / file
    return [sys.executable, "-c", _LAUNCH, str(path), *(f"{name}:={value}" for name, value in arguments.items())]


def launch_environment(installed: Path, environment: Mapping[str, str], logs: Path) -> dict[str, str]:
    """Return the environment in which launch finds an installed copy, and writes its logs into a folder."""
    modules, prefixes = os.environ.get("PYTHONPATH", ""), os.environ.get("AMENT_PREFIX_PATH", sys.prefix)
    own = {"PYTHONPATH": f"{site_packages(installed)}{os.pathsep}{modules}", "PATH": _path(), "ROS_LOG_DIR": str(logs)}
    return {**environment, **own, "AMENT_PREFIX_PATH": f"{installed}{os.pathsep}{prefixes}"}


def _path() -> str:
    return f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
