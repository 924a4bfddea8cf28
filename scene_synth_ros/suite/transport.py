"""Which transport the nodes speak over: large images need more shared memory than Fast DDS has by default.

Publishers decide: an image lies in the shared memory of the process that sends it.  With the default segment of half a megabyte a 640x480
image does not fit, is sent again when the subscriber complains, and is overwritten in the publisher's history before it has arrived.

Everything that makes a node goes through :func:`~scene_synth_ros.suite.process.init_ros`, which calls this first.
"""

from __future__ import annotations

import fcntl
import os
import re
from collections.abc import Iterator, MutableMapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import IO

from rclpy.utilities import get_rmw_implementation_identifier

from scene_description.share import config_path

SHARED_MEMORY = Path("/dev/shm")
_OWNED = re.compile(r"(fastrtps_(?:port\d+|[0-9a-f]{16}))_el")


@contextmanager
def avoid_stale_ports(folder: Path = SHARED_MEMORY) -> Iterator[None]:
    """Remove stale shared memory; while the block runs, stale ports that live processes have mapped cannot be taken.

    Args:
        folder: where shared memory is; harmless if there is none.
    """
    with ExitStack() as locks:
        stale = {name: locks.enter_context(lock) for name, lock in _stale(folder)}
        mapped = _mapped(folder) if stale else set()
        for name in stale.keys() - mapped:
            if _is_alone(folder, name, stale[name]):
                _remove(folder, name)
                stale[name].close()
        yield


def remove_stale_shared_memory(folder: Path = SHARED_MEMORY) -> None:
    """Remove shared memory whose owners are dead, but for ports that live processes have mapped."""
    with avoid_stale_ports(folder):
        pass


def _stale(folder: Path) -> Iterator[tuple[str, IO[bytes]]]:
    """Yield the ports and segments that no process owns, with their locks, now shared with others that start: owners lock alone."""
    for path in folder.glob("fastrtps_*_el"):
        found = _OWNED.fullmatch(path.name)
        if found is None:
            continue
        try:
            lock = path.open("rb")
        except OSError:  # gone, or another user's
            continue
        try:
            fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except OSError:  # its owner lives
            lock.close()
        else:
            yield found[1], lock


def _is_alone(folder: Path, name: str, lock: IO[bytes]) -> bool:
    """Return whether the lock is this process's alone now, and still that of the file of this name: then nobody can own or remove it."""
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return os.path.samestat(os.fstat(lock.fileno()), os.stat(folder / f"{name}_el"))
    except OSError:
        return False


def _mapped(folder: Path) -> set[str]:
    """Return the names of the ports that live processes have mapped; another user's processes count as far as they can be read."""
    pattern = re.compile(re.escape(f"{folder}/").encode() + rb"(fastrtps_port\d+)$", re.MULTILINE)
    names: set[str] = set()
    for maps in Path("/proc").glob("[0-9]*/maps"):
        with suppress(OSError):
            names.update(name.decode() for name in pattern.findall(maps.read_bytes()))
    return names


def _remove(folder: Path, name: str) -> None:
    for file in (name, f"sem.{name}_mutex", f"{name}_el"):
        with suppress(OSError):
            (folder / file).unlink()


PROFILE = "fastdds_large_images.xml"
PROFILE_VARIABLE, TRANSPORTS_VARIABLE = "FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_BUILTIN_TRANSPORTS"
LOCAL_PROFILE, SKIP_VARIABLE = "DEFAULT_FASTRTPS_PROFILES.xml", "SKIP_DEFAULT_XML_FILE"
"""Where Fast DDS 2.14, that of ROS 2 Jazzy, takes a transport from: a file by the first variable, a choice by the second, and the file of
that name in the working directory unless the last variable is 1."""


def choose_transport(environment: MutableMapping[str, str] = os.environ) -> str:
    """Let Fast DDS load the shipped profile, unless the user has chosen; to be called before ``rclpy.init``.

    Args:
        environment: of this process; changed.

    Returns:
        What there is to say of the user's own choice, in one line; empty if there is none, or if the middleware is not Fast DDS.
    """
    if "fastrtps" not in get_rmw_implementation_identifier():
        return ""
    shipped = str(config_path(PROFILE))
    own = _own_choice(environment)
    if not own:
        environment[PROFILE_VARIABLE] = shipped
    if not own or environment.get(PROFILE_VARIABLE) == shipped:
        return ""
    return f"the transport is your own, {own}; large images may be lost where it has less shared memory than {shipped}"


def _own_choice(environment: MutableMapping[str, str]) -> str:
    """Return what the user has chosen, empty if nothing."""
    for variable in (PROFILE_VARIABLE, TRANSPORTS_VARIABLE):
        if environment.get(variable):
            return f"{variable}={environment[variable]}"
    if environment.get(SKIP_VARIABLE) != "1" and Path(LOCAL_PROFILE).exists():
        return str(Path(LOCAL_PROFILE).absolute())
    return ""
