"""Draws cached views beside path-traced ones, with FLIP of their pixels: docs/cached.jpg.

python -m benchmarks.cached_picture [--types TYPE ...] [--references DIR] [--samples N] [--preset NAME] [--out FILE]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from PIL import Image

from benchmarks.camera_rate_bench import LARGE, VIEW
from benchmarks.sampled_rooms import References, camera_of, flip_map, mean_flip, preset_config, sample_room
from benchmarks.table import DOCS
from grammar import room_types
from grammar.synthesize import SceneSynthesizer
from renderer import Renderer

SHOWN = (400, 300)
QUALITY = 85


def main() -> None:
    """Draw a row for each room: cached, path traced, FLIP from black (0) by violet and orange to pale yellow (1)."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.cached_picture")
    parser.add_argument("--types", nargs="+", choices=room_types(), default=["bedroom", "bathroom", "dining_room"], help="one row each")
    parser.add_argument("--references", type=Path, metavar="DIR", help="path-traced pictures are kept here, rendered if missing")
    parser.add_argument("--samples", type=int, default=1024, help="of the path-traced pictures (default: %(default)s)")
    parser.add_argument("--preset", choices=("realtime", "stream"), default="stream", help="of the cached pictures (default: %(default)s)")
    parser.add_argument("--out", type=Path, default=DOCS / "cached.jpg", help="the picture (default: docs/cached.jpg)")
    arguments = parser.parse_args()
    synthesizer, references, rows = SceneSynthesizer.from_config(), References(arguments.references, arguments.samples), []
    for room_type in arguments.types:
        room = sample_room(synthesizer, room_type, 0)
        truth = references.view(room, VIEW, LARGE).color
        with Renderer(room.flat, camera_of(LARGE), preset_config(arguments.preset), room.key) as renderer:
            picture = np.asarray(renderer.render(room.path[VIEW], VIEW, ("color",), exposure=room.exposure).layers["color"])
        print(f"{room.name}: FLIP {mean_flip(truth, picture):.3f}", flush=True)
        rows.append(
            np.concatenate(
                [np.asarray(Image.fromarray(image).resize(SHOWN)) for image in (picture, truth, flip_map(truth, picture))], axis=1
            )
        )
    Image.fromarray(np.concatenate(rows)).save(arguments.out, quality=QUALITY, optimize=True)
    print(f"{arguments.out}: {arguments.out.stat().st_size // 1000} kB")


if __name__ == "__main__":
    main()
