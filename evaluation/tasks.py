"""The table of tasks."""

from evaluation.core.task import Task
from evaluation.metrics.depth import DEPTH, DEPTH_AFFINE, DEPTH_ALIGNED
from evaluation.metrics.detections import DETECTIONS
from evaluation.metrics.flow import FLOW, FLOW_BACKWARD
from evaluation.metrics.instance import INSTANCE
from evaluation.metrics.normals import NORMALS
from evaluation.metrics.points import POINTS
from evaluation.metrics.poses import POSES
from evaluation.metrics.semantic import SEMANTIC

TASKS: dict[str, Task] = {
    task.name: task
    for task in (DEPTH, DEPTH_ALIGNED, DEPTH_AFFINE, NORMALS, SEMANTIC, INSTANCE, FLOW, FLOW_BACKWARD, POSES, DETECTIONS, POINTS)
}
"""Name -> task; what an algorithm returns under "depth" is judged by all three tasks of depth."""
