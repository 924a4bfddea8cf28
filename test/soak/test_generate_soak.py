"""Runs of ``scene_synth generate`` that are ended at random moments, in a folder and in an object store; slow, run by ``make soak``.

The seed is taken from the clock and printed; ``SOAK_SEED`` repeats one, as far as processes do.  ``SOAK_KILLS`` runs of a small dataset are
ended, and as many of one of ``SOAK_ROOMS`` rooms, 2,000 and 50 for the full measure; ``SOAK_MINUTES`` bounds the second.
"""

import hashlib
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest
from ray_cluster import NODE, ray_cluster
from s3_server import BUCKET, s3_server
from scene_synth_ros_suite import marked_processes

from scene_synth_ros.bags.dataset_files import DATASET_MANIFEST_NAME
from scene_synth_ros.shards.completion import faults_of, read_completion
from scene_synth_ros.shards.open_store import open_store
from scene_synth_ros.shards.plan import read_plan
from scene_synth_ros.shards.store import Store

pytestmark = pytest.mark.soak

KILLS = int(os.environ.get("SOAK_KILLS", "20"))
SEED = int(os.environ.get("SOAK_SEED", "0")) or time.time_ns() % 2**32
ROOMS, WORKERS, LONGEST_S = 12, 2, 20.0
MANY, MINUTES, NODES = (int(os.environ.get(f"SOAK_{name}", default)) for name, default in (("ROOMS", 200), ("MINUTES", 60), ("NODES", 2)))
"""Rooms of the large dataset, how long it may take, and nodes of Ray that are lost."""
SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGKILL)
VICTIMS = ("worker", "run", "all")
WORDS = ["--rooms", str(ROOMS), "--frames", "2", "--seed", "5", "--shard-rooms", "1", "--workers", str(WORKERS), "--params", "ground_truth"]
WORDS += ["-p", "renderer_node.camera.width:=64", "-p", "renderer_node.camera.height:=48"]
LAYERS = ("color", "normals", "semantic", "instance")
LARGE = ["--rooms", str(MANY), "--frames", "1", "--seed", "5", "--shard-rooms", "4", "--workers", str(WORKERS), "--params", "ground_truth"]
LARGE += ["-p", "renderer_node.camera.width:=16", "-p", "renderer_node.camera.height:=12", "-p", "grammar_node.scene.room_type:=hallway"]
LARGE += [word for layer in LAYERS for word in ("-p", f"renderer_node.streams.{layer}:=false")]
"""Depth alone, of the rooms that are sampled in the least time and have the fewest objects."""
SCENE_SYNTH = [sys.executable, "-m", "scene_synth_ros"]


class Run:
    """A run of the command in a session of its own, with a temporary folder of its own."""

    def __init__(self, out: str, temporary: Path, words: list[str] = WORDS) -> None:
        temporary.mkdir(exist_ok=True)
        self.marker = f"SCENE_SYNTH_TEST={os.getpid()}-{temporary}"
        env = {**os.environ, "TMPDIR": str(temporary), "SCENE_SYNTH_TEST": self.marker.partition("=")[2]}
        self.process = subprocess.Popen(
            [*SCENE_SYNTH, "generate", *words, "--resume", "--out", out],
            env=env,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # which the shell of a job in the background ignores
        )

    def workers(self) -> list[int]:
        """Return the worker processes."""
        own = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children")
        try:
            children = [int(word) for word in own.read_text().split()]
            return [pid for pid in children if b"scene_synth_ros.workers.worker" in Path(f"/proc/{pid}/cmdline").read_bytes()]
        except OSError:
            return []

    def left(self) -> list[int]:
        """Return the processes of the run that live."""
        return [int(process.name) for process in marked_processes(self.marker)]


class Place(NamedTuple):
    """Where a dataset goes."""

    name: str
    out: str
    temporary: Path

    @property
    def store(self) -> Store:
        return open_store(self.out)

    def shards(self) -> int:
        """Return how many shards are complete."""
        return sum(name.endswith(".json") for name in self.store.names("shards"))

    def clear(self) -> None:
        for name in self.store.names(""):
            self.store.remove(name)
        if self.name == "disk":
            shutil.rmtree(self.out, ignore_errors=True)


@pytest.fixture(scope="module")
def places(tmp_path_factory: pytest.TempPathFactory) -> Iterator[list[Place]]:
    folder = tmp_path_factory.mktemp("kills")
    with s3_server():
        yield [Place("disk", str(folder / "out"), folder / "t1"), Place("s3", f"s3://{BUCKET}/out", folder / "t2")]


def expected_statuses(victim: str, number: signal.Signals) -> set[int]:
    """Return how a run may end; one that is ended while it loads its modules has no handlers yet."""
    if victim == "worker":
        return {0} if number == signal.SIGINT else {2}
    return {-number} if number == signal.SIGKILL else {-number, 128 + number}


