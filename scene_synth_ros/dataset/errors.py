"""What is wrong with a dataset that is read."""

from scene_description import SceneSynthError


class DatasetError(SceneSynthError):
    """A dataset, layer, split or frame that cannot be read; one line: where, expected, got, what to do."""
