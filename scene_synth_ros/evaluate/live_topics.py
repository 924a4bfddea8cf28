"""Names and types of the topics that are judged live."""

from __future__ import annotations

from collections.abc import Callable

from scene_synth_ros.evaluate.evaluator_config import EvaluatorConfig
from scene_synth_ros.evaluate.measuring import GROUP_LAYERS, needed_layers
from scene_synth_ros.evaluate.readings import ODOMETRY, POSE
from scene_synth_ros.evaluate.task_streams import IMAGES, TASK_STREAMS, TRUTH_TYPES
from scene_synth_ros.evaluate.topics import TypedTopic, parse_mapping

LIVE_TYPES = {
    task: IMAGES[:1] if row.types is IMAGES else (POSE, ODOMETRY) if row.name == "poses" else row.types
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
    names = {layer: chosen.get(layer, f"{config.camera}/{TASK_STREAMS[layer].truth[0]}") for layer in layers}
    return {layer: TypedTopic(resolve(name), TRUTH_TYPES.get(layer, LIVE_TYPES[layer])[0]) for layer, name in names.items()}


def estimate_names(config: EvaluatorConfig, resolve: Callable[[str], str]) -> dict[str, str]:
    """Return task -> topic of its estimates.

    Args:
        config: of the node.
        resolve: makes the fully qualified name of a relative one.
    """
    chosen = parse_mapping(config.estimates)
    return {task: resolve(chosen.get(task, TASK_STREAMS[task].estimate)) for task in config.tasks}
