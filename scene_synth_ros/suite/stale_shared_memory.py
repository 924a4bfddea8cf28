"""Shared memory that killed processes leave behind: who starts next must not inherit their ports, nor find memory full of their messages.

Fast DDS gives each process ports (queues, files ``fastrtps_port<number>`` of /dev/shm) and segments (``fastrtps_<id>``, what the queues
point to); the owner holds a lock on a file of the same name with ``_el``.  A process that is killed leaves them all.  The next one to take
the same number replaces the port, but peers that have the old one mapped may go on writing into that: nothing of theirs arrives any more
(Fast DDS 2.14; its pull request 4728 describes the fault).

A port or segment is stale when its owner is dead.  The numbers of stale ports that somebody has mapped are kept taken while a process
starts; everything else that is stale is removed, as the command ``fastdds shm clean`` does.
"""

import fcntl
import os
import re
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import IO

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
        owned = _OWNED.fullmatch(path.name)
        if owned is None:
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
            yield owned[1], lock


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
