"""What the launch files share: everything is checked before the first node starts, and a node that fails ends the whole launch.

Imports ROS 2's launch, so only launch files import this.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from ament_index_python.packages import PackageNotFoundError, get_package_prefix
from launch.actions import Shutdown
from launch.events.process import ProcessExited
from launch.substitutions import LaunchConfiguration

from launch import LaunchContext
from scene_synth_ros.cli.options import UsageError
from scene_synth_ros.cli.parameters.run_profile import find_profile, load_profile

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
        if not text.lstrip("-").isdigit():
            raise UsageError(f"{name}: expected a whole number, got '{text}'")
        return int(text)

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


def ending_with(name: str, *, when_done: bool) -> Callable[[ProcessExited, LaunchContext], Any]:
    """Return what to do when a node's process has ended: if it has failed, end the launch with exit status 1.

    Args:
        name: of the node.
        when_done: whether its ordinary end is that of the launch, too.
    """

    def on_exit(event: ProcessExited, context: LaunchContext) -> Any:
        if event.returncode == 0:
            return [Shutdown(reason=f"{name} is done")] if when_done else None
        reason = f"{name} has ended with exit status {event.returncode}"
        if not context.is_shutdown:
            # launch counts what its event loop's handler is told as an error, and returns 1 after an orderly end
            context.asyncio_loop.call_exception_handler({"message": reason})
        return [Shutdown(reason=reason)]

    return on_exit
