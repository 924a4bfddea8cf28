"""What services do with a run as a whole: its state, its frames one by one, its beginning, and the room that it begins with.  No ROS."""

from typing import Any

from scene_description import SceneDescription, SceneSynthError, error_line, scene_from_json
from scene_description.strict import FieldError
from scene_synth_ros.simulation import requests
from scene_synth_ros.simulation.entities import has_tags
from scene_synth_ros.simulation.run import (
    FAILED,
    MODELS,
    NOT_FOUND,
    PAUSED,
    PLAYING,
    QUITTING,
    ROOMS,
    STOPPED,
    UNSUPPORTED,
    Answer,
    Later,
    Refusal,
    Run,
    read_uri,
    refuse_if,
    result,
    scene_of,
)

TIME, STATE, SPAWNED = 1, 2, 4
ALREADY_THERE = 101
WORLD_FORMAT, WORLD_NOTHING, WORLD_TEXT = 101, 102, 103
FEATURES = (0, 1, 4, 5, 6, 8, 10, 11, 12, 14, 20, 21, 22, 23, 24, 25, 40, 41, 42, 44, 45, 50)
"""Numbers in SimulatorFeatures of what is always served."""
LOCK_STEP_FEATURES = (26, 31, 32)
"""Pause and steps: of a run in lock-step."""
_MANY_STEPS = 1_000_000


def tell_features(run: Run, _request: requests.Nothing) -> Answer:
    """Tell what is served."""
    features = [*FEATURES, *(() if run.can_hold() else LOCK_STEP_FEATURES)]
    custom = f"scene_synth_ros; spawns {MODELS}://CATEGORY/STYLE?seed=N and loads {ROOMS}://TYPE?seed=N, or the JSON of a room"
    return {"features": {"features": sorted(features), "spawn_formats": [], "custom_info": custom}}


def tell_state(run: Run, _request: requests.Nothing) -> Answer:
    """Tell whether it is stopped, playing or paused."""
    return {"state": {"state": {"stopped": STOPPED, "playing": PLAYING, "paused": PAUSED}[run.phase]}, **result()}


def set_state(run: Run, request: requests.SetSimulationState) -> Answer | Later:
    """Stop, play, pause or end the run."""
    wanted, now = request.state.state, run.phase
    if wanted not in (STOPPED, PLAYING, PAUSED, QUITTING):
        raise Refusal(FAILED, f"state: expected stopped 0, playing 1, paused 2 or quitting 3, got {wanted}")
    if wanted == {"stopped": STOPPED, "playing": PLAYING, "paused": PAUSED}[now]:
        raise Refusal(ALREADY_THERE, f"the simulation is {now} already")
    if wanted == PLAYING:
        run.play()
        return result()
    if wanted == PAUSED:
        refuse_if(UNSUPPORTED, run.can_hold())
        run.hold()
        return result()
    run.put(run.world.reset(moved=True, spawned=True))
    run.begin_anew(time=not run.can_restart_time(), stopped=True)
    return Later(lambda: _quit(run)) if wanted == QUITTING else _begun(run)


def _quit(run: Run) -> Answer | None:
    if not run.has_begun_anew():
        return None
    run.quit()
    return result()


def _begun(run: Run) -> Later:
    """Return the answer of what begins the run again."""
    return Later(lambda: result() if run.has_begun_anew() else None)


def step(run: Run, request: requests.StepSimulation) -> Answer | Later:
    """Let so many frames out of a run that is paused."""
    refuse_if(UNSUPPORTED, run.can_hold())
    if run.phase != "paused":
        raise Refusal(FAILED, f"the simulation is {run.phase}; pause it first")
    if not 1 <= request.steps <= _MANY_STEPS:
        raise Refusal(FAILED, f"steps: expected a whole number in [1, {_MANY_STEPS}], got {request.steps}")
    is_shown = run.let_out(request.steps)
    return Later(lambda: result() if is_shown() else None)


def reset(run: Run, request: requests.ResetSimulation) -> Answer | Later:
    """Let the run begin again, with its time, its poses, its objects, or all of them."""
    scope = request.scope or 255
    if scope & TIME:
        refuse_if(FAILED, run.can_restart_time())
    run.put(run.world.reset(moved=bool(scope & STATE), spawned=bool(scope & SPAWNED)))
    run.begin_anew(time=bool(scope & TIME), stopped=run.phase == "stopped")
    return _begun(run)


def load(run: Run, request: requests.LoadWorld) -> Answer | Later:
    """Take another room to begin with, and stop."""
    resource = request.resource
    try:
        if resource.uri:
            room_type, _, seed = read_uri(resource.uri, ROOMS, WORLD_FORMAT)
            if room_type not in run.rules.grammars:
                raise Refusal(NOT_FOUND, f"uri: expected a room type ({', '.join(run.rules.grammars)}), got '{room_type}'")
            run.load(None, room_type, seed)
        elif resource.resource_string:
            run.load(scene_from_json(resource.resource_string), "", None)
        else:
            raise Refusal(WORLD_NOTHING, f"world_resource: expected a uri {ROOMS}://TYPE?seed=N or a room's JSON, got neither")
    except FieldError as error:
        raise Refusal(WORLD_TEXT, str(error)) from None
    except SceneSynthError as error:
        raise Refusal(FAILED, error_line(error)) from None
    run.begin_anew(time=not run.can_restart_time(), stopped=True)
    return Later(lambda: {"world": _world_of(scene_of(run)), **result()} if run.has_begun_anew() else None)


def _world_of(scene: SceneDescription) -> dict[str, Any]:
    text = f"{scene.category} with {len(scene.objects)} objects, room {scene.index} of seed {scene.seed}"
    uri = f"{ROOMS}://{scene.category}?seed={scene.seed}"
    return {"name": scene.id, "world_resource": {"uri": uri}, "description": text, "tags": [scene.category]}


def tell_world(run: Run, _request: requests.Nothing) -> Answer:
    """Tell of the room at work."""
    return {"world": _world_of(scene_of(run)), **result()}


def tell_worlds(run: Run, request: requests.GetAvailableWorlds) -> Answer:
    """Tell of the types of rooms."""
    found = [
        {"name": name, "world_resource": {"uri": f"{ROOMS}://{name}"}, "description": f"rooms of the type {name}", "tags": [name]}
        for name in run.rules.grammars
        if has_tags([name], request.filter)
    ]
    return {"worlds": found, **result()}
