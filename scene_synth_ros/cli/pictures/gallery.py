"""Studio scenes: one model on a plain stage under a softbox, framed like a catalogue picture."""

import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grammar.appearance.appearance import sample_appearance
from grammar.appearance.appearance_rules import Appearance
from grammar.small_things.rules import SmallThings
from grammar.spec.rules import Grammar
from grammar.synthesize import SceneSynthesizer
from scene_description import (
    SCHEMA,
    CameraPose,
    Environment,
    Light,
    Material,
    ModelReference,
    ParseGraph,
    Part,
    Room,
    SceneDescription,
    SceneObject,
    Support,
    ValidityReport,
)
from scene_description.labels import LABEL_ID
from scene_description.poses import look_at

HORIZONTAL_FOV_RAD = 0.5
"""Of the camera that the poses are made for: a short telephoto lens, as for pictures of products."""

MODEL_ID, LAMP_ID = 1, 2
_PAPER = Material(id="paper", family="paper", base_color=(0.72, 0.72, 0.71), roughness=0.95)
_STAGE_RADII, _STAGE_HEIGHT_RADII, _SMALLEST_STAGE_M = 12.4, 5.6, 3.0
"""The stage grows with the model (in radii of its box), so that all are lit alike."""
_ELEVATION_RAD, _AZIMUTH_RAD = 0.32, 0.55
_MARGIN = 0.9
_DARK = (0.0, 0.0, 0.0)
_LUMEN_PER_M2, EXPOSURE_EV100 = 42_000.0, 7.25
"""Flux of the lamp per square of the model's radius, and the exposure at which paper under it comes out as light grey."""


class Example(NamedTuple):
    """A category as the gallery shows it: how it is mounted and a typical size (depth, width, height) in metres."""

    mount: str
    size_m: tuple[float, float, float]


def typical_examples(grammars: Mapping[str, Grammar], small_things: SmallThings) -> dict[str, Example]:
    """Return category -> mount and mean size: of its first size mode in the first room type that has it, else as a small thing; by name."""
    found: dict[str, Example] = {}
    for grammar in grammars.values():
        for rule in grammar.objects.values():
            found.setdefault(rule.category, Example(rule.mount, rule.sizes[0].mean_m))
    for name, thing in small_things.things.items():
        found.setdefault(name, Example("object", thing.size_m))
    return dict(sorted(found.items()))


def studio_scene(synthesizer: SceneSynthesizer, category: str, example: Example, style: str, seed: int) -> SceneDescription:
    """Return a scene with one dressed model of a style on a stage; its camera path is one pose that frames it."""
    label = synthesizer.categories[category].label_id
    support = Support(kind="wall", wall=2) if example.mount == "wall" else Support(kind="floor")
    stage = _stage(example.size_m)
    position = _place(example, stage)
    plain = SceneObject(
        id=MODEL_ID,
        category=category,
        label=label,
        size_m=example.size_m,
        position_m=position,
        yaw_rad=0.0,
        support=support,
        model=ModelReference(generator=category),
        parts=(),
    )
    rng = np.random.default_rng(np.random.SeedSequence([seed, *category.encode(), *style.encode()]))
    _, (thing,), materials = sample_appearance(rng, _only(synthesizer.appearance, category, style), stage, [plain])
    return _scene(f"{category}-{style}", thing, materials, stage)


def _only(appearance: Appearance, category: str, style: str) -> Appearance:
    """Return the appearance with one style for one category."""
    look = appearance.categories[category]
    look = replace(look, styles={style: replace(look.styles[style], odds=1.0)}, suite=None)
    return replace(appearance, categories={**appearance.categories, category: look})


def _radius_m(size_m: tuple[float, float, float]) -> float:
    return 0.5 * math.hypot(*size_m)


def _place(example: Example, stage: Room) -> tuple[float, float, float]:
    depth, _, height = example.size_m
    if example.mount == "wall":
        return (stage.polygon_m[0][0] + 0.5 * depth, 0.0, 0.5 * (stage.height_m - height))
    if example.mount == "ceiling":
        return (0.0, 0.0, stage.height_m - height)
    return (0.0, 0.0, 0.0)


