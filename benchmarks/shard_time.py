"""Where the processor time of a shard goes, and what its writing costs beside the bare ``mcap`` writer."""

from __future__ import annotations

import os
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, NamedTuple
from unittest.mock import patch

from mcap.writer import CompressionType, Writer

from scene_synth_ros.bags.bag_manifest import ManifestBuilder
from scene_synth_ros.bags.bag_reader import BagMessage, BagReader
from scene_synth_ros.bags.bag_writer import DEFAULT_CHUNK_SIZE, BagWriter
from scene_synth_ros.cli.parameters.run_parameters import RunWords, run_parameters
from scene_synth_ros.mcap.file import COMPRESSORS
from scene_synth_ros.messages.message_definitions import message_definition
from scene_synth_ros.offline.offline_renderer import OfflineRenderer
from scene_synth_ros.render.room import RenderedRoom
from scene_synth_ros.shards.make_shard import make_shard
from scene_synth_ros.shards.plan import make_plan
from scene_synth_ros.shards.room_ahead import RoomsAhead
from scene_synth_ros.shards.store import LocalStore


def time_of_shard(folder: Path, rooms: int, frames: int, profile: Path) -> dict[str, float]:
    """Make a shard twice, the second time with a watch; return what was done -> processor seconds.

    Args:
        folder: of the dataset, which stays.
        rooms: of the shard.
        frames: of a room.
        profile: of the run.
    """
    one_thread = ("renderer_node.render.threads:=1",)
    words = RunWords(rooms=2 * rooms, frames=frames, seed=5, params=profile, record=Path("bag"), overrides=one_thread)
    plan, store = make_plan(run_parameters(words), rooms_per_shard=rooms), LocalStore(folder)
    make_shard(plan, 1, store)
    spent: Counter[str] = Counter()
    with _watched(spent):
        began = time.process_time()
        make_shard(plan, 0, store)
        spent["everything"] = time.process_time() - began
    return dict(spent)


@contextmanager
def _watched(spent: Counter[str]) -> Iterator[None]:
    """Sum up the processor time of some methods, each in its own thread, and of the threads that cast rays."""
    with ExitStack() as watches:
        for owner, name, what in (
            (RoomsAhead, "take", "sampling rooms"),
            (OfflineRenderer, "begin_room", "geometry of rooms"),
            (RenderedRoom, "render", "casting rays"),
            (ManifestBuilder, "add", "SHA-256 of messages"),
        ):
            watches.enter_context(patch.object(owner, name, _timed(getattr(owner, name), spent, what)))
        level = COMPRESSORS["zstd"]
        watches.enter_context(patch.dict(COMPRESSORS, {"zstd": lambda of: _timed(level(of), spent, "compression")}))  # type: ignore[arg-type]
        run = threading.Thread.run

        def run_timed(thread: threading.Thread) -> None:
            try:
                run(thread)
            finally:
                if thread.name.startswith("renderer"):
                    spent["casting rays"] += time.thread_time()

        watches.enter_context(patch.object(threading.Thread, "run", run_timed))
        yield


def _timed(function: Callable[..., Any], spent: Counter[str], what: str) -> Callable[..., Any]:
    def timed(*values: Any, **named: Any) -> Any:
        began = time.thread_time()
        try:
            return function(*values, **named)
        finally:
            spent[what] += time.thread_time() - began

    return timed


class WriteCosts(NamedTuple):
    """Processor seconds of writing the same messages: as shards are, SHA-256 of them alone, and with the bare writer, zstd both."""

    ours: float
    hashes: float
    bare: float


def write_costs(bag: Path, rounds: int) -> WriteCosts:
    """Write a bag's messages again and again; the least of each is taken."""
    with BagReader(bag) as reader:
        messages = [message._replace(data=bytes(message.data)) for message in reader.messages(file_order=True)]
    ours, hashes, bare = [], [], []
    for number in range(rounds):
        with tempfile.TemporaryDirectory(dir=bag.parent) as folder:
            ours.append(_spent(_write, Path(folder) / str(number), messages))
            hashes.append(_spent(_hash, messages))
            bare.append(_spent(_write_bare, Path(folder) / "bare.mcap", messages))
    return WriteCosts(min(ours), min(hashes), min(bare))


def _spent(work: Callable[..., None], *values: Any) -> float:
    began = time.process_time()
    work(*values)
    return time.process_time() - began


def _write(folder: Path, messages: list[BagMessage]) -> None:
    with BagWriter(folder) as writer:
        for topic, type_name in {message.topic: message.type_name for message in messages}.items():
            writer.add_topic(topic, type_name)
        for message in messages:
            writer.write(message.topic, message.data, message.log_ns, message.log_ns)


def _hash(messages: list[BagMessage]) -> None:
    builder = ManifestBuilder()
    for message in messages:
        builder.add(message.topic, message.log_ns, message.data)


def _write_bare(path: Path, messages: list[BagMessage]) -> None:
    """Write with the library's own writer, in chunks of the same size; sync once, at the end."""
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=DEFAULT_CHUNK_SIZE, compression=CompressionType.ZSTD)
        writer.start("ros2", "bench")
        types = sorted({message.type_name for message in messages})
        schemas = {name: writer.register_schema(name, "ros2msg", message_definition(name).text.encode()) for name in types}
        channels = {message.topic: message.type_name for message in messages}
        ids = {topic: writer.register_channel(topic, "cdr", schemas[name]) for topic, name in channels.items()}
        for message in messages:
            writer.add_message(ids[message.topic], message.log_ns, message.data, message.log_ns)
        writer.finish()
        file.flush()
        os.fsync(file.fileno())
