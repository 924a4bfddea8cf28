"""The services of simulation_interfaces by name: what each reads its request as, and what it does.  No ROS.

Answers are mappings with the fields of the package's responses.  One that has to wait is a :class:`Later`, which is asked again until the
answer is there.  Objects can be spawned, deleted and moved while the simulation is stopped: while it plays, furniture stands still.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from scene_description import SceneSynthError, error_line
from scene_description.strict import FieldError, from_mapping
from scene_synth_ros.simulation import furnishing, requests, steering
from scene_synth_ros.simulation.entities import bounds_of, info_of, state_of
from scene_synth_ros.simulation.run import FAILED, Answer, Later, Refusal, Run, result


@dataclass(frozen=True, slots=True)
class Service:
    """A row of the table of services: what its request is read as, and what it does."""

    request: type
    answer: Callable[[Run, Any], Answer | Later]


def serve(run: Run, name: str, request: Mapping[str, Any]) -> Answer | Later:
    """Return the answer of a service; whatever is wrong with the request is told in its result.

    Raises:
        KeyError: there is no such service.
    """
    service = SERVICES[name]
    try:
        return service.answer(run, from_mapping(service.request, request, name))
    except FieldError as error:
        return result(FAILED, str(error))
    except Refusal as refusal:
        return result(refusal.code, refusal.line)


def again(later: Later) -> Answer | None:
    """Return an answer that was waited for, if it is there."""
    try:
        return later.ask()
    except Refusal as refusal:
        return result(refusal.code, refusal.line)
    except SceneSynthError as error:
        return result(FAILED, error_line(error))


SERVICES: dict[str, Service] = {
    "get_simulator_features": Service(requests.Nothing, steering.tell_features),
    "get_simulation_state": Service(requests.Nothing, steering.tell_state),
    "set_simulation_state": Service(requests.SetSimulationState, steering.set_state),
    "step_simulation": Service(requests.StepSimulation, steering.step),
    "reset_simulation": Service(requests.ResetSimulation, steering.reset),
    "get_entities": Service(requests.OfEntities, furnishing.tell_entities),
    "get_entities_states": Service(requests.OfEntities, furnishing.tell_states),
    "get_entity_state": Service(
        requests.OfEntity, furnishing.of_entity("state", lambda run, item: state_of(item, run.shown_ns, run.frame))
    ),
    "get_entity_info": Service(requests.OfEntity, furnishing.of_entity("info", lambda run, item: info_of(item))),
    "get_entity_bounds": Service(requests.OfEntity, furnishing.of_entity("bounds", lambda run, item: bounds_of(item))),
    "set_entity_state": Service(requests.SetEntityState, furnishing.move),
    "delete_entity": Service(requests.OfEntity, furnishing.delete),
    "spawn_entity": Service(requests.SpawnEntity, furnishing.spawn),
    "spawn_entities": Service(requests.SpawnEntities, furnishing.spawn_all),
    "get_spawnables": Service(requests.GetSpawnables, furnishing.tell_spawnables),
    "load_world": Service(requests.LoadWorld, steering.load),
    "get_current_world": Service(requests.Nothing, steering.tell_world),
    "get_available_worlds": Service(requests.GetAvailableWorlds, steering.tell_worlds),
}
"""Name of a service below the namespace, its type's in snake case -> what it does."""
