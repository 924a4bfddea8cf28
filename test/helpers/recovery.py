"""Recovered parameters: rooms sampled from a known grammar teach one that begins with other numbers; what comes back stands beside.

Errors are four standard errors of what is counted or averaged, and for places in a room 1 cm more, since the room cuts them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from grammar import Categories, Grammar, SceneRequest, read_categories, read_room_type, sample_room
from grammar.learning import ContrastiveOptions, LearnOptions, ObservedRoom, learn
from grammar.learning.write_layouts import layout_from_objects
from grammar.spec.object_rules import AroundMode, Mode, ObjectRule, PlaceMode, SizeMode, WallMode
from grammar.spec.rules import Branch, Node
from grammar.spec.values import TruncatedNormal
from scene_description.share import config_path

SIDES = {"bed": (2.1, 1.5, 0.9), "nightstand": (0.4, 0.5, 0.5), "dresser": (0.5, 1.0, 0.8), "mug": (0.11, 0.08, 0.09)}
SPREAD = {"bed": 0.05, "nightstand": 0.02, "dresser": 0.03, "mug": 0.005}


Numbers = dict[str, tuple[float, ...]]
"""The numbers that are to come back, by name."""

TRUTH: Numbers = dict(
    units=(0.2, 0.3, 0.5), dresser=(0.3, 0.7), on=(0.3, 0.7), bed_gap=(0.1,), dresser_gaps=(0.02, 0.12), dresser_odds=(0.7, 0.3),
    side_gap=(0.15,), top=(0.6, 0.5), door=(0.8,),
)  # fmt: skip
BEGIN: Numbers = dict(
    units=(0.6, 0.3, 0.1), dresser=(0.7, 0.3), on=(0.8, 0.2), bed_gap=(0.02,), dresser_gaps=(0.2,), dresser_odds=(1.0,),
    side_gap=(0.5,), top=(-0.5, -0.5), door=(0.9,),
)  # fmt: skip


def recover(rooms: int) -> list[tuple[str, float, float, float]]:
    """Sample so many rooms and learn from them; return name, truth, what came back, and the error that it may have."""
    categories = read_categories(config_path("categories.yaml"))
    observed = sampled(known_grammar(categories, TRUTH), categories, rooms)
    options = LearnOptions(contrastive=ContrastiveOptions(iterations=0))
    learned = learn(known_grammar(categories, BEGIN), categories, observed, options, np.random.default_rng(0)).grammar
    return recovered(learned, observed)


def known_grammar(categories: Categories, numbers: Mapping[str, tuple[float, ...]]) -> Grammar:
    """Return a grammar of four objects with these numbers."""
    base = read_room_type("bedroom", categories)
    nodes = {
        "room": Node(kind="and", branches=(Branch(symbol="bed"), Branch(symbol="beside"), Branch(symbol="storage"))),
        "beside": Node(kind="set", branches=(Branch(symbol="unit", multiplicity=numbers["units"]),)),
        "unit": Node(kind="and", branches=(Branch(symbol="nightstand"), Branch(symbol="mug"))),
        "storage": Node(kind="set", branches=(Branch(symbol="dresser", multiplicity=numbers["dresser"]),)),
    }
    odds = numbers["dresser_odds"]
    gaps = tuple(WallMode(distance_m=gap, probability=p) for gap, p in zip(numbers["dresser_gaps"], odds, strict=True))
    (gap,), (depth, width), on = numbers["side_gap"], numbers["top"], numbers["on"]
    objects = {
        "bed": _object("bed", wall=(WallMode(distance_m=numbers["bed_gap"][0]),)),
        "nightstand": _object(
            "nightstand",
            cores={"bed": 1.0},
            around=(AroundMode(side="left", gap_m=gap, align=-1.0), AroundMode(side="right", gap_m=gap, align=-1.0)),
        ),
        "dresser": _object("dresser", wall=gaps),
        "mug": _object(
            "mug",
            mount="object",
            supporters={"nightstand": on[0], "dresser": on[1]},
            placements=(PlaceMode(depth_fraction=depth, width_fraction=width, orientation_rad=None),),
        ),
    }
    (wide,) = numbers["door"]
    door = replace(base.openings["door"], width_m=TruncatedNormal(mean=wide, sd=0.02, low=0.7, high=1.0))
    side = TruncatedNormal(mean=4.2, sd=0.2, low=3.8, high=4.8)
    stages = dict.fromkeys(("walls", "cores", "associates", "unpaired", "supported", "again"), 150)
    return replace(
        base,
        root="room",
        room=replace(base.room, width_m=side, depth_m=side),
        openings={**base.openings, "door": door},
        nodes=nodes,
        objects=objects,
        schedule=replace(base.schedule, together=250, **stages),
    )


def _object(category: str, **more: object) -> ObjectRule:
    mean, sd = SIDES[category], SPREAD[category]
    low, high = (tuple(side + sign * 3.0 * sd for side in mean) for sign in (-1.0, 1.0))
    size = SizeMode(mean_m=mean, sd_m=(sd, sd, sd))
    return ObjectRule(category=category, sizes=(size,), low_m=_three(low), high_m=_three(high), **more)  # type: ignore[arg-type]


def _three(values: Sequence[float]) -> tuple[float, float, float]:
    return values[0], values[1], values[2]


def sampled(grammar: Grammar, categories: Categories, count: int) -> list[ObservedRoom]:
    """Return that many rooms as layouts."""
    rooms = []
    for index in range(count):
        room = sample_room(grammar, categories, SceneRequest(), np.random.default_rng([11, index]))
        rooms.append(layout_from_objects(f"room{index}", "bedroom", room.room, room.objects))
    return rooms


def recovered(grammar: Grammar, rooms: Sequence[ObservedRoom]) -> list[tuple[str, float, float, float]]:
    """Return name, true value, learned value and stated error of every number."""
    beside, storage = grammar.nodes["beside"].branches[0].multiplicity or (), grammar.nodes["storage"].branches[0].multiplicity or ()
    dressers = sum(any(thing.category == "dresser" for thing in room.objects) for room in rooms)
    rows = [
        *(_share(f"P({k} nightstands)", TRUTH["units"][k], beside[k], len(rooms)) for k in range(3)),
        _share("P(dresser)", TRUTH["dresser"][1], storage[1], len(rooms)),
    ]
    bed, dresser = grammar.objects["bed"].wall, grammar.objects["dresser"].wall
    rows.append(("gap of the bed, m", TRUTH["bed_gap"][0], _main(bed).distance_m, 0.01))
    for truth, odds in zip(TRUTH["dresser_gaps"], TRUTH["dresser_odds"], strict=True):
        near = [mode for mode in dresser if abs(mode.distance_m - truth) < 0.05]
        rows.append((f"gap of the dresser near {truth:g}, m", truth, _main(near).distance_m if near else math.nan, 0.015))
        rows.append(_share(f"P(dresser near {truth:g})", odds, sum(mode.probability or 0.0 for mode in near), dressers, 0.03))
    for side in ("left", "right"):
        mode = _main([mode for mode in grammar.objects["nightstand"].around if mode.side == side])
        rows.append((f"gap of the nightstand at the {side}, m", TRUTH["side_gap"][0], mode.gap_m, 0.015))
        rows.append((f"align of the nightstand at the {side}", -1.0, mode.align, 0.0))
    # Where one place was taken for several close ones, their common middle is what must come back.
    for name, truth in zip(("depth", "width"), TRUTH["top"], strict=True):
        rows.append((f"place of the mug along the {name}", truth, _middle(grammar.objects["mug"].placements, f"{name}_fraction"), 0.08))
    rows.append(("width of the door, m", TRUTH["door"][0], grammar.openings["door"].width_m.mean, 0.01))
    sizes = grammar.objects["dresser"].sizes
    for axis, name in enumerate(("depth", "width", "height")):
        mean = sum(mode.probability * mode.mean_m[axis] for mode in sizes)
        rows.append((f"mean {name} of the dresser, m", SIDES["dresser"][axis], mean, 4.0 * SPREAD["dresser"] / math.sqrt(dressers)))
    return rows


def _middle(places: Sequence[PlaceMode], field: str) -> float:
    """Return the mean of a coordinate over places by their odds, NaN if one is free."""
    odds = [1.0 if place.probability is None else place.probability for place in places]
    values = [getattr(place, field) for place in places]
    return math.nan if None in values else sum(p * value for p, value in zip(odds, values, strict=True)) / sum(odds)


def _share(name: str, truth: float, value: float, count: int, more: float = 0.01) -> tuple[str, float, float, float]:
    return name, truth, value, 4.0 * math.sqrt(truth * (1.0 - truth) / count) + more


AnyMode = TypeVar("AnyMode", bound=Mode)


def _main(modes: Sequence[AnyMode]) -> AnyMode:
    return max(modes, key=lambda mode: mode.probability or 0.0)