def test_runs_that_are_ended_at_random_moments_lose_and_leave_nothing(places: list[Place], capsys: pytest.CaptureFixture[str]) -> None:
    draw, kinds, times = random.Random(SEED), Counter[str](), []
    whole = {place.name: made_whole(place) for place in places}
    assert whole["disk"] == whole["s3"]
    rounds = [(place, victim, number) for place in places for victim in VICTIMS for number in SIGNALS]
    kills = 0
    while kills < KILLS:
        place, victim, number = rounds[kills % len(rounds)] if kills % len(rounds) else (draw.shuffle(rounds), rounds[0])[1]
        if place.shards() == ROOMS:
            place.clear()
        left_before = set(place.temporary.iterdir())  # of a run all of whose processes were killed at once
        run = Run(place.out, place.temporary)
        what = f"{place.name}: {victim} by {number.name} ({kills + 1} of {KILLS}, seed {SEED})"
        if not hit(run, place, victim, number, draw):  # it was as good as over
            assert run.process.wait() == 0, what
            continue
        kills += 1
        began = time.monotonic()
        output, _ = run.process.communicate(timeout=LONGEST_S + (600.0 if (victim, number) == ("worker", signal.SIGINT) else 0.0))
        while (left := run.left()) and time.monotonic() - began < LONGEST_S:
            time.sleep(0.05)
        assert not left, f"{what}: {left} live on"
        status = run.process.returncode
        assert status in expected_statuses(victim, number), f"{what}: {status}: {output}"
        assert "Traceback" not in output, f"{what}: {output}"
        if status == 2:
            assert f"was ended by {number.name}" in output.splitlines()[-1], f"{what}: {output}"
        if status != 0:
            times.append(time.monotonic() - began)
        left_files = set(place.temporary.iterdir()) - left_before
        assert not left_files or (victim, number) == ("all", signal.SIGKILL), f"{what}: {left_files}"
        assert not set(complete_files(place).items()) - set(whole[place.name].items()), what
        kinds[f"{place.name} {victim} {number.name}"] += 1
    for place in places:
        assert made_whole(place) == whole[place.name]
        assert not list(place.temporary.iterdir())
    with capsys.disabled():
        longest, median = max(times), sorted(times)[len(times) // 2]
        print(f"\nseed {SEED}: {kills} kills of generate ({', '.join(f'{count} {kind}' for kind, count in sorted(kinds.items()))});")
        print(f"over after {median:.1f} s (median), {longest:.1f} s (longest); the same bytes in the end, no file and no process left")


def hit(run: Run, place: Place, victim: str, number: signal.Signals, draw: random.Random) -> bool:
    """End a run, all of it or one worker, at a random moment; return False where it is over before."""
    maps = Path(f"/proc/{run.process.pid}/maps")
    while run.process.poll() is None and b"numpy" not in maps.read_bytes():  # until then it is Python that is ended
        time.sleep(0.01)
    end_s = time.monotonic() + (draw.uniform(0.0, 4.0) if draw.random() < 0.3 else 600.0)
    shards = place.shards() + draw.randint(0, 3)
    while run.process.poll() is None and place.shards() < shards and time.monotonic() < end_s:
        time.sleep(0.01)
    time.sleep(draw.uniform(0.0, 1.0))
    if victim == "worker" and place.shards() > ROOMS - WORKERS - 1:  # one may have nothing to do
        return False
    while victim == "worker" and not run.workers() and run.process.poll() is None:
        time.sleep(0.01)
    try:
        if victim == "worker":
            os.kill(draw.choice(run.workers()), number)
        elif victim == "run":
            run.process.send_signal(number)
        else:
            os.killpg(run.process.pid, number)
    except (ProcessLookupError, IndexError):
        return False
    return run.process.poll() is None or run.process.returncode != 0


def made_whole(place: Place) -> dict[str, str]:
    """Make what is missing of a dataset; return its digests."""
    run = Run(place.out, place.temporary)
    output, _ = run.process.communicate(timeout=600.0)
    assert run.process.returncode == 0, output
    assert not [name for name in Path(place.out).rglob("*.partial") if place.name == "disk"]
    return complete_files(place)


def complete_files(place: Place) -> dict[str, str]:
    """Return the SHA-256 of the completion files, whose shards are seen to be what they say, and of the manifest."""
    store, found = place.store, {}
    data = store.read("dataset.json")
    plan = read_plan(data, "") if data is not None else None
    for name in store.names("shards"):
        if plan is not None and name.endswith(".json"):
            completion = read_completion(store, plan, int(name[:-5]))
            assert completion is not None and list(faults_of(store, completion)) == []
            found[name] = hashlib.sha256(store.read(f"shards/{name}") or b"").hexdigest()
    manifest = store.read(DATASET_MANIFEST_NAME)
    return found | ({"manifest": hashlib.sha256(manifest).hexdigest()} if manifest is not None else {})


def test_many_rooms_that_are_ended_time_and_again_have_the_manifest_of_an_undisturbed_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """On disk and in an object store in turn, by every signal; then nodes of Ray are lost; the memory of workers does not grow."""
    draw, end_s, told = random.Random(SEED), time.monotonic() + 60.0 * MINUTES, []
    with s3_server():
        whole = Place("whole", str(tmp_path / "whole"), tmp_path / "t0")
        early, late, seconds = watched(whole)
        told.append(f"undisturbed: {MANY} rooms in {seconds:.0f} s, a worker's memory {early:.0f} MB early, {late:.0f} MB late")
        expected = whole.store.read(DATASET_MANIFEST_NAME)
        assert expected and late < 1.15 * early + 20.0
        for place in (Place("disk", str(tmp_path / "disk"), tmp_path / "t1"), Place("s3", f"s3://{BUCKET}/many", tmp_path / "t2")):
            kills = ended_runs(place, KILLS // 2, draw, end_s)
            if place.name == "disk":
                lost = lost_nodes(place, NODES, draw)
                told.append(f"{lost} nodes of Ray lost")
            output, _ = (run := Run(place.out, place.temporary, LARGE)).process.communicate()
            assert run.process.returncode == 0, output
            assert place.store.read(DATASET_MANIFEST_NAME) == expected, f"{place.name}, seed {SEED}"
            told.append(f"{place.name}: {sum(kills.values())} runs ended ({', '.join(f'{n} {name}' for name, n in sorted(kills.items()))})")
    with capsys.disabled():
        print(f"\nseed {SEED}: {'; '.join(told)}; equal manifests of {MANY} rooms")


def watched(place: Place) -> tuple[float, float, float]:
    """Make the large dataset; return what a worker has of memory in the second tenth of it and in the last (MB, the most), and seconds."""
    run, began, early, late = Run(place.out, place.temporary, LARGE), time.monotonic(), 0.0, 0.0
    while run.process.poll() is None:
        done = 4 * place.shards() / MANY
        most = max(map(resident_mb, run.workers()), default=0.0)
        early, late = max(early, most if 0.1 < done < 0.2 else 0.0), max(late, most if done > 0.9 else 0.0)
        time.sleep(0.2)
    output, _ = run.process.communicate()
    assert run.process.returncode == 0, output
    return early, late, time.monotonic() - began


def resident_mb(process: int) -> float:
    """Return the memory of a process, 0 of one that is gone."""
    try:
        return int(Path(f"/proc/{process}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
    except (OSError, IndexError):
        return 0.0


def ended_runs(place: Place, count: int, draw: random.Random, end_s: float) -> Counter[str]:
    """Begin runs that go on with the large dataset and end each, at random numbers of shards all over it, until a time at the latest."""
    kills: Counter[str] = Counter()
    for target in sorted(draw.randrange(MANY // 4) for _ in range(count)):
        victim, number = draw.choice([(victim, number) for victim in VICTIMS for number in SIGNALS if (victim, number) != NO_END])
        if time.monotonic() > end_s:
            break
        run = Run(place.out, place.temporary, LARGE)
        while run.process.poll() is None and (place.shards() < target or not run.workers()):
            time.sleep(0.05)
        time.sleep(draw.uniform(0.0, 2.0))
        if run.process.poll() is None and (workers := run.workers()):
            end_one(run, victim, number, draw.choice(workers))
            kills[f"{victim} {number.name}"] += 1
        output, _ = run.process.communicate()
        assert run.process.returncode in {0, *expected_statuses(victim, number)}, f"{place.name}, {victim} {number.name}: {output}"
        assert "Traceback" not in output, output
        while run.left():
            time.sleep(0.05)
    return kills


NO_END = ("worker", signal.SIGINT)
"""Which no worker heeds."""


def end_one(run: Run, victim: str, number: signal.Signals, worker: int) -> None:
    """End a run, all its processes, or a worker."""
    if victim == "all":
        os.killpg(run.process.pid, number)
    else:
        os.kill(worker if victim == "worker" else run.process.pid, number)


def lost_nodes(place: Place, count: int, draw: random.Random) -> int:
    """Go on with the large dataset as tasks of Ray on two nodes and kill one of them at work, so many times; return how many were lost."""
    lost = 0
    with ray_cluster() as cluster:
        for _ in range(count):
            node, before = cluster.add_node(**NODE), place.shards()
            run = Run(place.out, place.temporary, [*LARGE, "--ray", cluster.address])
            while run.process.poll() is None and place.shards() < before + draw.randint(2, 6):
                time.sleep(0.1)
            lost += run.process.poll() is None
            cluster.remove_node(node, allow_graceful=False)
            after = place.shards()
            while run.process.poll() is None and place.shards() < after + 4:  # it goes on without the node
                time.sleep(0.1)
            run.process.terminate()
            output, _ = run.process.communicate()
            assert run.process.returncode in (0, 143), output
    return lost
