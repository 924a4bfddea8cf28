"""What is wrong with the words of a command."""

from scene_description import SceneSynthError


class UsageError(SceneSynthError):
    """An option or a file name that cannot be used; one line with the option, expected and got."""
