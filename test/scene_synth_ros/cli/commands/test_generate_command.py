"""``scene_synth generate`` as a user has it: one folder, the same bytes however it came about, and a card."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from dataset_plans import HALLWAY, TINY, digests
from PIL import Image as Picture

from scene_synth_ros.cli.command_line import main
from scene_synth_ros.cli.commands import generate_command
from scene_synth_ros.shards.make_shard import make_shard
from scene_synth_ros.shards.plan import DatasetPlan
from scene_synth_ros.shards.store import LocalStore
from scene_synth_ros.workers.folder_lock import folder_lock

CHEAP = [word for own in (*TINY[:2], HALLWAY) for word in ("-p", own)]
WORDS = ["--rooms", "4", "--frames", "1", "--seed", "7", "--params", "ground_truth", *CHEAP]


def generate(*words: object) -> int:
    with pytest.raises(SystemExit) as end:
        main(["generate", *map(str, words)])
    return int(end.value.code or 0)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a dataset of four rooms, a shard each, made by one worker."""
    out = tmp_path_factory.mktemp("generate") / "one"
    assert generate(*WORDS, "--out", out, "--workers", 1) == 0
    return out


@pytest.mark.slow
def test_a_run_that_was_killed_goes_on_with_more_workers_to_the_same_bytes(dataset: Path, tmp_path: Path) -> None:
    out = tmp_path / "killed"
    run = subprocess.Popen([sys.executable, "-m", "scene_synth_ros", "generate", *WORDS, "--out", str(out)], stdout=subprocess.DEVNULL)
    try:
        end = time.monotonic() + 120.0
        while not list(out.glob("shards/*.json")) and run.poll() is None and time.monotonic() < end:
            time.sleep(0.02)
    finally:
        os.kill(run.pid, signal.SIGKILL)
    assert run.wait() == -signal.SIGKILL and not (out / "manifest.json").exists()
    done = {path.name: path.stat().st_mtime_ns for path in out.glob("shards/*.json")}
    assert done
    assert generate("--out", out, "--resume", "--workers", 2) == 0
    assert {name: (out / "shards" / name).stat().st_mtime_ns for name in done} == done, "what was complete is not made again"
    assert digests(out) == digests(dataset) and not list(out.glob("shards/.*"))


def test_the_card_tells_what_is_there(dataset: Path) -> None:
    text = (dataset / "README.md").read_text(encoding="utf-8")
    manifest = json.loads((dataset / "manifest.json").read_text(encoding="utf-8"))
    assert "4 rooms (4 hallway), 4 frames" in text and manifest["failed"] == [] and "## Rooms that could not be made" not in text
    lamps = sum(row["objects"]["ceiling_lamp"] for shard in manifest["shards"] for row in shard["rooms"])
    assert f"| ceiling lamp | {lamps} |" in text and "| 4 of 4 |" in text and "| median depth (m) |" in text
    with Picture.open(dataset / "card" / "rooms.jpg") as rooms, Picture.open(dataset / "card" / "layers.jpg") as layers:
        assert rooms.size == layers.size == (3 + 4 * (256 + 3), 3 + 192 + 15 + 3)


