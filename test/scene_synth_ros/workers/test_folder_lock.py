"""One run at a time in a folder."""

from pathlib import Path

import pytest

from scene_synth_ros.workers import folder_lock as module
from scene_synth_ros.workers.folder_lock import FolderInUseError, folder_lock


def test_a_folder_has_one_run_at_a_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_PATIENCE_S", 0.0)
    with folder_lock(tmp_path / "d"):
        with pytest.raises(FolderInUseError, match="another run is at work there"), folder_lock(tmp_path / "d"):
            pass
        with folder_lock(tmp_path / "d", ".slice-1-of-2.lock"):
            pass
    with folder_lock(tmp_path / "d"):
        pass
