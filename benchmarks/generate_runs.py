"""Runs of ``scene_synth`` as a user starts them: what they take, what interruptions and many rooms do to them."""

from __future__ import annotations

import hashlib
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

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
    itself, whereupon the dataset is begun anew, until there were as many kills.

    Args:
        out: folder of the dataset.
        kills: how many.
        rooms: of the dataset, one a shard.
        frames: of a room.
        seed: of the moments.
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
        workers = [pid for pid in _children(run.pid) if "scene_synth_ros.shards.worker" in _command(pid)]
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
