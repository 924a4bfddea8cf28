"""What services do with the objects of a room: they tell of them, and while the simulation is stopped they change them.  No ROS."""

import math
import re
from collections.abc import Callable
from typing import Any

from grammar.counterfactual import Change, ChangeError, InvalidChangeError
from grammar.counterfactual.addition import addable
from scene_description import SceneDescription, SceneObject
from scene_synth_ros.simulation import requests
from scene_synth_ros.simulation.entities import UnsupportedFilterError, entities, filtered, state_of
from scene_synth_ros.simulation.run import (
    DONE,
    FAILED,
    INCORRECT_STATE,
    MODELS,
    NOT_FOUND,
    UNSUPPORTED,
    Answer,
    Refusal,
    Run,
    read_uri,
    result,
    scene_of,
)
from scene_synth_ros.simulation.world import MOVED, upright_yaw

NAME_NOT_UNIQUE, NAME_INVALID, SPAWN_FORMAT, SPAWN_NOTHING, NAMESPACE_INVALID, MISSING_ASSETS, SPAWN_POSE = (
    101,
    102,
    103,
    104,
    105,
    107,
    109,
)
STATE_POSE, SPAWN_FAILED = 101, 150
_NAME = re.compile(r"[A-Za-z0-9_.:\-]{1,60}")
_NAMESPACE = re.compile(r"[A-Za-z0-9_/~]*")
_FLAT_M = 1e-3


def _found(run: Run, filters: requests.EntityFilters) -> dict[str, SceneObject]:
    try:
        return filtered(entities(scene_of(run), run.world.names), filters)
    except UnsupportedFilterError as error:
        raise Refusal(UNSUPPORTED, str(error)) from None


def tell_entities(run: Run, request: requests.OfEntities) -> Answer:
    """Tell the names of the objects that a filter means."""
    return {"entities": list(_found(run, request.filters)), **result()}


def tell_states(run: Run, request: requests.OfEntities) -> Answer:
    """Tell where they are."""
    found = _found(run, request.filters)
    states = [state_of(item, run.shown_ns, run.frame) for item in found.values()]
    return {"entities": list(found), "states": states, **result()}


def of_entity(name: str, tell: Callable[[Run, SceneObject], Answer]) -> Callable[[Run, requests.OfEntity], Answer]:
    """Return what tells something of one object, under a name."""
    return lambda run, request: {name: tell(run, _entity(run, request.entity)), **result()}


def _entity(run: Run, name: str) -> SceneObject:
    found = entities(scene_of(run), run.world.names)
    if name not in found:
        raise Refusal(NOT_FOUND, f"entity: expected one of GetEntities, got '{name}'")
    return found[name]


def _edited(run: Run, change: Change) -> SceneDescription:
    """Make a change in the room that will come first; return it changed."""
    if run.phase != "stopped":
        raise Refusal(INCORRECT_STATE, f"the simulation is {run.phase}, and furniture stands still meanwhile; stop it first")
    scene_of(run)
    run.put(run.world.after(change))
    return scene_of(run)


def move(run: Run, request: requests.SetEntityState) -> Answer:
    """Put an object elsewhere on what carries it, with what it carries itself."""
    item, state = _entity(run, request.entity), request.state
    motions = [m for m, is_set in ((state.twist, request.set_twist), (state.acceleration, request.set_acceleration)) if is_set]
    if any(getattr(part, axis) for m in motions for part in (m.linear, m.angular) for axis in "xyz"):
        raise Refusal(FAILED, f"state: expected no twist and no acceleration of '{request.entity}', which stands still")
    if not request.set_pose:
        return result()
    x, y, z, yaw = _pose(run, state.header, state.pose, STATE_POSE)
    if abs(z - item.position_m[2]) > _FLAT_M:
        raise Refusal(STATE_POSE, f"state.pose: expected z {item.position_m[2]:.4g}, on what carries '{request.entity}', got {z:.4g}")
    by = [x - item.position_m[0], y - item.position_m[1], math.remainder(yaw - item.yaw_rad, 2.0 * math.pi)]
    try:
        _edited(run, Change(MOVED, {"object": item.id}, by))
    except InvalidChangeError as error:
        raise Refusal(FAILED, str(error)) from None
    except ChangeError as error:
        raise Refusal(STATE_POSE, str(error)) from None
    return result()


