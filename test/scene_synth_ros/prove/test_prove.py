"""A true bag is proved; every kind of planted fault is named by the check that it is for."""

import argparse
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from body_bag import write_bag
from planted_faults import KINDS, Recorded, colors_of_another, named, read

from scene_synth_ros.cli.commands import prove_command
from scene_synth_ros.dataset.camera import Camera
from scene_synth_ros.prove.lens import directions, pixels
from scene_synth_ros.prove.prove import CHECKS, Proof, by_check, lines_of, proof_to_json, prove_bag, prove_messages
from scene_synth_ros.prove.verdict import at_most, share_off

WORDS = (
    "camera.width:=160", "camera.height:=120", "camera.horizontal_fov_rad:=1.2", "body.enabled:=true", "body.rate_hz:=100.0",
    "imu.enabled:=true", "imu.mount_m:=[0.1,0.0,0.2]", "wheels.enabled:=true", "wheels.rate_hz:=30.0", "streams.flow:=true",
    "scan.enabled:=true", "scan.rate_hz:=7.0", "lidar.enabled:=true", "lidar.columns:=300", "lidar.rate_hz:=8.0",
    "lidar.mount_rotation_rad:=[0.02,0.1,0.3]", "render.samples_per_pixel:=1", "render.integrator:=cached",
    "render.cache_spacing_m:=0.1", "render.cache_rays:=16", "render.cache_light_samples:=16",
)  # fmt: skip


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_bag(tmp_path_factory.mktemp("prove") / "bag", *WORDS)


@pytest.fixture(scope="module")
def recorded(bag: Path) -> Recorded:
    return read(bag)


def test_a_true_bag_is_proved_by_every_check(bag: Path) -> None:
    proof = prove_bag(bag)
    assert proof.good, list(lines_of(proof))
    assert by_check(proof.verdicts).keys() == CHECKS.keys() | {"digests", "ids", "normals"}
    document = json.loads(proof_to_json(proof))
    assert document["schema"] == "scene_synth/proof/1" and document["good"] is True and len(document["verdicts"]) == len(proof.verdicts)


@pytest.mark.parametrize("kind", KINDS)
def test_a_planted_fault_is_named(recorded: Recorded, kind: str) -> None:
    plant, check = KINDS[kind]
    assert check in named(plant(recorded, np.random.default_rng(3)))


@pytest.mark.parametrize("by", [-1, 1])
def test_colors_of_the_next_frame_or_the_one_before_are_named_with_room_to_spare(recorded: Recorded, by: int) -> None:
    (found,) = (verdict for verdict in prove_messages(colors_of_another(recorded, by)).verdicts if verdict.check == "color")
    assert found.worst > 1.2 > found.limit


def test_the_shards_of_a_dataset_are_proved_one_after_the_other(
    bag: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (source,) = bag.glob("*.mcap")
    changed = tmp_path / source.name
    changed.write_bytes(source.read_bytes().replace(b"renderer_node/settings", b"renderer_nodf/settings", 1))
    monkeypatch.setattr(prove_command, "shard_bags", lambda path, report: [bag, changed])
    assert prove_command.run(argparse.Namespace(bag=tmp_path, catalog=None, json=False)) == 1
    out = capsys.readouterr().out
    assert f"{bag}: all that was checked is true\n" in out and f"{changed}: " in out.splitlines()[-1] and " faults" in out.splitlines()[-1]


def test_the_command_tells_a_changed_file_and_fails(bag: Path, tmp_path: Path) -> None:
    def prove(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-m", "scene_synth_ros", "prove", str(folder), *words], capture_output=True, text=True, check=False
        )

    good = prove(bag)
    assert good.returncode == 0 and "all that was checked is true" in good.stdout
    other = tmp_path / "bag"
    other.mkdir()
    for file in bag.iterdir():
        (other / file.name).write_bytes(file.read_bytes())
    file = next(other.glob("*.mcap"))
    content = file.read_bytes()
    place = content.index(b"renderer_node/settings")
    file.write_bytes(content[:place] + b"renderer_nodf" + content[place + 13 :])
    bad = prove(other, "--json")
    assert bad.returncode == 1 and json.loads(bad.stdout)["good"] is False
    nothing = prove(tmp_path / "nothing")
    assert nothing.returncode == 2 and len(nothing.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    ("model", "coefficients"),
    [
        ("plumb_bob", ()),
        ("plumb_bob", (-0.12, 0.03, 0.002, -0.0015, 0.004)),
        ("rational_polynomial", (0.1, -0.02, 0.001, 0.0005, 0.001, 0.2, 0.01, 0.002)),
        ("equidistant", (0.02, -0.004, 0.001, -0.0002)),
    ],
)
def test_pixels_and_directions_are_inverse(model: str, coefficients: tuple[float, ...]) -> None:
    matrix = np.array([[70.0, 0, 41.3], [0, 72.0, 28.2], [0, 0, 1]])
    named = {"name": "c", "frame_id": "f", "width": 80, "height": 60, "R": np.eye(3), "P": np.zeros((3, 4))}
    camera = Camera(K=matrix, model=model, D=np.array(coefficients), **named)
    spots = np.random.default_rng(1).uniform((0, 0), (79, 59), (200, 2))
    rays = directions(camera, spots)
    np.testing.assert_allclose(np.linalg.norm(rays, axis=1), 1.0)
    np.testing.assert_allclose(pixels(camera, 3.7 * rays), spots, atol=1e-6)


def test_a_proof_of_nothing_is_none() -> None:
    assert not Proof(()).good
    assert at_most("a", "/b", "c", [], 1.0).good and not at_most("a", "/b", "c", [np.nan], 1.0).good
    worst = at_most("a", "/b", "c", [0.1, 0.3, 0.2], 0.25, "m", [7, 8, 9])
    assert (worst.good, worst.worst, worst.stamp_ns) == (False, 0.3, 8)
    stamps = np.repeat([5, 6], 50)
    assert [verdict.good for verdict in share_off("a", "/b", "c", np.arange(100) == 3, stamps)] == [True]
    of_frame = list(share_off("a", "/b", "c", (np.arange(100) % 4 == 0) & (stamps == 6), stamps))
    assert [verdict.stamp_ns for verdict in of_frame] == [-1, 6] and not any(verdict.good for verdict in of_frame)


@pytest.mark.parametrize("end", ["/scene", "settings", "robot_description", "lidar/points_ideal", "imu/data", "depth/image_raw"])
def test_messages_that_are_not_what_they_should_be_are_told(recorded: Recorded, end: str) -> None:
    topic = recorded.topic(end)
    broken = [(log_ns, data[: len(data) // 2] + bytes(len(data) - len(data) // 2)) for log_ns, data in recorded.rows[topic]]
    assert named(recorded.with_rows(end, broken))
