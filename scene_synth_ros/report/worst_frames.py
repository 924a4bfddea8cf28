"""Which frames of a task an algorithm is worst at, and what makes each of them again."""

from __future__ import annotations

import shlex
from collections.abc import Sequence

from scene_synth_ros.report.evaluation_file import FrameRow, MetricRow, TaskRow


def ordering_metric(task: TaskRow, frames: Sequence[FrameRow]) -> MetricRow | None:
    """Return the first metric of a task that frames have a value of, None where none has."""
    return next((metric for metric in task.metrics if any(metric.name in frame.metrics for frame in frames)), None)


def worst_frames(frames: Sequence[FrameRow], metric: MetricRow, count: int) -> list[FrameRow]:
    """Return the worst frames, the worst first: of each room of each bag its worst, then, where these are too few, the next worst."""
    sign = -1.0 if metric.lower_is_better else 1.0
    ordered = sorted((frame for frame in frames if metric.name in frame.metrics), key=lambda frame: sign * frame.metrics[metric.name])
    seen: dict[tuple[str, int], int] = {}
    turns = []
    for frame in ordered:
        turn = seen[frame.bag, frame.room] = seen.get((frame.bag, frame.room), -1) + 1
        turns.append(turn)
    chosen = sorted(range(len(ordered)), key=lambda k: (turns[k], k))[:count]
    return [ordered[k] for k in sorted(chosen)]


def command_of(frame: FrameRow, bag: str, variant_command: str | None) -> str:
    """Return the shell command that makes a frame again: that of its variant, else the one that renders its bag again."""
    return variant_command or f"scene_synth verify {shlex.quote(bag)}"
