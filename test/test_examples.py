"""The examples run as they stand."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def run(folder: Path, *words: str) -> str:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    process = subprocess.run(
        [sys.executable, *words], cwd=folder, env=environment, capture_output=True, text=True, timeout=120, check=False
    )
    assert process.returncode == 0, process.stderr
    return process.stdout


def test_one_room_and_one_image(tmp_path: Path) -> None:
    room = run(tmp_path, str(ROOT / "examples" / "one_room.py"), "room.json")
    assert "bed " in room and "FAILED" not in room
    image = run(tmp_path, str(ROOT / "examples" / "one_image.py"), "room.json")
    assert "wrote color.png and classes.png" in image
    assert (tmp_path / "color.png").stat().st_size > 10_000 and (tmp_path / "classes.png").stat().st_size > 1_000
