"""Names and types of the topics that are judged live."""

from __future__ import annotations

from collections.abc import Callable

from scene_synth_ros.evaluate.evaluator_config import EvaluatorConfig
from scene_synth_ros.evaluate.measuring import GROUP_LAYERS, needed_layers
from scene_synth_ros.evaluate.task_streams import IMAGES, TASK_STREAMS
from scene_synth_ros.evaluate.topics import TypedTopic, parse_mapping
from scene_synth_ros.messages.streams import ODOMETRY_TYPE, POSE_TYPE

LIVE_TYPES = {
    task: IMAGES[:1] if row.types is IMAGES else (POSE_TYPE, ODOMETRY_TYPE) if row.name == "poses" else row.types
    for task, row in TASK_STREAMS.items()
}
"""Task -> types of live estimates: those whose message has the stamp of one frame, uncompressed."""


def truth_names(config: EvaluatorConfig, resolve: Callable[[str], str]) -> dict[str, TypedTopic]:
    """Return layer -> topic of the truth that the tasks need, and with ``breakdown`` of what groups their pixels.

    Args:
        config: of the node.
        resolve: makes the fully qualified name of a relative one.
    """
    chosen = parse_mapping(config.truth)
    layers = (*needed_layers(config.tasks), *(GROUP_LAYERS if config.breakdown else ()))
    names = {layer: chosen.get(layer, TASK_STREAMS[layer].truth(config.camera).topic) for layer in layers}
    return {layer: TypedTopic(resolve(name), TASK_STREAMS[layer].role.type_name) for layer, name in names.items()}


def estimate_names(config: EvaluatorConfig, resolve: Callable[[str], str]) -> dict[str, str]:
    """Return task -> topic of its estimates.

    Args:
        config: of the node.
        resolve: makes the fully qualified name of a relative one.
    """
    chosen = parse_mapping(config.estimates)
    return {task: resolve(chosen.get(task, TASK_STREAMS[task].estimate)) for task in config.tasks}
