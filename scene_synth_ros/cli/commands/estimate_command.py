"""``scene_synth estimate``: a few rooms of a dataset are made and measured, and what all of it will cost is said."""

import argparse
import json
import os
import sys
from pathlib import Path

from tqdm import tqdm

from scene_synth_ros.cli.options import add_number, add_workers
from scene_synth_ros.cli.parameters.run_parameters import add_run_options, run_parameters, run_words
from scene_synth_ros.estimate.estimate import Estimate, sample_indices
from scene_synth_ros.estimate.room_costs import measure_rooms
from scene_synth_ros.shards.plan import MAX_ROOMS, make_plan
from scene_synth_ros.workers.pool import terminable
from scene_synth_ros.workers.processors import default_workers

MAX_SAMPLE, MAX_MACHINES = 10_000, 10**6


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    processors = len(os.sched_getaffinity(0))
    add_run_options(parser, "rooms of the dataset; those measured are among them", required=True)
    add_number(parser, "--shard-rooms", 1, MAX_ROOMS, metavar="N", help="rooms of a shard, as of scene_synth generate")
    add_number(parser, "--machines", 1, MAX_MACHINES, default=1, metavar="K", help="say it for so many machines like this one, too")
    add_workers(parser, help="processes of each machine (default: as many as find processors)")
    add_number(parser, "--threads", 1, processors, default=1, metavar="N", help="processors of each process (default: %(default)s)")
    sample, frames = "rooms to measure; more, narrower intervals", "frames to render of each, from the middle of its path"
    add_number(parser, "--sample", 1, MAX_SAMPLE, default=8, metavar="N", help=f"{sample} (default: %(default)s)")
    add_number(parser, "--sample-frames", 2, MAX_SAMPLE, default=4, metavar="N", help=f"{frames} (default: %(default)s)")
    parser.add_argument("--json", action="store_true", help="print JSON instead of the table")


def run(arguments: argparse.Namespace) -> int:
    """Print the estimate; return 0."""
    workers = arguments.workers or default_workers(arguments.threads)
    plan = make_plan(run_parameters(run_words(arguments, Path("bag"))), rooms_per_shard=arguments.shard_rooms or 0)
    settings = plan.settings_of(0)
    types = len(settings.grammar["scene"].room_type.split(","))
    indices = sample_indices(plan.rooms, arguments.sample, types)
    with tqdm(total=len(indices), desc="measuring", unit="room", disable=None, leave=False) as line, terminable():
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
