"""What goes wrong between an algorithm and the truth."""

from scene_description.errors import SceneSynthError


class EvaluationError(SceneSynthError):
    """An estimate, or an evaluation, that cannot be used: what, where, got, expected and what to do, in one line."""
