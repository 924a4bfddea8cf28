"""What datasets cost: processor hours for 1,000 frames of each preset, and a million rooms on one machine and on a simulated cluster.

python -m benchmarks.cost_bench [--rooms N] [--frames N] [--write]

Rooms are made as ``scene_synth estimate`` makes them, on all processors at once, at 640x480, of six room types in turn.  ``--write`` puts
the tables into ``docs/scale.md``.
"""

import argparse
import heapq
import math
import os
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.table import DOCS, Row, write_section
from scene_synth_ros.bags.dataset_files import SHARD_SCHEMA, completion_name
from scene_synth_ros.cli.parameters.render_settings import PRESETS
from scene_synth_ros.cli.parameters.run_parameters import RunWords, run_parameters
from scene_synth_ros.estimate.estimate import Estimate, sample_indices, size, span
from scene_synth_ros.estimate.room_costs import measure_rooms
from scene_synth_ros.shards.completion import Completion, document_bytes, sealed, survey
from scene_synth_ros.shards.plan import DatasetPlan, make_plan
from scene_synth_ros.shards.run_shards import finish_dataset
from scene_synth_ros.shards.store import LocalStore

_NONE = -1


@dataclass(frozen=True, slots=True, kw_only=True)
class Dataset:
    """What is made: rooms, rooms of a shard, seconds of a room (mean and coefficient of variation), bytes of a room."""

    rooms: int
    rooms_per_shard: int
    room_s: float
    room_cv: float
    room_bytes: float

    @property
    def shards(self) -> int:
        """How many shards there are."""
        return math.ceil(self.rooms / self.rooms_per_shard)


@dataclass(frozen=True, slots=True, kw_only=True)
class Cluster:
    """Where it is made: nodes and workers of each, start of a worker (s), network of a node (bytes/s), failures.

    ``between_failures_h`` is of one node, 0 for never; ``repair_s`` what it takes until a node is back.  ``shares``: every worker has its
    share of the shards from the beginning (``--shard I/N``); otherwise whoever is free takes the next one (Ray).
    """

    nodes: int
    workers: int
    start_s: float = 15.0
    node_bytes_s: float = 1.25e9
    between_failures_h: float = 0.0
    repair_s: float = 600.0
    shares: bool = False


class Outcome(NamedTuple):
    """What came of it.

    Attributes:
        seconds: until the last shard is complete.
        busy: worker-seconds of work that counts, over worker-seconds of all workers until the end.
        lost: worker-seconds of work that was lost with nodes, over those that count.
        failures: of nodes.
        mean_bytes_s: that the store takes, over the whole run.
        peak_bytes_s: that it takes in the busiest minute.
        peak_starts_s: shards that are begun in the busiest second.
    """

    seconds: float
    busy: float
    lost: float
    failures: int
    mean_bytes_s: float
    peak_bytes_s: float
    peak_starts_s: float


