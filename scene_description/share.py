"""Finds the files of ``config/``: beside the packages in a source tree, under ``share/scene_synth_ros`` once installed."""

from pathlib import Path


def config_path(name: str) -> Path:
    """Return the path of the file or folder ``name`` of ``config/``, for example ``grammars/bedroom.yaml``.

    Works from a source tree, an ordinary or editable installation and a colcon workspace, without environment variables.

    Raises:
        FileNotFoundError: no installation of the configuration holds ``name``.
    """
    here = Path(__file__).resolve()
    for folder in here.parents:
        source = folder / "config"
        if (folder / "package.xml").is_file() and (source / name).exists():
            return source / name
        installed = folder / "share" / "scene_synth_ros" / "config" / name
        if installed.exists():
            return installed
    raise FileNotFoundError(f"configuration '{name}' not found near {here.parent}; reinstall scene_synth_ros")
