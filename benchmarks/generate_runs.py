"""Runs of ``generate`` that are timed, killed and resumed, and where the time of a shard goes."""

import hashlib
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
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
from scene_synth_ros.shards.make_shard import RoomsAhead, make_shard
from scene_synth_ros.shards.plan import make_plan
from scene_synth_ros.shards.store import LocalStore

SCENE_SYNTH = [sys.executable, "-m", "scene_synth_ros"]
GROUND_TRUTH = ("--params", "ground_truth")
BALANCED = ("--overlay", "balanced")
SMALL = ("-p", "renderer_node.camera.width:=160", "-p", "renderer_node.camera.height:=120")


class Taken(NamedTuple):
    """What a command took: seconds by the clock, processor seconds of it and of all its processes."""

    seconds: float
    processor_s: float


def timed(words: Sequence[str]) -> Taken:
    """Run a command of ``scene_synth`` to its end.

    Raises:
        CalledProcessError: it failed.
    """
    before, began = _children_s(), time.perf_counter()
    subprocess.run([*SCENE_SYNTH, *words], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)
    return Taken(time.perf_counter() - began, _children_s() - before)


def _children_s() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def dataset_words(out: Path, rooms: int, frames: int, *more: str, seed: int = 11) -> list[str]:
    """Return the words of a run that makes a dataset."""
    return ["generate", "--rooms", str(rooms), "--frames", str(frames), "--seed", str(seed), "--out", str(out), *more]


def manifest_sha256(folder: Path) -> str:
    """Return the SHA-256 of a dataset's manifest, in hexadecimal."""
    return hashlib.sha256((folder / "manifest.json").read_bytes()).hexdigest()


def killed(out: Path, kills: int, rooms: int, frames: int, seed: int) -> Iterator[int]:
    """Make a dataset while every run is ended by SIGKILL at a random moment; yield how many shards were there then.

    A moment is so many new shards, 0 to 3, and so many seconds, 0 to 1, after that.  The last run is let through; so is one that ends by
    itself, whereupon the dataset is begun anew, until there were as many kills.  A shard has one room.
    """
    rng = random.Random(seed)
    words = dataset_words(out, rooms, frames, *GROUND_TRUTH, *SMALL, "--shard-rooms", "1", "--resume")
    done = 0
    while done < kills:
        there, delay_s = len(_complete(out)) + rng.randint(0, 3), rng.uniform(0.0, 1.0)
        run = subprocess.Popen([*SCENE_SYNTH, *words], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while run.poll() is None and len(_complete(out)) < there:
            time.sleep(0.01)
        time.sleep(delay_s)
        if run.poll() is None:
            os.kill(run.pid, signal.SIGKILL)
            run.wait()
            done += 1
            yield len(_complete(out))
        else:
            shutil.rmtree(out)
    subprocess.run([*SCENE_SYNTH, *words], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)


def _complete(out: Path) -> list[Path]:
    return list(out.glob("shards/*.json"))


def memory_of_worker(out: Path, rooms: int, frames: int, *more: str) -> list[tuple[int, float]]:
    """Return how many rooms were done, and the resident memory of the worker then (MB), again and again in a run of one worker."""
    words = dataset_words(out, rooms, frames, "--workers", "1", "--shard-rooms", "1", *more)
    run = subprocess.Popen([*SCENE_SYNTH, *words], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    series: list[tuple[int, float]] = []
    while run.poll() is None:
        done = len(_complete(out))
        workers = [pid for pid in _children(run.pid) if "scene_synth_ros.workers.worker" in _command(pid)]
        if workers and (not series or done > series[-1][0]) and (resident := _resident_mb(workers[0])):
            series.append((done, resident))
        time.sleep(0.02)
    if run.returncode:
        raise subprocess.CalledProcessError(run.returncode, words)
    return series


def _children(pid: int) -> list[int]:
    try:
        return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    except OSError:
        return []


def _command(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode()
    except OSError:
        return ""


def _resident_mb(pid: int) -> float:
    try:
        return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
    except (OSError, IndexError):
        return 0.0


def time_of_shard(folder: Path, rooms: int, frames: int, profile: Path) -> dict[str, float]:
    """Make a shard twice, the second time with a watch; return what was done -> processor seconds.  The dataset stays."""
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
            bare.append(_spent(write_bare, Path(folder) / "bare.mcap", messages))
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


def write_bare(path: Path, messages: list[BagMessage]) -> None:
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
