"""Layouts: seconds to a furnished, valid bedroom on one core, kernels warm."""

from __future__ import annotations

import time

import numpy as np

from benchmarks.table import Row, at_most
from grammar import SceneRequest
from grammar.synthesize import CameraTimes, SceneSynthesizer

ROOMS = 60


def measure() -> list[Row]:
    """Synthesise rooms, everything included, and return the distribution of their times."""
    synthesizer = SceneSynthesizer.from_config()
    times = CameraTimes(frames=8, start_ns=10**9, rate_hz=10.0)
    synthesizer.synthesize(SceneRequest(), 0, 0, times)
    seconds, objects = [], []
    for index in range(ROOMS):
        began = time.perf_counter()
        scene = synthesizer.synthesize(SceneRequest(), 1, index, times)
        seconds.append(time.perf_counter() - began)
        objects.append(len(scene.objects))
    return [
        at_most(f"bedroom with materials, lights and path, p50 of {ROOMS}", float(np.median(seconds)), "s", 0.5),
        at_most(f"bedroom with materials, lights and path, p99 of {ROOMS}", float(np.quantile(seconds, 0.99)), "s", 2.0),
        Row("objects in a bedroom, median", float(np.median(objects)), ""),
    ]
