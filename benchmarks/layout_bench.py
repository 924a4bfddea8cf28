"""Layouts: seconds to a furnished, valid room of every type on one core, kernels warm; the chain's proposals by number of objects."""

import time
from pathlib import Path

import numpy as np
from independent_check import faults

from benchmarks.table import Row, at_least, at_most
from grammar import Grammar, SceneRequest
from grammar.derivation.derive import derive
from grammar.drawing.shapes import Drawing, Shape, dot, line, to_svg, words
from grammar.layout.assemble import assemble
from grammar.layout.columns import FIXED
from grammar.layout.floor_raster import NO_FLOOR
from grammar.layout.mcmc import Chain, ChainRun, run_chain
from grammar.layout.problem import move_settings
from grammar.layout.schedule import begin, run_stages
from grammar.sampled_room import room_floor
from grammar.spec.categories import Categories
from grammar.spec.request import RequestError
from grammar.synthesize import CameraTimes, SceneSynthesizer
from scene_description import to_mapping

ROOMS = 60
PROPOSALS = 60_000
STRUCTURES = 3
OBJECTS = (10, 15, 20, 25, 30)
ASKED = (10, 20, 30)
COST_PLOT = Path(__file__).resolve().parent.parent / "docs" / "layout_cost.svg"

TIMES = CameraTimes(frames=8, start_ns=10**9, rate_hz=10.0)


def measure() -> list[Row]:
    """Synthesise rooms of every type, everything included, then run chains alone; processor times, so that other programs do not count."""
    synthesizer = SceneSynthesizer.from_config()
    synthesizer.synthesize(SceneRequest(), 0, 0, TIMES)
    furnished = SceneRequest(min_objects=20, max_objects=30)
    rows = _rooms(synthesizer, furnished, "bedroom with 20 to 30 objects", 0.5, 2.0)
    for room_type in synthesizer.grammars:
        rows.extend(_rooms(synthesizer, SceneRequest(room_type=room_type), room_type, 1.0, None))
    return [*rows, *_chain_rows(synthesizer.grammars["bedroom"], synthesizer.categories)]


def _rooms(synthesizer: SceneSynthesizer, request: SceneRequest, name: str, middle_s: float, slow_s: float | None) -> list[Row]:
    """Return the times of rooms, how many passed at the first layout, and the faults that an independent check finds."""
    seconds, objects, at_once, wrong, failures = [], [], 0, 0, 0
    for index in range(ROOMS):
        began = time.process_time()
        try:
            scene = synthesizer.synthesize(request, 1, index, TIMES)
        except RequestError:
            failures += 1
            continue
        seconds.append(time.process_time() - began)
        objects.append(len(scene.objects))
        at_once += scene.validity.attempts == 1
        wrong += bool(faults(to_mapping(scene), synthesizer.grammar_of(request), synthesizer.categories))
    slow = float(np.quantile(seconds, 0.99))
    return [
        at_most(f"{name}, time p50 of {ROOMS}", float(np.median(seconds)), "s", middle_s),
        at_most(f"{name}, time p99", slow, "s", slow_s) if slow_s else Row(f"{name}, time p99", slow, "s"),
        Row(f"{name}, objects, median", float(np.median(objects)), ""),
        Row(f"{name}, first layout passes", 100.0 * at_once / ROOMS, "%"),
        at_most(f"{name}, failures to sample", failures, "", 0),
        at_most(f"{name}, rooms with a fault by the independent check", wrong, "", 0),
    ]


def _chain_rows(grammar: Grammar, categories: Categories) -> list[Row]:
    """Return proposals per second of the chain in which all objects move, without and with circulation, and draw their cost."""
    rates = {(objects, walks): _rate(grammar, categories, objects, walks) for objects in OBJECTS for walks in (False, True)}
    COST_PLOT.write_text(to_svg(_cost_plot(rates)), encoding="utf-8")
    rows = []
    for objects in ASKED:
        rows.append(Row(f"proposals per second, {objects} objects, without circulation", rates[objects, False], "1/s"))
        rows.append(at_least(f"proposals per second, {objects} objects, with circulation", rates[objects, True], "1/s", 300_000))
    few, many = OBJECTS[0], OBJECTS[-1]
    growth = np.log(rates[few, True] / rates[many, True]) / np.log(many / few)
    # a sweep has one proposal an object: its cost grows by one more power of the number than that of a proposal
    return [*rows, at_most(f"power by which the cost of a sweep grows from {few} to {many} objects", 1.0 + float(growth), "", 1.3)]


def _rate(grammar: Grammar, categories: Categories, objects: int, walks: bool) -> float:
    settings, seconds, tolerance = move_settings(grammar.moves), 0.0, grammar.schedule.hard_tolerance
    for seed in range(STRUCTURES):
        rng = np.random.default_rng(seed)
        tree = derive(grammar, categories, SceneRequest(min_objects=objects, max_objects=objects), rng)
        problem, start = assemble(grammar, categories, tree)
        begun = begin(rng, [(problem, start)], settings, grammar.schedule, grammar.schedule.beta)
        state = run_stages(rng, Chain(problem, settings), begun, grammar.schedule, grammar.schedule.beta).state
        chain = Chain(problem, settings, room_floor(grammar, tree.room) if walks else NO_FLOOR)
        movable = np.flatnonzero(problem.mount != FIXED)
        run_chain(rng, chain, state, ChainRun(1, 1.0, tolerance), movable)
        began = time.process_time()
        run_chain(rng, chain, state, ChainRun(PROPOSALS, 1.0, tolerance), movable)
        seconds += time.process_time() - began
    return STRUCTURES * PROPOSALS / seconds


def _cost_plot(rates: dict[tuple[int, bool], float]) -> Drawing:
    """Return a drawing of microseconds a proposal over the number of objects."""
    left, top, width, height = 60.0, 50.0, 520.0, 260.0
    cost = {key: 1e6 / rate for key, rate in rates.items()}
    highest, most = 1.15 * max(cost.values()), max(OBJECTS)
    shapes: list[Shape] = [words((left, 24.0), "microseconds a proposal, by number of objects in a bedroom", 15.0, anchor="start")]
    shapes.append(line([(left, top), (left, top + height), (left + width, top + height)], "#888888"))
    for value in np.arange(0.0, highest, 1.0):
        y = top + height * (1.0 - value / highest)
        shapes += [line([(left, y), (left + width, y)], "#e4e4e4", 0.8), words((left - 8.0, y), f"{value:g}", 11.0, anchor="end")]
    for walks, color, name in ((False, "#1f6fb4", "without circulation"), (True, "#c0392b", "with circulation")):
        points = [(left + width * n / most, top + height * (1.0 - cost[n, walks] / highest)) for n in OBJECTS]
        shapes += [line(points, color, 2.0), *(dot(point, 3.0, color) for point in points)]
        shapes.append(words((points[-1][0] + 10.0, points[-1][1]), name, 12.0, fill=color, anchor="start"))
    shapes += [words((left + width * n / most, top + height + 16.0), str(n), 11.0) for n in OBJECTS]
    return Drawing(width=left + width + 150.0, height=top + height + 40.0, shapes=tuple(shapes))