def test_a_plan_makes_its_dataset_again_elsewhere_but_not_in_another_version(
    dataset: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert generate("--plan", dataset / "dataset.json", "--out", dataset, "--resume") == 0, "it is the folder's own"
    other, plan = tmp_path / "plan.json", json.loads((dataset / "dataset.json").read_text())
    plan["provenance"][0]["versions"]["scene_synth_ros"] = "9.0"
    other.write_text(json.dumps(plan))
    assert generate("--plan", other, "--out", tmp_path / "d") == 2
    assert "scene_synth_ros 0.1.0 here, 9.0 there" in capsys.readouterr().err and not (tmp_path / "d").exists()


def test_a_damaged_shard_is_found_and_made_again(dataset: Path, capfd: pytest.CaptureFixture[str]) -> None:
    before = digests(dataset)
    file = dataset / "shards" / "00002" / "00002_0.mcap"
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 1
    file.write_bytes(data)
    assert generate("--out", dataset, "--resume", "--check") == 0
    assert "shards/00002/00002_0.mcap: expected SHA-256" in capfd.readouterr().out and digests(dataset) == before


def test_a_shard_that_was_damaged_since_ends_the_card_in_one_line_that_says_what_to_do(
    dataset: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cut = shutil.copytree(dataset, tmp_path / "cut")
    file = cut / "shards" / "00002" / "00002_0.mcap"
    size = file.stat().st_size
    os.truncate(file, 2000)
    os.truncate(file, size)
    assert generate("--out", cut, "--resume") == 2
    told = capsys.readouterr().err.splitlines()
    assert len(told) == 1 and "shards/00002: expected the description of room 2, got none" in told[0] and "--resume --check" in told[0]


SMALL_WORLD = """
mount -t tmpfs -o size=16k tmpfs /dev/shm && mount -t tmpfs -o size=160k tmpfs "$OUT" || exit 99
"$@"; echo "status $?"; ls -A "$OUT/shards"
mount -o remount,size=20m "$OUT" && "$@"; echo "status $?"
cp -r "$OUT" "$OUT-whole"
"""


@pytest.mark.slow
def test_a_full_disk_ends_the_run_in_one_line_and_room_heals_it_and_shared_memory_is_not_needed(dataset: Path, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    command = [sys.executable, "-m", "scene_synth_ros", "generate", *WORDS, "--out", str(tmp_path / "out"), "--workers", "2", "--resume"]
    words = ["unshare", "--map-root-user", "--mount", "sh", "-c", SMALL_WORLD, "sh", *command]
    run = subprocess.run(words, env={**os.environ, "OUT": str(tmp_path / "out")}, capture_output=True, text=True, check=False)
    if run.returncode == 99 or "unshare" in run.stderr:
        pytest.skip(f"a small disk cannot be mounted here: {run.stderr.strip()}")
    _, whole = run.stdout.split("status 2\n")
    errors = [line for line in run.stderr.splitlines() if line.startswith("scene_synth")]
    assert len(errors) == 1 and "no space left on device" in errors[0].lower() and "--resume goes on from here" in errors[0], errors
    assert "Traceback" not in run.stderr and ".partial" not in whole
    assert whole.endswith("status 0\n") and digests(tmp_path / "out-whole") == digests(dataset)


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (["--seed", "7"], "--seed: expected together with --rooms"),
        (["--rooms", "0"], "--rooms: expected 1 to"),
        (["--rooms", "2", "--check"], "--check: expected together with --resume"),
        (["--rooms", "2", "--shard-size", "big"], "--shard-size big: expected a number of bytes"),
        (["--rooms", "2", "--params", "nothing"], "nothing: expected a parameter file"),
        (["--rooms", "2", "-p", "grammar_node.scene.room_type:=castle"], "castle"),
        (["--rooms", "2", "--namespace", "/1a//"], "--namespace /1a//: expected a name that begins with /"),
        (["--rooms", "2", "--plan", "x"], "--rooms: expected this or --plan"),
        (["--plan", "nowhere.json"], "nowhere.json: no such file"),
        (["--resume"], "holds no dataset"),
    ],
)
def test_words_that_do_not_fit_end_in_one_line(words: list[str], error: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert generate("--out", tmp_path / "d", *words) == 2
    told = capsys.readouterr().err.splitlines()
    assert len(told) == 1 and told[0].startswith("scene_synth generate: ") and error in told[0]
    assert not list(tmp_path.glob("d/*"))


def test_ray_that_is_not_there_is_told_before_a_dataset_begins(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert generate("--rooms", 2, "--out", tmp_path / "d", "--ray", "127.0.0.1:9") == 2
    monkeypatch.setitem(sys.modules, "ray", None)
    assert generate("--rooms", 2, "--out", tmp_path / "d", "--ray") == 2
    told = capsys.readouterr()
    assert "cannot be reached" in told.err and "Ray is not installed" in told.err
    assert told.out == "" and not (tmp_path / "d").exists()


def test_another_plan_and_another_run_are_refused(
    dataset: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert generate(*WORDS, "--out", dataset) == 2
    assert generate(*WORDS, "-p", "renderer_node.streams.uv:=true", "--out", dataset, "--resume") == 2
    assert generate("--seed", 8, "--out", dataset, "--resume") == 2
    monkeypatch.setattr("scene_synth_ros.workers.folder_lock._PATIENCE_S", 0.0)
    with folder_lock(dataset):
        assert generate("--out", dataset, "--resume") == 2
    lines = capsys.readouterr().err.splitlines()
    errors = ["say --resume", "parameter renderer_node.streams.uv: True here", "--seed: expected together", "another run"]
    for line, error in zip(lines, errors, strict=True):
        assert error in line


def test_a_failed_room_is_told_and_the_command_ends_with_1(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def run_here(plan: DatasetPlan, store: LocalStore, shards: list[int], **_: object) -> None:
        for shard in shards:
            make_shard(plan, shard, store, given_up={0: "no layout | fits"})

    monkeypatch.setattr(generate_command, "run_shards", run_here)
    assert generate("--rooms", 1, *WORDS[2:], "--out", tmp_path / "d") == 1
    assert "failed after 3 attempts: room 0: no layout | fits" in capfd.readouterr().out
    assert json.loads((tmp_path / "d" / "manifest.json").read_text())["failed"] == [
        {"index": 0, "attempts": 3, "error": "no layout | fits"}
    ]
    assert "| 0 | 3 | no layout \\| fits |" in (tmp_path / "d" / "README.md").read_text(encoding="utf-8")
