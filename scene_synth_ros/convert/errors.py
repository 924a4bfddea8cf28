"""What keeps a source from being converted."""

from scene_description import SceneSynthError


class ConvertError(SceneSynthError):
    """A source that lacks what a format needs, or has what a format cannot carry; one line: what, where, got, expected, what to do."""
