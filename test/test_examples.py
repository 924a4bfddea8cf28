"""The examples run as they stand."""

import io
import os
import subprocess
import sys
import tarfile
from pathlib import Path

import numpy as np
from PIL import Image

ROOT = Path(__file__).resolve().parent.parent


def run(folder: Path, *words: str) -> str:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    process = subprocess.run(
        [sys.executable, *words], cwd=folder, env=environment, capture_output=True, text=True, timeout=300, check=False
    )
    assert process.returncode == 0, process.stderr
    return process.stdout


def test_one_room_and_one_image(tmp_path: Path) -> None:
    room = run(tmp_path, str(ROOT / "examples" / "one_room.py"), "room.json")
    assert "bed " in room and "FAILED" not in room
    image = run(tmp_path, str(ROOT / "examples" / "one_image.py"), "room.json")
    assert "wrote color.png and classes.png" in image
    assert (tmp_path / "color.png").stat().st_size > 10_000 and (tmp_path / "classes.png").stat().st_size > 1_000


def test_shards_are_read_as_a_stream(tmp_path: Path) -> None:
    def member(shard: tarfile.TarFile, name: str, data: bytes) -> None:
        head = tarfile.TarInfo(name)
        head.size = len(data)
        shard.addfile(head, io.BytesIO(data))

    for number in range(2):
        with tarfile.open(tmp_path / f"shard-{number:06d}.tar", "w") as shard:
            for key in (f"room_{number:04d}_000000", f"room_{number:04d}_000001"):
                classes, depth = io.BytesIO(), io.BytesIO()
                Image.fromarray(np.array([[4, 4], [7, 7]], np.uint8)).save(classes, "PNG")
                np.save(depth, np.array([[2.0, np.inf], [0.5, 0.25]], np.float32))
                member(shard, f"{key}.depth.npy", depth.getvalue())
                member(shard, f"{key}.semantic.png", classes.getvalue())
    told = run(tmp_path, str(ROOT / "examples" / "web_dataset.py"), ".")
    assert told.split("\n")[:2] == [
        "class  4:         4 pixels, mean nearness 0.50 1/m",
        "class  7:         8 pixels, mean nearness 3.00 1/m",
    ]
