"""What is wrong with the words of a command."""

from pathlib import Path

from scene_description import SceneSynthError


class UsageError(SceneSynthError):
    """An option or a file name that cannot be used; one line with the option, expected and got."""


def refuse_missing_folder(option: str, folder: Path | None) -> None:
    """Refuse a folder that is given and is none.

    Raises:
        UsageError: it is no folder.
    """
    if folder is not None and not folder.is_dir():
        raise UsageError(f"{option} {folder}: expected a folder, got {'a file' if folder.exists() else 'none'}; check the path")