def shard_seconds(dataset: Dataset, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return the seconds of each shard, (shards,) float64, sums of its rooms' lognormal times."""
    variance = math.log1p(dataset.room_cv**2)
    mean = math.log(dataset.room_s) - variance / 2.0
    rooms = rng.lognormal(mean, math.sqrt(variance), dataset.rooms)
    return np.add.reduceat(rooms, np.arange(0, dataset.rooms, dataset.rooms_per_shard))


def simulate(dataset: Dataset, cluster: Cluster, rng: np.random.Generator) -> Outcome:
    """Run a dataset on a cluster with times and failures drawn at random."""
    seconds = shard_seconds(dataset, rng)
    counts = np.diff(np.append(np.arange(0, dataset.rooms, dataset.rooms_per_shard), dataset.rooms))
    sizes = counts * dataset.room_bytes
    whole = seconds + sizes * cluster.workers / cluster.node_bytes_s
    slots = cluster.nodes * cluster.workers
    queue = _Queue(len(seconds), slots, cluster.shares)
    fails = np.full(cluster.nodes, math.inf)
    if cluster.between_failures_h:
        fails = rng.exponential(cluster.between_failures_h * 3600.0, cluster.nodes)
    events = [(cluster.start_s, slot, _NONE) for slot in range(slots)]  # when a slot is free, and what it had at work when its node failed
    heapq.heapify(events)
    ends, begins, lost, failures = np.zeros(len(seconds)), list[float](), 0.0, 0
    failed_until = np.zeros(cluster.nodes)
    while events:
        now, slot, lost_shard = heapq.heappop(events)
        if lost_shard != _NONE:
            for idle in queue.give_back(slot, lost_shard):
                heapq.heappush(events, (now, idle, _NONE))
        node = slot % cluster.nodes
        if now >= fails[node]:
            failures += 1
            failed_until[node] = fails[node] + cluster.repair_s
            fails[node] = failed_until[node] + rng.exponential(cluster.between_failures_h * 3600.0)
        if now < failed_until[node]:
            heapq.heappush(events, (failed_until[node] + cluster.start_s, slot, _NONE))
            continue
        shard = queue.take(slot)
        if shard == _NONE:
            continue
        begins.append(now)
        ends[shard] = now + whole[shard]
        if ends[shard] > fails[node]:
            lost += fails[node] - now
            heapq.heappush(events, (fails[node], slot, shard))
        else:
            heapq.heappush(events, (ends[shard], slot, _NONE))
    total = float(ends.max())
    minutes = np.bincount((ends // 60.0).astype(int), sizes) / 60.0
    return Outcome(
        seconds=total,
        busy=float(whole.sum()) / (slots * total),
        lost=lost / float(whole.sum()),
        failures=failures,
        mean_bytes_s=float(sizes.sum()) / total,
        peak_bytes_s=float(minutes.max()),
        peak_starts_s=float(np.bincount(np.asarray(begins).astype(int)).max()),
    )


class _Queue:
    """Shards that wait: one queue for all, or one for each slot."""

    def __init__(self, shards: int, slots: int, shares: bool) -> None:
        self._queues = [list(range(slot, shards, slots))[::-1] for slot in range(slots)] if shares else [list(range(shards))[::-1]]
        self._idle: list[int] = []

    def take(self, slot: int) -> int:
        """Return the next shard of a slot; ``_NONE`` if it has none, and is idle then."""
        queue = self._queues[slot % len(self._queues)]
        if queue:
            return queue.pop()
        self._idle.append(slot)
        return _NONE

    def give_back(self, slot: int, shard: int) -> list[int]:
        """Put a shard back to the front; return a slot that was idle and may take it, if there is one."""
        self._queues[slot % len(self._queues)].append(shard)
        return [self._idle.pop()] if self._idle and len(self._queues) == 1 else []


MILLION, FRAMES = 10**6, 8
TYPES = ("bedroom", "living_room", "kitchen", "bathroom", "office", "dining_room")
GROUND_TRUTH = "ground_truth"
PROFILES = (GROUND_TRUTH, *PRESETS)
NODES, CORES = 100, 32
CLUSTERS = {
    "tasks (Ray), nothing fails": Cluster(nodes=NODES, workers=CORES),
    "shares (`--shard I/N`), nothing fails": Cluster(nodes=NODES, workers=CORES, shares=True),
    "tasks, a node fails every 100 h": Cluster(nodes=NODES, workers=CORES, between_failures_h=100.0),
    "tasks, a node fails every 4 h (spot)": Cluster(nodes=NODES, workers=CORES, between_failures_h=4.0),
    "the same, shards of 4 rooms": Cluster(nodes=NODES, workers=CORES, between_failures_h=4.0),
    "shares, a node fails every 4 h (spot)": Cluster(nodes=NODES, workers=CORES, between_failures_h=4.0, shares=True),
    "tasks, 1 Gbit/s for each node": Cluster(nodes=NODES, workers=CORES, node_bytes_s=1.25e8),
}
SMALLER = {"the same, shards of 4 rooms": 4}
"""Rooms of a shard, where they are not the usual number."""
_SAMPLE, _SAMPLE_FRAMES, _SEED = 6, 2, 1
_MANIFEST_ROOMS = 100_000


class Cost(NamedTuple):
    """A profile's name and the estimate of a million rooms of it."""

    name: str
    estimate: Estimate


def measure() -> list[Row]:
    """Return processor hours for 1,000 frames of each profile, with the ends of their intervals."""
    rows = []
    for cost in costs(PROFILES, _SAMPLE, _SAMPLE_FRAMES):
        for end, hours in zip(("", ", low", ", high"), thousand_frames_h(cost.estimate), strict=True):
            rows.append(Row(f"{cost.name}{end}, processor hours for 1,000 frames", hours, "h"))
    return rows


def costs(profiles: Sequence[str], rooms: int, frames: int) -> list[Cost]:
    """Measure some rooms of each profile, some frames of each."""
    workers = len(os.sched_getaffinity(0))
    made = []
    for name in profiles:
        plan = make_plan(run_parameters(words_of(name)))
        measured = measure_rooms(plan.settings_of(0), sample_indices(plan.rooms, rooms, len(TYPES)), frames, workers)
        estimate = Estimate(
            rooms=plan.rooms, frames=plan.frames, rooms_per_shard=plan.rooms_per_shard, workers=workers, machines=NODES, measured=measured
        )
        made.append(Cost(name, estimate))
        print(f"{name}\n{estimate.text()}", file=sys.stderr, flush=True)
    return made


def words_of(profile: str) -> RunWords:
    """Return what makes a million rooms with a profile."""
    of_preset = {} if profile == GROUND_TRUTH else {"overlay": (Path(profile),)}
    params = Path(GROUND_TRUTH if profile == GROUND_TRUTH else "main")
    types = f"grammar_node.scene.room_type:={','.join(TYPES)}"
    return RunWords(params=params, **of_preset, overrides=(types,), rooms=MILLION, frames=FRAMES, record=Path("bag"))


def thousand_frames_h(estimate: Estimate) -> tuple[float, ...]:
    """Return processor hours for 1,000 frames: mean, low, high."""
    return tuple(estimate.processor_s.times(1000.0 / (3600.0 * estimate.rooms * estimate.frames)))


def cost_table(made: Sequence[Cost]) -> str:
    """Return the table of profiles in Markdown."""
    lines = [
        "| profile | processor hours for 1,000 frames | a frame | a worker's memory | 10⁶ rooms: processor hours | bytes | time here |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name, estimate in made:
        mean, low, high = thousand_frames_h(estimate)
        frame = size(estimate.bytes.mean / (estimate.rooms * estimate.frames))
        cells = [f"`{name}`", f"{mean:.3g} ({low:.3g} to {high:.3g})", frame, size(estimate.measured.memory_bytes)]
        cells += [f"{estimate.processor_s.mean / 3600.0:,.0f}", size(estimate.bytes.mean), span(estimate.seconds(1).mean)]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def machine_table(made: Sequence[Cost], disk_bytes_s: float) -> str:
    """Return, in Markdown, how many workers of each profile the disk and the memory of this machine could take."""
    memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    lines = [
        f"This machine: {len(os.sched_getaffinity(0))} processors, {size(memory)} of memory, a disk that takes {size(disk_bytes_s)}/s.",
        "",
        "| profile | a worker writes | workers that the disk could take | workers that the memory could take |",
        "| --- | --- | --- | --- |",
    ]
    for name, estimate in made:
        seconds = sum(cost.of_frames(estimate.frames).wall_s for cost in estimate.measured.rooms)
        rate = sum(cost.bytes_of_frames(estimate.frames) for cost in estimate.measured.rooms) / seconds
        room_for = f"{disk_bytes_s / rate:,.0f} | {memory // estimate.measured.memory_bytes}"
        lines.append(f"| `{name}` | {size(rate)}/s | {room_for} |")
    return "\n".join(lines)


def disk_bytes_s(count: int = 2**30) -> float:
    """Return how fast a new file of random bytes comes to the disk of the working directory, bytes/s."""
    piece = np.random.default_rng(0).bytes(2**24)
    with tempfile.NamedTemporaryFile(dir=".") as file:
        began = time.perf_counter()
        for _ in range(count // len(piece)):
            file.write(piece)
        file.flush()
        os.fsync(file.fileno())
        return count / (time.perf_counter() - began)


def simulated_dataset(estimate: Estimate) -> Dataset:
    """Return a million rooms as the simulation takes them."""
    seconds = np.array([cost.of_frames(estimate.frames).wall_s for cost in estimate.measured.rooms])
    return Dataset(
        rooms=estimate.rooms,
        rooms_per_shard=estimate.rooms_per_shard,
        room_s=float(seconds.mean()),
        room_cv=float(seconds.std(ddof=1) / seconds.mean()),
        room_bytes=estimate.bytes.mean / estimate.rooms,
    )


def cluster_table(made: Sequence[Cost]) -> str:
    """Return the table of simulated clusters in Markdown."""
    lines = [
        "| profile | cluster | time | workers busy | made twice | nodes failed | store, mean | busiest minute | shards begun, mean |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name, estimate in made:
        usual = simulated_dataset(estimate)
        for cluster_name, cluster in CLUSTERS.items():
            dataset = replace(usual, rooms_per_shard=SMALLER.get(cluster_name, usual.rooms_per_shard))
            lines.append(_cluster_row(name, cluster_name, dataset, simulate(dataset, cluster, np.random.default_rng(_SEED))))
    return "\n".join(lines)


def _cluster_row(profile: str, cluster: str, dataset: Dataset, outcome: Outcome) -> str:
    cells = [f"`{profile}`", cluster, span(outcome.seconds), f"{100.0 * outcome.busy:.1f} %", f"{100.0 * outcome.lost:.2f} %"]
    cells += [str(outcome.failures), f"{size(outcome.mean_bytes_s)}/s", f"{size(outcome.peak_bytes_s)}/s"]
    return f"| {' | '.join(cells)} | {dataset.shards / outcome.seconds:.3g}/s |"


def manifest_figures(rooms: int = _MANIFEST_ROOMS) -> str:
    """Return, in words, what the completion files and the manifest of a large dataset weigh, and how long it takes to write that."""
    plan = make_plan(run_parameters(replace(words_of(GROUND_TRUTH), rooms=rooms)))
    with tempfile.TemporaryDirectory() as folder:
        store = LocalStore(Path(folder))
        for shard in range(plan.shards):
            path = store.root / completion_name(shard)
            path.parent.mkdir(exist_ok=True)
            completion = _completion(plan, shard)
            path.write_bytes(document_bytes(completion))
            for row in completion["files"]:
                file = path.parent / row["name"]
                file.parent.mkdir(exist_ok=True)
                with file.open("wb") as sparse:
                    sparse.truncate(row["bytes"])
        began = time.perf_counter()
        assert finish_dataset(plan, store, survey(plan, store))
        seconds, weight = time.perf_counter() - began, (store.root / "manifest.json").stat().st_size
    return f"{plan.shards:,} completion files of {rooms:,} rooms: a manifest of {size(weight)}, written in {span(seconds)}."


def _completion(plan: DatasetPlan, shard: int) -> Completion:
    """Return a completion file like those of ``ground_truth``, whose hashes are of nothing."""
    sha256, name = "0" * 64, f"{shard:05d}"
    objects = dict.fromkeys(("bed", "chair", "desk", "lamp", "nightstand", "picture", "plant", "shelf", "wardrobe"), 1)
    completion = Completion(
        schema=SHARD_SCHEMA,
        shard=shard,
        first_room=plan.rooms_of(shard).start,
        rooms=[
            {
                "index": index,
                "seed": plan.seed,
                "room_type": "bedroom",
                "scene_id": f"bedroom-{plan.seed}-{index}",
                "scene_sha256": sha256,
                "frames": plan.frames,
                "floor_area_m2": 12.345678,
                "objects": objects,
            }
            for index in plan.rooms_of(shard)
        ],
        failed=[],
        files=[{"name": f"{name}/{file}", "bytes": 10**8, "sha256": sha256} for file in (f"{name}_0.mcap", "metadata.yaml")],
        layers={f"/synth/camera/layer_{number}/image_raw": sha256 for number in range(20)},
        messages=10_000,
        provenance=plan.provenance[0].to_mapping(),
        sha256="",
    )
    return sealed(completion)


def main() -> None:
    """Measure, print, and write the tables."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.cost_bench")
    parser.add_argument("--rooms", type=int, default=12, help="to measure of each profile (default: 12)")
    parser.add_argument("--frames", type=int, default=2, help="to render of each room (default: 2)")
    parser.add_argument("--profiles", nargs="+", choices=PROFILES, default=PROFILES, help="that are measured (default: all)")
    parser.add_argument("--write", action="store_true", help="write the tables into docs/scale.md")
    arguments = parser.parse_args()
    made = costs(arguments.profiles, arguments.rooms, arguments.frames)
    on_clusters = [cost for cost in made if cost.name in (GROUND_TRUTH, "balanced")]
    parts = {
        "costs": cost_table(made),
        "machine": machine_table(made, disk_bytes_s()),
        "clusters": cluster_table(on_clusters),
        "manifest": manifest_figures(),
    }
    print("\n\n".join(parts.values()))
    if arguments.write:
        for name, text in parts.items():
            write_section(DOCS / "scale.md", name, text)


if __name__ == "__main__":
    main()
