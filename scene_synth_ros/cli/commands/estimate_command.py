"""``scene_synth estimate``: a few rooms of a dataset are made and measured, and what all of it will cost is said."""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path

from tqdm import tqdm

from scene_synth_ros.cli.parameters.run_parameters import RunWords, add_parameter_options, run_parameters
from scene_synth_ros.cli.usage import UsageError
from scene_synth_ros.estimate.estimate import Estimate
from scene_synth_ros.estimate.measuring import measure_rooms
from scene_synth_ros.estimate.totals import sample_indices
from scene_synth_ros.shards.plan import MAX_ROOMS, make_plan

MAX_SAMPLE, MAX_MACHINES, MAX_WORKERS = 10_000, 10**6, 1024


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument("--rooms", type=int, required=True, metavar="N", help="rooms of the dataset")
    parser.add_argument("--frames", type=int, metavar="N", help="frames of each room (default: the profile's)")
    parser.add_argument("--seed", type=int, metavar="S", help="seed of the dataset: the rooms measured are among its own")
    parser.add_argument("--params", type=Path, metavar="FILE", help="run profile, as of scene_synth generate (default: main)")
    add_parameter_options(parser)
    parser.add_argument("--grammar", type=Path, metavar="FILE", help="grammar file of the rooms")
    parser.add_argument("--shard-rooms", type=int, metavar="N", help="rooms of a shard, as of scene_synth generate")
    parser.add_argument("--machines", type=int, default=1, metavar="K", help="say it for so many machines like this one, too")
    parser.add_argument("--workers", type=int, metavar="N", help="processes of each machine (default: as many as find processors)")
    parser.add_argument("--threads", type=int, default=1, metavar="N", help="processors of each process (default: 1)")
    parser.add_argument("--sample", type=int, default=8, metavar="N", help="rooms to measure; more, narrower intervals (default: 8)")
    parser.add_argument(
        "--sample-frames", type=int, default=4, metavar="N", help="frames to render of each, from the middle of its path (default: 4)"
    )
    parser.add_argument("--json", action="store_true", help="print JSON instead of the table")


def run(arguments: argparse.Namespace) -> int:
    """Print the estimate; return 0."""
    processors = len(os.sched_getaffinity(0))
    workers = max(1, processors // max(1, arguments.threads)) if arguments.workers is None else arguments.workers
    limits = (
        ("--threads", arguments.threads, 1, processors),
        ("--machines", arguments.machines, 1, MAX_MACHINES),
        ("--workers", workers, 1, MAX_WORKERS),
        ("--shard-rooms", 1 if arguments.shard_rooms is None else arguments.shard_rooms, 1, MAX_ROOMS),
        ("--sample", arguments.sample, 1, MAX_SAMPLE),
        ("--sample-frames", arguments.sample_frames, 2, MAX_SAMPLE),
    )
    for option, value, low, high in limits:
        if not low <= value <= high:
            raise UsageError(f"{option}: expected {low} to {high}, got {value}")
    words = RunWords(
        params=arguments.params,
        overlay=tuple(arguments.overlay),
        overrides=tuple(arguments.overrides),
        rooms=arguments.rooms,
        frames=arguments.frames,
        seed=arguments.seed,
        grammar=arguments.grammar,
        record=Path("bag"),
    )
    plan = make_plan(run_parameters(words), rooms_per_shard=arguments.shard_rooms or 0)
    settings = plan.settings_of(0)
    types = len(settings.grammar["scene"].room_type.split(","))
    indices = sample_indices(plan.rooms, arguments.sample, types)
    with tqdm(total=len(indices), desc="measuring", unit="room", disable=None, leave=False) as line:
        measured = measure_rooms(settings, indices, arguments.sample_frames, workers, arguments.threads, lambda _: line.update())
    estimate = Estimate(
        rooms=plan.rooms,
        frames=plan.frames,
        rooms_per_shard=plan.rooms_per_shard,
        workers=workers,
        machines=arguments.machines,
        measured=measured,
    )
    sys.stdout.write(json.dumps(estimate.document(), indent=1) + "\n" if arguments.json else estimate.text())
    return 0
