"""What is wrong with an evaluation's inputs."""

from __future__ import annotations

from scene_description import SceneSynthError


class EvaluateError(SceneSynthError):
    """A bag, topic, option or algorithm that cannot be judged; one line: what, where, expected, got, what to do."""


class EstimateError(SceneSynthError):
    """One estimate that cannot be measured: wrong size, encoding or frame; the frame counts as missing.  One line."""
