"""What services answer, without ROS: entities and filters, changes of a stopped world, hostile requests, and both versions' fields."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import pytest
from counterfactual_rooms import room, rules

from grammar.synthesize import CameraTimes
from scene_description import SceneDescription, scene_to_json
from scene_synth_ros.simulation.run import Answer, Later
from scene_synth_ros.simulation.services import fill, to_plain
from scene_synth_ros.simulation.simulation import SERVICES, again, serve
from scene_synth_ros.simulation.world import UNCHANGED, World, checked_world

TIMES = CameraTimes(frames=5, start_ns=10**9, rate_hz=10.0)


class Stopped:
    """A run whose first room is there, and which begins again at once."""

    frame, shown_ns = "map", 10**9

    def __init__(self) -> None:
        self.phase, self.world, self.rules, self.sampled = "stopped", UNCHANGED, rules(), room("bedroom")

    @property
    def scene(self) -> SceneDescription:
        return self.world.scene(self.sampled, TIMES, self.rules)

    def put(self, world: World) -> None:
        world.scene(self.sampled, TIMES, self.rules)
        self.world = world

    def can_hold(self) -> str:
        return ""

    def can_restart_time(self) -> str:
        return "a recorder is at work"

    def begin_anew(self, *, time: bool, stopped: bool) -> None:
        assert not time
        self.phase = "stopped" if stopped else self.phase

    def has_begun_anew(self) -> bool:
        return True

    def load(self, scene: SceneDescription | None, room_type: str, seed: int | None) -> None:
        self.world = UNCHANGED if scene is None else checked_world(scene, self.rules)

    def play(self) -> None:
        self.phase = "playing"


@pytest.fixture
def run() -> Stopped:
    return Stopped()


def ask(run: Any, service: str, /, **request: Any) -> Answer:
    answer = serve(run, service, request)
    found = again(answer) if isinstance(answer, Later) else answer
    assert found is not None
    return found


def code(answer: Answer) -> int:
    return int(answer["result"]["result"])


def test_entities_are_found_by_name_tag_and_place(run: Stopped) -> None:
    everything = ask(run, "get_entities")["entities"]
    assert len(everything) == len(run.scene.objects) == len(set(everything))
    (bed,) = ask(run, "get_entities", filters={"filter": "^bed_"})["entities"]
    item = next(item for item in run.scene.objects if item.category == "bed")
    state = ask(run, "get_entity_state", entity=bed)["state"]
    turn = state["pose"]["orientation"]
    assert math.remainder(2.0 * math.atan2(turn["z"], turn["w"]) - item.yaw_rad, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-12)
    at = state["pose"]["position"]
    tagged = ask(run, "get_entities", filters={"tags": {"tags": ["bed", "on_floor"], "filter_mode": 1}})["entities"]
    assert tagged == [bed] and not ask(run, "get_entities", filters={"categories": [{"category": 1}]})["entities"]
    sphere = {"type": 3, "points": [{"x": at["x"], "y": at["y"], "z": 0.1}, {"x": 0.01}]}
    assert bed in ask(run, "get_entities", filters={"bounds": sphere})["entities"]
    away = {"type": 1, "points": [{"x": 90.0, "y": 90.0, "z": 9.0}, {"x": 80.0, "y": 80.0, "z": 0.0}]}
    assert not ask(run, "get_entities", filters={"bounds": away})["entities"]
    half = 0.5 * item.size_m[0]
    tip = at["x"] + half * math.cos(item.yaw_rad), at["y"] + half * math.sin(item.yaw_rad)
    for by, is_met in ((-0.01, True), (0.05, False)):
        x, y = (tip[k] + by * (math.cos(item.yaw_rad), math.sin(item.yaw_rad))[k] for k in range(2))
        corner = {"type": 1, "points": [{"x": x + 1e-3, "y": y + 1e-3, "z": 0.1}, {"x": x, "y": y, "z": 0.0}]}
        assert (bed in ask(run, "get_entities", filters={"bounds": corner})["entities"]) == is_met


@pytest.mark.parametrize("pattern", ["(a+)+$", "(", r"(a)\1", "a*a*a*a*"])
def test_expressions_that_may_take_for_ever_are_refused(run: Stopped, pattern: str) -> None:
    answer = ask(run, "get_entities", filters={"filter": pattern})
    assert code(answer) == 0 and "filter" in answer["result"]["error_message"]
    assert code(ask(run, "get_entities", filters={"bounds": {"type": 2}})) == 0


def test_what_is_moved_and_deleted_is_back_after_a_reset_of_its_scope(run: Stopped) -> None:
    (lamp, *_) = ask(run, "get_entities", filters={"filter": "table_lamp"})["entities"]
    state = ask(run, "get_entity_state", entity=lamp)["state"]
    at = state["pose"]["position"]
    moved = {"pose": {"position": at | {"x": at["x"] + 0.01}, "orientation": state["pose"]["orientation"]}}
    assert code(ask(run, "set_entity_state", entity=lamp, state=moved)) == 1
    assert ask(run, "get_entity_state", entity=lamp)["state"]["pose"]["position"]["x"] == pytest.approx(at["x"] + 0.01)
    assert code(ask(run, "set_entity_state", entity=lamp, state={"twist": {"linear": {"x": 1.0}}}, set_pose=False)) == 4
    tilted = {"pose": {"position": at, "orientation": {"x": 0.7071, "w": 0.7071}}}
    assert code(ask(run, "set_entity_state", entity=lamp, state=tilted)) == 101
    assert code(ask(run, "delete_entity", entity=lamp)) == 1
    assert code(ask(run, "reset_simulation", scope=2)) == 1 and code(ask(run, "get_entity_state", entity=lamp)) == 2
    assert code(ask(run, "reset_simulation", scope=6)) == 1
    assert ask(run, "get_entity_state", entity=lamp)["state"]["pose"]["position"] == at
    refused = ask(run, "reset_simulation")
    assert code(refused) == 4 and refused["result"]["error_message"] == "a recorder is at work"
    run.play()
    assert code(ask(run, "delete_entity", entity=lamp)) == 3


def test_a_room_in_json_takes_the_place_of_the_first_if_it_is_valid(run: Stopped) -> None:
    other = room("bathroom")
    answer = ask(run, "load_world", resource_string=scene_to_json(other))
    assert code(answer) == 1 and answer["world"]["tags"] == ["bathroom"]
    assert [pose.stamp_ns for pose in run.scene.camera_path][:2] == [10**9, 11 * 10**8]
    floating = other.objects[0].position_m
    text = scene_to_json(other).replace(f'"position_m":[{floating[0]}', f'"position_m":[{floating[0] + 50.0}', 1)
    answer = ask(run, "load_world", resource_string=text)
    assert code(answer) == 4 and "out_of_bounds" in answer["result"]["error_message"]
    assert code(ask(run, "load_world")) == 102 and code(ask(run, "load_world", uri="file:///etc/passwd")) == 101


@pytest.mark.parametrize("name", SERVICES)
@pytest.mark.parametrize("request_", [{"entity": 3}, {"nonsense": 1}, {"state": None}, {"filters": []}, {"uri": "model://["}])
def test_no_request_raises(run: Stopped, name: str, request_: Mapping[str, Any]) -> None:
    answer = serve(run, name, request_)
    assert isinstance(answer, Later) or code(answer) in (4, 101, 102)


class Message:
    """A message of a package's older version: fields and their types."""

    def __init__(self, types: dict[str, str], **values: Any) -> None:
        self._types = types
        for name, value in values.items():
            setattr(self, name, value)

    def get_fields_and_field_types(self) -> dict[str, str]:
        return self._types


def test_fields_that_a_version_lacks_or_calls_otherwise_are_read_and_written(run: Stopped) -> None:
    old = Message({"uri": "string", "description": "string"}, uri="", description="")
    fill(old, ask(run, "get_spawnables")["spawnables"][0])
    assert old.uri.startswith("model://") and not hasattr(old, "entity_resource")
    asked = {"name": "string", "uri": "string", "resource_string": "string"}
    request = Message(asked, name="thing", uri=old.uri.replace("model", "shape"), resource_string="")
    assert code(ask(run, "spawn_entity", **to_plain(request))) == 103
    request.uri = ""
    assert code(ask(run, "spawn_entity", **to_plain(request))) == 104
