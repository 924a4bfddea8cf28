"""The table of tasks."""

from evaluation.core.task import Task
from evaluation.metrics.depth import DEPTH, DEPTH_AFFINE, DEPTH_ALIGNED

TASKS: dict[str, Task] = {task.name: task for task in (DEPTH, DEPTH_ALIGNED, DEPTH_AFFINE)}
"""Name -> task; what an algorithm returns under "depth" is judged by all three tasks of depth."""
