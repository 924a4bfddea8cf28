"""What the launch files share: everything is checked before the first node starts, and a node that ends early ends the whole launch.

Imports ROS 2's launch, so only launch files import this.
"""

import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from ament_index_python.packages import PackageNotFoundError, get_package_prefix
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch.events.process import ProcessExited
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from launch import LaunchContext, LaunchDescription
from scene_description.share import config_path
from scene_description.strict import whole_number
from scene_synth_ros.cli.options import UsageError
from scene_synth_ros.cli.parameters.run_profile import find_profile, load_profile
from scene_synth_ros.cli.processes.supervisor import describe_end
from scene_synth_ros.suite.environment import LAUNCH

LOG_LEVELS = ("debug", "info", "warn", "error", "fatal")


class Arguments:
    """The arguments of a launch as text, each checked when it is read.

    Raises (every method):
        UsageError, ProfileError: the argument does not fit; one line with its name.
    """

    def __init__(self, context: LaunchContext) -> None:
        self._context = context

    def text(self, name: str) -> str:
        """Return an argument as it was given."""
        return str(LaunchConfiguration(name).perform(self._context))

    def flag(self, name: str) -> bool:
        """Return whether ``true`` or ``false`` was given."""
        text = self.text(name).lower()
        if text not in ("true", "false"):
            raise UsageError(f"{name}: expected true or false, got '{text}'")
        return text == "true"

    def number(self, name: str) -> int:
        """Return a whole number."""
        text = self.text(name)
        number = whole_number(text.removeprefix("-"))
        if number is None:
            raise UsageError(f"{name}: expected a whole number, got '{text:.100}'")
        return -number if text.startswith("-") else number

    def new_folder(self, name: str) -> str:
        """Return the path of a folder that does not exist yet."""
        text = self.text(name)
        if Path(text).exists():
            raise UsageError(f"{name} {text}: exists already; choose another folder or remove it")
        return text

    def log_level(self, name: str) -> str:
        """Return a level that ROS knows."""
        text = self.text(name).lower()
        if text not in LOG_LEVELS:
            raise UsageError(f"{name}: expected one of {', '.join(LOG_LEVELS)}, got '{text}'")
        return text

    def profiles(self, *names: str) -> list[str]:
        """Return the parameter files of arguments, files or shipped ones by name; those left empty are left out."""
        return [str(find_profile(Path(self.text(name)))) for name in names if self.text(name)]

    def clock(self, name: str, files: Iterable[str]) -> str:
        """Return ``simulated`` or ``wall``: the argument or, if it is empty, what parameter files say of the grammar node."""
        text = self.text(name).lower()
        for file in () if text else files:
            text = load_profile(Path(file))["grammar_node"].get("clock", text)
        if text not in ("", "simulated", "wall"):
            raise UsageError(f"{name}: expected simulated or wall, got '{text}'")
        return text or "simulated"

    def wants(self, name: str, package: str) -> bool:
        """Return whether a flag is set that needs another package, which is there then."""
        if not self.flag(name):
            return False
        try:
            get_package_prefix(package)
        except PackageNotFoundError:
            distribution = os.environ.get("ROS_DISTRO", "jazzy")
            hint = f"sudo apt install ros-{distribution}-{package.replace('_', '-')}"
            raise UsageError(f"{name}: the package {package} is not installed; {hint}") from None
        return True


class SuiteEnd:
    """When a launch is over: with the last node of the suite, or early, with exit status 1, with one that ends before its time.

    Threading: launch's event loop calls everything.

    Args:
        nodes: names of the suite's nodes.
        by_themselves: whether they end when their work is done; nodes that do not are ended by somebody when they end with status 0.
        with_last: whether the launch ends with the last of them, whatever runs beside them.
    """

    def __init__(self, nodes: Iterable[str], *, by_themselves: bool, with_last: bool = True) -> None:
        self._running, self._by_themselves, self._with_last = set(nodes), by_themselves, with_last

    def of(self, name: str) -> Callable[[ProcessExited, LaunchContext], Any]:
        """Return what launch shall do when the process of a node has ended."""

        def on_exit(event: ProcessExited, context: LaunchContext) -> Any:
            self._running.discard(name)
            if event.returncode == 0 and self._by_themselves:
                return [Shutdown(reason="all nodes are done")] if self._with_last and not self._running else None
            reason = describe_end(name, event.returncode) if event.returncode else f"{name} has ended before the run was over"
            if not context.is_shutdown:
                # launch counts what its event loop's handler is told as an error, and returns 1 after an orderly end
                context.asyncio_loop.call_exception_handler({"message": reason})
            return [Shutdown(reason=reason)]

        return on_exit


NAMESPACE = {"namespace": ("/synth", "Namespace of nodes and topics")}
BAG = {"bag_path": ("synth_bag", "Folder of the bag; must not exist")}
RVIZ = {"rviz": ("false", "Start RViz with the view of this package")}
"""Arguments that several launches have: name -> default and meaning."""


def described(nodes: Callable[[Arguments], list[Any]], declared: Mapping[str, tuple[str | None, str]]) -> LaunchDescription:
    """Return a launch of the nodes that a function makes of its arguments, once every argument is known to fit.

    Args:
        nodes: makes them.
        declared: argument -> default, None where it must be given, and meaning.
    """
    return LaunchDescription(
        [
            *(DeclareLaunchArgument(name, default_value=value, description=text) for name, (value, text) in declared.items()),
            OpaqueFunction(function=lambda context: nodes(Arguments(context))),
        ]
    )


def suite_node(
    name: str, end: SuiteEnd, *, namespace: str, executable: str = "", additional_env: Mapping[str, str] | None = None, **options: Any
) -> Node:
    """Return a node of this package, which ends with the launch; ``executable`` where it is called otherwise than its program."""
    program = executable or name
    return Node(
        package="scene_synth_ros",
        executable=program,
        name=name,
        namespace=namespace,
        output="screen",
        on_exit=end.of(name),
        additional_env={LAUNCH: str(os.getpid()), **(additional_env or {})},
        **options,
    )


def rviz_node(*, simulated: bool) -> Node:
    """Return RViz with the view of this package; ``simulated``: by the time of ``/clock``."""
    view = ["-d", str(config_path("views/synth.rviz"))]
    return Node(package="rviz2", executable="rviz2", arguments=view, parameters=[{"use_sim_time": simulated}])
