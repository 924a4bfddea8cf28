"""What each layer of the hit record costs at 640x480 on one thread, by processor time, beside the basic layers that are always traced."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from benchmarks.bench_room import VIEW, furnished_room
from benchmarks.table import Row, at_most
from renderer import GEOMETRIC_LAYERS, CameraConfig, RenderConfig, Renderer
from renderer.film.layers import HIT_LAYERS
from scene_description import CameraPose

CAMERA = CameraConfig(width=640, height=480)
ROUNDS = 7
SHIFT_M = 0.02


def measure() -> list[Row]:
    """Return milliseconds of the basic layers, of each further one on top of them, and the ratio of all to the basic ones."""
    path = tuple(_moved(number) for number in range(3))
    with Renderer(furnished_room(1), CAMERA, RenderConfig(threads=1), 0) as renderer:

        def cost(*names: str) -> Callable[[], object]:
            return lambda: renderer.render(path[1], 0, (*GEOMETRIC_LAYERS, *names), path=path)

        cost(*HIT_LAYERS)()
        basic = cost()
        rows = []
        for name in HIT_LAYERS:
            pairs = np.array([(_seconds(basic), _seconds(cost(name))) for _ in range(ROUNDS)])
            rows.append(Row(f"{name}, beside the basic layers", 1e3 * float(np.median(pairs[:, 1] - pairs[:, 0])), "ms"))
        pairs = np.array([(_seconds(basic), _seconds(cost(*HIT_LAYERS))) for _ in range(ROUNDS)])
    basic_s, all_s = np.median(pairs, axis=0)
    head = [Row("depth, range, normals, semantic, instance", 1e3 * float(basic_s), "ms")]
    total = [
        Row("all layers of the hit record together", 1e3 * float(all_s), "ms"),
        at_most("all layers over the basic ones", float(np.median(pairs[:, 1] / pairs[:, 0])), "", 2.0),
    ]
    return head + rows + total


def _moved(number: int) -> CameraPose:
    x, y, z = VIEW.position_m
    return replace(VIEW, stamp_ns=number, position_m=(x + SHIFT_M * number, y, z))


def _seconds(frame: Callable[[], object]) -> float:
    began = time.process_time()
    frame()
    return time.process_time() - began
