"""What a split cannot be made of."""

from scene_description import SceneSynthError


class SplitError(SceneSynthError):
    """Words of a split, or a source, that cannot be used; one line."""