def _pose(run: Run, header: requests.Header, pose: requests.Pose, code: int) -> tuple[float, float, float, float]:
    """Return place and yaw of an upright pose in the world."""
    if header.frame_id not in ("", "world", run.frame):
        raise Refusal(code, f"pose: expected frame '{run.frame}' or none, got '{header.frame_id}'")
    q, at = pose.orientation, pose.position
    yaw = upright_yaw(q.x, q.y, q.z, q.w)
    if yaw is None:
        raise Refusal(code, f"pose: expected a unit quaternion about z, got ({q.x:.4g}, {q.y:.4g}, {q.z:.4g}, {q.w:.4g})")
    return at.x, at.y, at.z, yaw


def delete(run: Run, request: requests.OfEntity) -> Answer:
    """Take an object away with what it carries."""
    item = _entity(run, request.entity)
    try:
        scene = _edited(run, Change("object_removed", {"object": item.id}, True))
    except ChangeError as error:
        raise Refusal(FAILED, str(error)) from None
    return result(line=(scene.counterfactuals or ())[-1].note)


def spawn(run: Run, request: requests.SpawnEntity) -> Answer:
    """Put a new object on what carries it."""
    name = _new_name(run, request)
    if not _NAMESPACE.fullmatch(request.entity_namespace):
        raise Refusal(NAMESPACE_INVALID, f"entity_namespace: expected letters, digits, _ and /, got '{request.entity_namespace}'")
    category, style, seed = _model(run, request.resource)
    x, y, z, yaw = _pose(run, request.initial_pose.header, request.initial_pose.pose, SPAWN_POSE)
    value = {"at_m": [x, y, z], "yaw_rad": yaw, "style": style, "seed": seed}
    try:
        scene = _edited(run, Change("object_placed", {"category": category}, value))
    except InvalidChangeError as error:
        raise Refusal(FAILED, str(error)) from None
    except ChangeError as error:
        raise Refusal(SPAWN_POSE, str(error)) from None
    new = scene.objects[-1]
    if name:
        run.put(run.world.named(name, new.id))
    return {"entity_name": name or f"{new.category}_{new.id}", **result()}


def _new_name(run: Run, request: requests.SpawnEntity) -> str:
    """Return the name that a new entity gets, empty for one of its category and id."""
    name = request.name
    if not _NAME.fullmatch(name):
        if request.allow_renaming:
            return ""
        raise Refusal(NAME_INVALID, f"name: expected 1 to 60 letters, digits, _ . : and -, or allow_renaming, got '{name[:60]}'")
    if name in entities(scene_of(run), run.world.names):
        if request.allow_renaming:
            return ""
        raise Refusal(NAME_NOT_UNIQUE, f"name: expected one that no entity has, or allow_renaming, got '{name}'")
    return name


def _model(run: Run, resource: requests.Resource) -> tuple[str, str | None, int | None]:
    """Return category, style and seed of a model."""
    if not resource.uri:
        code = SPAWN_FORMAT if resource.resource_string else SPAWN_NOTHING
        raise Refusal(code, f"entity_resource: expected a uri {MODELS}://CATEGORY/STYLE of GetSpawnables, got none")
    category, style, seed = read_uri(resource.uri, MODELS, SPAWN_FORMAT)
    known = run.rules.appearance.categories
    if category not in addable(run.rules) or (style and style not in known[category].styles):
        raise Refusal(MISSING_ASSETS, f"entity_resource.uri: expected one of GetSpawnables, got '{resource.uri}'")
    return category, style or None, seed


def spawn_all(run: Run, request: requests.SpawnEntities) -> Answer:
    """Put several, one after the other; those that cannot be are told."""
    results: list[dict[str, Any]] = []
    for one in request.spawn_requests:
        try:
            results.append(dict(spawn(run, one)))
        except Refusal as refusal:
            results.append(result(refusal.code, refusal.line))
    bad = sum(one["result"]["result"] != DONE for one in results)
    whole = result(SPAWN_FAILED, f"{bad} of {len(results)} could not be spawned") if bad else result()
    return {"results": results, **whole}


def tell_spawnables(run: Run, request: requests.GetSpawnables) -> Answer:
    """Tell of the models."""
    styles = {category: sorted(run.rules.appearance.categories[category].styles) for category in addable(run.rules)}
    found = [
        {"uri": uri, "entity_resource": {"uri": uri}, "description": f"{category}, {style}"}
        for category, names in styles.items()
        for style in names
        for uri in [f"{MODELS}://{category}/{style}"]
    ]
    unknown = f"sources that are not known: {', '.join(request.sources)}" if request.sources else ""
    return {"spawnables": found, **result(line=unknown)}
