"""Which frames of a task an algorithm is worst at, and what makes each of them again."""

from __future__ import annotations

import shlex
from collections.abc import Sequence

from evaluation.evaluation_file import FrameRow, MetricRow, TaskRow


def ordering_metric(task: TaskRow, frames: Sequence[FrameRow]) -> MetricRow | None:
    """Return the first metric of a task that frames have a value of, None where none has."""
    return next((metric for metric in task.metrics if any(frame.metrics.get(metric.name) is not None for frame in frames)), None)


def worst_frames(frames: Sequence[FrameRow], metric: MetricRow, count: int) -> list[FrameRow]:
    """Return the worst frames, the worst first: of each room of each bag its worst, then, where these are too few, the next worst."""
    sign = -1.0 if metric.better == "lower" else 1.0
    known = [(value, frame) for frame in frames if (value := frame.metrics.get(metric.name)) is not None]
    ordered = [frame for _, frame in sorted(known, key=lambda pair: sign * pair[0])]
    seen: dict[tuple[str, int], int] = {}
    turns = []
    for frame in ordered:
        place = frame.key.bag, frame.key.room
        turn = seen[place] = seen.get(place, -1) + 1
        turns.append(turn)
    chosen = sorted(range(len(ordered)), key=lambda k: (turns[k], k))[:count]
    return [ordered[k] for k in sorted(chosen)]


def command_of(bag: str, variant_command: str | None) -> str:
    """Return the shell command that makes a frame again: that of its variant, else the one that renders its bag again."""
    return variant_command or f"scene_synth verify {shlex.quote(bag)}"
