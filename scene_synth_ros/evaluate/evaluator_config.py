"""The evaluator node's parameters, and the topics that they mean."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

from evaluation.tasks import TASKS
from scene_description import Limits
from scene_synth_ros.evaluate.errors import EvaluateError
from scene_synth_ros.evaluate.measuring import GROUP_LAYERS, needed_layers
from scene_synth_ros.evaluate.task_streams import IMAGES, TASK_STREAMS
from scene_synth_ros.evaluate.topics import TypedTopic, parse_mapping
from scene_synth_ros.messages.streams import ODOMETRY_TYPE, POSE_TYPE

_FIXED = "subscriptions are made once"


@dataclass(frozen=True, slots=True, kw_only=True)
class EvaluatorConfig:
    """What is judged, and where it comes from."""

    tasks: Annotated[
        tuple[Annotated[str, Limits(max_length=40)], ...],
        Limits(min_length=1, max_length=20, description=f"What is judged, of: {', '.join(TASKS)}", fixed=_FIXED),
    ] = ("depth",)
    camera: Annotated[str, Limits(min_length=1, max_length=80, description="Camera whose truth counts", fixed=_FIXED)] = "camera"
    estimates: Annotated[
        tuple[Annotated[str, Limits(max_length=300)], ...],
        Limits(
            max_length=20,
            description="Topics of estimates as TASK:=/TOPIC; a task without one has its default, /estimates/depth/image_raw, say",
            fixed=_FIXED,
        ),
    ] = ()
    truth: Annotated[
        tuple[Annotated[str, Limits(max_length=300)], ...],
        Limits(
            max_length=20,
            description="Topics of truth as TASK:=/TOPIC; a task without one has that of the camera, camera/depth/image_raw, say",
            fixed=_FIXED,
        ),
    ] = ()
    breakdown: Annotated[
        bool, Limits(description="Take classes and depth of the truth too, for scores by class and by distance", fixed=_FIXED)
    ] = False
    window: Annotated[
        int,
        Limits(ge=1, le=10_000, description="Stamps that may wait for their other messages before the oldest is given up", fixed=_FIXED),
    ] = 30
    queue: Annotated[
        int, Limits(ge=1, le=10_000, description="Frames that may wait to be measured; more are dropped, and counted", fixed=_FIXED)
    ] = 30
    kept: Annotated[int, Limits(ge=1, le=1_000_000, description="Newest frames of a task that scores and results are of", fixed=_FIXED)] = (
        3000
    )
    out: Annotated[
        str, Limits(max_length=4096, description="File of the results, written at the end and by ~/write; empty writes none", fixed=_FIXED)
    ] = "evaluation.json"
    title: Annotated[str, Limits(max_length=200, description="Title in the results")] = "evaluation"
    algorithm: Annotated[str, Limits(max_length=200, description="Name of what is judged, in the results")] = ""
    autostart: Annotated[bool, Limits(description="Configure and activate at the start", fixed="it is used at the start only")] = True


def check_tasks(config: EvaluatorConfig) -> None:
    """Refuse tasks that do not exist, and mappings that cannot be read.

    Raises:
        EvaluateError: there is one; the line names it.
    """
    unknown = [task for task in config.tasks if task not in TASKS]
    if unknown:
        raise EvaluateError(f"tasks: expected some of {', '.join(TASKS)}, got '{unknown[0]}'")
    for words in (config.estimates, config.truth):
        parse_mapping(words)


LIVE_TYPES = {
    task: IMAGES[:1] if row.types is IMAGES else (POSE_TYPE, ODOMETRY_TYPE) if row.name == "poses" else row.types
    for task, row in TASK_STREAMS.items()
}
"""Task -> types of live estimates: those whose message has the stamp of one frame, uncompressed."""


def truth_names(config: EvaluatorConfig, resolve: Callable[[str], str]) -> dict[str, TypedTopic]:
    """Return layer -> topic of the truth that the tasks need, and with ``breakdown`` of what groups their pixels."""
    chosen = parse_mapping(config.truth)
    layers = (*needed_layers(config.tasks), *(GROUP_LAYERS if config.breakdown else ()))
    names = {layer: chosen.get(layer, TASK_STREAMS[layer].truth(config.camera).topic) for layer in layers}
    return {layer: TypedTopic(resolve(name), TASK_STREAMS[layer].role.type_name) for layer, name in names.items()}


def estimate_names(config: EvaluatorConfig, resolve: Callable[[str], str]) -> dict[str, str]:
    """Return task -> topic of its estimates."""
    chosen = parse_mapping(config.estimates)
    return {task: resolve(chosen.get(task, TASK_STREAMS[task].estimate)) for task in config.tasks}
