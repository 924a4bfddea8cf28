"""Layouts: seconds to a furnished, valid bedroom on one core, kernels warm; proposals by number of objects; layouts that pass at once."""

from __future__ import annotations

import time

import numpy as np

from benchmarks.table import Row, at_least, at_most
from grammar import Grammar, SceneRequest, read_categories, read_room_type, sample_room
from grammar.assemble import assemble
from grammar.categories import Categories
from grammar.circulation import empty_floor
from grammar.derive import derive
from grammar.layout import FIXED, copy_state
from grammar.mcmc import NO_FLOOR, Goal, run_chain
from grammar.moves import move_settings
from grammar.schedule import run_stages
from grammar.synthesize import CameraTimes, SceneSynthesizer
from grammar.validity import door_start_m
from scene_description.share import config_path

ROOMS = 60
PROPOSALS = 40_000
OBJECTS = (10, 20, 30)


def measure() -> list[Row]:
    """Synthesise rooms, everything included, and return the distribution of their times, then those of the chain alone."""
    synthesizer = SceneSynthesizer.from_config()
    times = CameraTimes(frames=8, start_ns=10**9, rate_hz=10.0)
    synthesizer.synthesize(SceneRequest(), 0, 0, times)
    seconds, objects = [], []
    for index in range(ROOMS):
        began = time.perf_counter()
        scene = synthesizer.synthesize(SceneRequest(), 1, index, times)
        seconds.append(time.perf_counter() - began)
        objects.append(len(scene.objects))
    categories = read_categories(config_path("categories.yaml"))
    grammar = read_room_type("bedroom", categories)
    return [
        at_most(f"bedroom with materials, lights and path, p50 of {ROOMS}", float(np.median(seconds)), "s", 0.5),
        at_most(f"bedroom with materials, lights and path, p99 of {ROOMS}", float(np.quantile(seconds, 0.99)), "s", 2.0),
        Row("objects in a bedroom, median", float(np.median(objects)), ""),
        *_furnished(grammar, categories),
        *_chain_rows(grammar, categories),
    ]


def _furnished(grammar: Grammar, categories: Categories) -> list[Row]:
    seconds, at_once = [], 0
    for seed in range(ROOMS):
        began = time.perf_counter()
        room = sample_room(grammar, categories, SceneRequest(min_objects=20, max_objects=30), np.random.default_rng(seed))
        seconds.append(time.perf_counter() - began)
        at_once += room.validity.attempts == 1
    return [
        at_most("layout of a bedroom with 20 to 30 objects, p50", float(np.median(seconds)), "s", 0.3),
        at_most("layout of a bedroom with 20 to 30 objects, p99", float(np.quantile(seconds, 0.99)), "s", 1.0),
        Row("layouts that pass all checks at the first try", 100.0 * at_once / ROOMS, "%"),
    ]


def _chain_rows(grammar: Grammar, categories: Categories) -> list[Row]:
    """Return proposals per second of the chain in which all objects move, without and with circulation."""
    rows, settings = [], move_settings(grammar.moves)
    for objects in OBJECTS:
        rng = np.random.default_rng(1)
        tree = derive(grammar, categories, SceneRequest(min_objects=objects, max_objects=objects), rng)
        problem, start = assemble(grammar, categories, tree)
        state = run_stages(rng, problem, start, settings, grammar.schedule, grammar.schedule.beta).state
        floor = empty_floor(tree.room.polygon_m, door_start_m(tree.room, grammar.validity.robot_radius_m), grammar.validity)
        movable, goal = np.flatnonzero(problem.mount != FIXED), Goal(1.0, 1.0, grammar.schedule.hard_tolerance, False)
        for name, raster in (("", NO_FLOOR), (" with circulation", floor)):
            began = time.process_time()
            counts = np.zeros((6, 2), np.int64)
            run_chain(rng, problem, state, settings, goal, movable, PROPOSALS, copy_state(state), counts, raster)
            rate = PROPOSALS / (time.process_time() - began)
            label = f"proposals per second, {objects} objects{name}"
            rows.append(at_least(label, rate, "1/s", 300_000) if not name else Row(label, rate, "1/s"))
    return rows