def _stage(size_m: tuple[float, float, float]) -> Room:
    """Return an empty square room about the origin for a model of this size; all its surfaces are paper."""
    radius = _radius_m(size_m)
    half = 0.5 * max(_STAGE_RADII * radius, _SMALLEST_STAGE_M)
    return Room(
        polygon_m=((-half, -half), (half, -half), (half, half), (-half, half)),
        height_m=max(_STAGE_HEIGHT_RADII * radius, 0.5 * _SMALLEST_STAGE_M),
        wall_thickness_m=0.1,
        openings=(),
        surfaces=tuple(Part(name=part, material=_PAPER.id) for part in ("floor", "wall", "ceiling", "skirting")),
    )


def _scene(name: str, thing: SceneObject, materials: tuple[Material, ...], stage: Room) -> SceneDescription:
    """Light a model by a dome in front of it, above (for what hangs from the ceiling, below), and aim a camera at it."""
    depth, width, height = thing.size_m
    center = np.asarray(thing.position_m) + np.array([0.0, 0.0, 0.5 * height])
    radius = _radius_m(thing.size_m)
    hangs = thing.position_m[2] > 0.0 and thing.support.kind != "wall"
    elevation = (-1.0 if hangs else 1.0) * (0.12 if thing.support.kind == "wall" else _ELEVATION_RAD)
    way = np.array([math.cos(elevation) * math.cos(_AZIMUTH_RAD), -math.cos(elevation) * math.sin(_AZIMUTH_RAD), math.sin(elevation)])
    half = stage.polygon_m[2][0]
    eye = center + way * _distance(np.array([depth, width, height]), way)
    eye = np.clip(eye, (0.01 - half, 0.01 - half, 0.005), (half - 0.01, half - 0.01, stage.height_m - 0.005))
    dome = 2.4 * radius
    light = center + radius * np.array([1.8, 1.2, -2.6 if hangs else 2.2])
    lamp = SceneObject(
        id=LAMP_ID,
        category="ceiling_lamp",
        label=LABEL_ID["lamp"],
        size_m=(dome, dome, 0.3 * dome),
        position_m=(float(light[0]), float(light[1]), float(min(max(light[2], 0.0), stage.height_m - 0.35 * dome))),
        yaw_rad=0.0,
        support=Support(kind="ceiling"),
        model=ModelReference(generator="ceiling_lamp", style="flush"),
        parts=tuple(Part(name=part, material=_PAPER.id) for part in ("mount", "shade", "bulb")),
    )
    position = (float(eye[0]), float(eye[1]), float(eye[2]))
    pose = CameraPose(
        stamp_ns=0, position_m=position, orientation=look_at(position, (float(center[0]), float(center[1]), float(center[2])))
    )
    return SceneDescription(
        schema=SCHEMA,
        id=name,
        index=0,
        seed=0,
        category="studio",
        room=stage,
        objects=(thing, lamp),
        materials=(_PAPER, *materials),
        lights=(
            Light(object=LAMP_ID, part="shade", flux_lm=_LUMEN_PER_M2 * radius * radius, color_temperature_k=5500.0, color=(1.0, 1.0, 1.0)),
        ),
        environment=Environment(zenith=_DARK, horizon=_DARK, ground=_DARK),
        camera_path=(pose,),
        parse_graph=ParseGraph(nodes=(), log_probability=0.0, energies={}, weights={}, energy=0.0),
        validity=ValidityReport(valid=True, attempts=1, checks=()),
    )


def _distance(size_m: NDArray[np.float64], way: NDArray[np.float64]) -> float:
    """Return how far to go back along the unit direction ``way`` until a box of this size fills the picture but for a margin."""
    right = np.cross([0.0, 0.0, 1.0], way)
    right /= np.linalg.norm(right)
    up = np.cross(way, right)
    corners = 0.5 * size_m * np.array(list(product((-1.0, 1.0), repeat=3)))
    widest = np.maximum(np.abs(corners @ right), np.abs(corners @ up)) / (_MARGIN * math.tan(0.5 * HORIZONTAL_FOV_RAD))
    return float((widest + corners @ way).max())
