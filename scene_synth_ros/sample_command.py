"""``scene_synth sample``: rooms as JSON and labelled top views, without ROS."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from grammar import SceneRequest
from grammar.synthesize import CameraTimes, SceneSynthesizer
from grammar.top_view import top_view_svg
from scene_description import from_mapping, scene_to_json


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument("--room", default="bedroom", metavar="TYPE", help="room type (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the run (default: %(default)s)")
    parser.add_argument("--count", type=int, default=1, help="number of rooms (default: %(default)s)")
    parser.add_argument("--frames", type=int, default=30, help="poses of each camera path (default: %(default)s)")
    parser.add_argument("--max-objects", type=int, default=SceneRequest().max_objects, help="(default: %(default)s)")
    parser.add_argument("--report", action="store_true", help="print every validity check of every room")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="new folder for the files")


def run(arguments: argparse.Namespace) -> int:
    """Sample; room i becomes ``room_<i>.json`` and ``room_<i>.svg``."""
    request = from_mapping(SceneRequest, {"room_type": arguments.room, "max_objects": arguments.max_objects}, "options")
    synthesizer = SceneSynthesizer.from_config()
    synthesizer.check(request)
    arguments.out.mkdir(parents=True)
    for index in range(arguments.count):
        times = CameraTimes(frames=arguments.frames, start_ns=1_000_000_000, rate_hz=10.0, first_index=index * arguments.frames)
        scene = synthesizer.synthesize(request, arguments.seed, index, times)
        base = arguments.out / f"room_{index:04d}"
        base.with_suffix(".json").write_text(scene_to_json(scene), encoding="utf-8")
        base.with_suffix(".svg").write_text(top_view_svg(scene), encoding="utf-8")
        sys.stdout.write(f"{base.name}: {scene.category}, {len(scene.objects)} objects, {scene.validity.attempts} layouts tried\n")
        if arguments.report:
            for check in scene.validity.checks:
                sys.stdout.write(f"  {check.name:24s} {check.value:10.4f}  limit {check.limit:<8g} {'ok' if check.passed else 'FAILED'}\n")
    return 0
