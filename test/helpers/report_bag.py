"""A tiny sweep of two rooms with a bag, estimates that are known to the pixel, and the file of its evaluation, for tests of reports."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import evaluation_files
import numpy as np
from room_bag import RoomBag, write, write_room_bag

from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.messages.conversions import image_to_msg

VALUES: Mapping[str, list[Any]] = {"light": [0.5, 1.0, 2.0], "finish": ["paint", "brick"]}
BASE = {"light": 1.0, "finish": "paint"}
ERROR_M = 0.1
"""Depth estimates are so much too far."""
COMMAND = "scene_synth evaluate . --algorithm sgbm.py:Stereo --estimates-out estimates --out evaluation.json"


def write_estimates(folder: Path, bag: RoomBag) -> None:
    """Write a bag with an estimate of each frame's depth."""
    with BagWriter(folder) as writer:
        for stamp, images in bag.images.items():
            guess = (images["depth"] + np.float32(ERROR_M)).astype(np.float32)
            write(writer, "/estimates/depth/image_raw", image_to_msg(guess, "32FC1", stamp, "eye"), stamp)


def abs_rel(room: int, factors: Mapping[str, Any]) -> float:
    """Return the made-up error of a variant: rooms differ by 1, light adds 0.2 at 0.5 and 0.1 at 2, brick takes away 0.05."""
    return 1.0 + room + {0.5: 0.2, 1.0: 0.0, 2.0: 0.1}[factors["light"]] - (0.05 if factors["finish"] == "brick" else 0.0)


def write_sweep(folder: Path, *, shift: float = 0.0, title: str = "SGBM") -> Path:
    """Write bag, estimates, sweep.json and an evaluation whose first metric is :func:`abs_rel` plus ``shift``; return its path."""
    if not (folder / "bag").exists():
        bag = write_room_bag(folder / "bag")
        write_estimates(folder / "estimates", bag)
    combos = evaluation_files.combinations(VALUES, BASE)
    stamps = [1_000_000_000 + 200_000_000 * k for k in range(6)]
    frames, variants = [], []
    for number, factors in enumerate(combos):
        name = f"{number:04d}"
        changed = [key for key, value in factors.items() if value != BASE[key]]
        variants.append(
            {"id": name, "bag": "bag", "factors": factors, "changed": changed, "command": f"scene_synth sweep s.yaml --only {name}"}
        )
        for room, k in itertools.product(range(2), range(3)):
            value = abs_rel(room, factors) + shift + 0.001 * k
            place = {"bag": "bag", "room_type": ("office", "study")[room], "frame": k, "stamp_ns": stamps[3 * room + k]}
            frames.append(evaluation_files.frame(name, room, factors, {"abs_rel": value, "delta_1": 1.0 - 0.1 * value}, **place))
    score = {"abs_rel": {"value": 1.5 + shift, "low": 1.0, "high": 2.0}, "delta_1": {"value": 0.9, "low": None, "high": None}}
    keys = [
        ("all", "all"),
        ("room_type", "office"),
        ("class", "wall"),
        ("class", "sofa"),
        ("distance", "0 to 1 m"),
        ("distance", "1 to 2 m"),
    ]
    summary = [
        {
            "task": "depth",
            "by": by,
            "key": key,
            "rooms": 2,
            "frames": 24,
            "metrics": score | {"abs_rel": {"value": 1.0 + k, "low": 0.5, "high": 9}},
        }
        for k, (by, key) in enumerate(keys)
    ]
    factors = [
        {"name": name, "label": name, "unit": "lx" if name == "light" else None, "values": own, "base": BASE[name]}
        for name, own in VALUES.items()
    ]
    sweep = {"schema": "scene_synth_sweep/1", "spec": {"design": "one_at_a_time"}, "factors": factors, "variants": variants}
    evaluation_files.write(folder / "sweep.json", sweep)
    content = evaluation_files.document(frames, summary, title=title, created_with=COMMAND)
    return evaluation_files.write(folder / f"{title}.json", content)
