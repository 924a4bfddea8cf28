"""The validity gate: a change whose room fails a check that it passed before is refused, and it is said which check and where."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import shapely

from grammar.checks.validity import check_room
from grammar.counterfactual.change import Change, InvalidChangeError
from grammar.counterfactual.targets import all_things
from grammar.geometry.boxes import COS_YAW, HALF_DEPTH, HALF_WIDTH, SIN_YAW, Z_HIGH, Z_LOW, X, Y
from grammar.geometry.solids import object_solids
from grammar.small_things.strew import SYMBOL, rules_of
from grammar.spec.categories import Categories, Category
from grammar.spec.rules import Grammar, Thresholds
from grammar.synthesize import SceneSynthesizer
from scene_description import NYU40, SceneDescription, ValidityCheck, ValidityReport
from scene_description.ceilings import ceiling_planes
from scene_description.products import matmul

CAMERA_MARGIN_M = 0.05
"""Distance that the lens keeps from everything solid."""

CAMERA_CLEAR = "camera_clear"
"""Name of the check that the lens is free; it is no part of a validity report."""

AT_LEAST = ("walkable_share", "side_clear")
"""Checks whose limit is a lower one."""

_LIMITS = {
    "collision": "penetration_m",
    "out_of_bounds": "outside_m",
    "floating": "gap_m",
    "walkable_share": "walkable_share",
    "side_clear": "side_share",
}
"""Check -> threshold that its limit is."""


def categories_of(rules: SceneSynthesizer, scene: SceneDescription) -> Categories:
    """Return the table of categories; objects of one that is not in it count with their whole box."""
    return {item.category: Category(label=NYU40[item.label].name) for item in scene.objects} | dict(rules.categories)


def grammar_of(rules: SceneSynthesizer, scene: SceneDescription) -> Grammar:
    """Return the grammar that a scene was sampled from, with the thresholds that its report has.

    It is the learned one of the room type if that has all its terminals, else the one written by hand; a scene of an unknown room type is
    judged by the first grammar there is.
    """
    symbols = {node.symbol for node in scene.parse_graph.nodes if node.kind == "terminal"} - {"room", "door", "window"}
    symbols = {symbol for symbol in symbols if not symbol.startswith(SYMBOL)}
    by_hand = rules.grammars.get(scene.category) or next(iter(rules.grammars.values()))
    learned = rules.learned.get(scene.category)
    grammar = learned if learned is not None and symbols <= set(learned.objects) else by_hand
    limits = {_LIMITS[check.name]: check.limit for check in scene.validity.checks if check.name in _LIMITS}
    thresholds: Thresholds = replace(grammar.validity, **limits)
    return replace(grammar, validity=thresholds)


def report_of(rules: SceneSynthesizer, scene: SceneDescription) -> ValidityReport:
    """Return the exact checks of a room, and that its camera keeps clear."""
    grammar = grammar_of(rules, scene)
    owners = rules_of(grammar, scene.parse_graph, scene.objects)
    return check_room(grammar, categories_of(rules, scene), scene.room, scene.objects, owners, scene.validity.attempts)


def camera_check(rules: SceneSynthesizer, scene: SceneDescription) -> ValidityCheck:
    """Return the check ``camera_clear``: for how many poses the lens is outside the room or in something, and in what (0: the room)."""
    at = np.array([pose.position_m for pose in scene.camera_path])
    boxes, owner = object_solids(categories_of(rules, scene), scene.objects)
    dx, dy, z = at[:, 0, None] - boxes[:, X], at[:, 1, None] - boxes[:, Y], at[:, 2, None]
    deep = np.abs(dx * boxes[:, COS_YAW] + dy * boxes[:, SIN_YAW]) < boxes[:, HALF_DEPTH] + CAMERA_MARGIN_M
    wide = np.abs(dy * boxes[:, COS_YAW] - dx * boxes[:, SIN_YAW]) < boxes[:, HALF_WIDTH] + CAMERA_MARGIN_M
    high = (z > boxes[:, Z_LOW] - CAMERA_MARGIN_M) & (z < boxes[:, Z_HIGH] + CAMERA_MARGIN_M)
    inside = deep & wide & high
    floor = shapely.Polygon(scene.room.polygon_m).buffer(-CAMERA_MARGIN_M)
    out = ~shapely.contains_xy(floor, at[:, 0], at[:, 1])
    planes = np.vstack([(0.0, 0.0, scene.room.height_m), ceiling_planes(scene.room)])
    ceiling = (matmul(at[:, :2], planes[:, :2].T) + planes[:, 2]).min(axis=1)
    out |= (at[:, 2] < CAMERA_MARGIN_M) | (at[:, 2] > ceiling - CAMERA_MARGIN_M)
    faults = int((inside.any(axis=1) | out).sum())
    objects = tuple(sorted({int(key) for key in owner[inside.any(axis=0)]}))
    return ValidityCheck(name=CAMERA_CLEAR, value=float(faults), limit=0.0, passed=not faults, objects=objects)


def checked(rules: SceneSynthesizer, before: SceneDescription, after: SceneDescription, change: Change) -> SceneDescription:
    """Return the changed scene with its validity report.

    Raises:
        InvalidChangeError: it fails a check that the scene before did not fail as badly.
    """
    checks = all_checks(rules, after)
    failed = () if all(check.passed for check in checks.values()) else new_faults(all_checks(rules, before), checks)
    if failed:
        raise InvalidChangeError(refusal(change, failed, after), failed)
    told = tuple(check for name, check in checks.items() if name != CAMERA_CLEAR)
    return replace(after, validity=replace(after.validity, valid=all(check.passed for check in told), checks=told))


def all_checks(rules: SceneSynthesizer, scene: SceneDescription) -> dict[str, ValidityCheck]:
    """Return the exact checks of a scene, and that of its camera, by name."""
    return {check.name: check for check in (*report_of(rules, scene).checks, camera_check(rules, scene))}


def new_faults(before: Mapping[str, ValidityCheck], after: Mapping[str, ValidityCheck]) -> tuple[ValidityCheck, ...]:
    """Return the checks that a changed scene fails and the scene before did not fail as badly."""
    return tuple(check for name, check in after.items() if not check.passed and _is_new(check, before[name]))


def camera_checked(rules: SceneSynthesizer, before: SceneDescription, after: SceneDescription, change: Change) -> SceneDescription:
    """Return the scene with its changed camera path.

    Raises:
        InvalidChangeError: the lens would be outside the room or in an object at more poses than before.
    """
    check = camera_check(rules, after)
    if not check.passed and _is_new(check, camera_check(rules, before)):
        raise InvalidChangeError(refusal(change, [check], after), [check])
    return after


def _is_new(check: ValidityCheck, before: ValidityCheck) -> bool:
    """Return whether a failed check is worse than before, or fails at objects that it did not fail at."""
    if before.passed or not set(check.objects) <= set(before.objects):
        return True
    high = check.name not in AT_LEAST
    return check.value > before.value + 1e-9 if high else check.value < before.value - 1e-9


def refusal(change: Change, failed: Sequence[ValidityCheck], scene: SceneDescription) -> str:
    """Return the line that says which checks a change fails, by how much and at what."""
    names: Mapping[int, str] = {thing.id: thing.category for thing in all_things(scene)}
    told = []
    for check in failed:
        bound = "at least" if check.name in AT_LEAST else "at most"
        where = ", ".join(f"{key} {names.get(key, '?')}" for key in check.objects[:6])
        told.append(f"{check.name} {check.value:.3g} ({bound} {check.limit:.3g}){f' at {where}' if where else ''}")
    return f"{change}: value {json.dumps(change.value)}: expected a valid room, got {'; '.join(told)}; take another value, target or seed"
