"""The example that learns classes of pixels: its means, what it learns of colours, and its way through a dataset and its splits."""

from pathlib import Path

import numpy as np
import pytest
from dataset_bags import write_dataset

from examples import segment_pixels
from examples.segment_pixels import CLASSES, box_mean, features, judge, train
from scene_synth_ros.cli.command_line import main


def test_means_are_those_of_squares_cut_off_at_the_border() -> None:
    image = np.random.default_rng(0).random((7, 9, 2))
    expected = [[image[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2].mean(axis=(0, 1)) for x in range(9)] for y in range(7)]
    np.testing.assert_allclose(box_mean(image, 3), expected)


def frame(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return features and classes of a red floor, a rare green thing on it, and a sky that nobody has named."""
    rng = np.random.default_rng(seed)
    classes = np.full((24, 32), 2)
    classes[:6], classes[12:15, 10:14] = 0, 7
    tones = np.zeros((CLASSES, 3))
    tones[2], tones[7] = (200, 30, 30), (30, 200, 30)
    color = (tones[classes] + rng.normal(0.0, 10.0, (24, 32, 3))).clip(0, 255).astype(np.uint8)
    return features({"color": color, "depth": np.where(classes, 2.0, np.inf).astype(np.float32)}), classes


def test_classes_of_other_frames_are_known_by_their_colours(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(segment_pixels, "STEPS", 150)
    network = train([frame(0), frame(1)], np.ones(2), np.r_[0.0, np.ones(CLASSES - 1)])
    scores = judge(network, [frame(2)])
    assert scores["miou"] > 0.95 and scores["pixel_accuracy"] > 0.98


def test_a_dataset_is_learned_by_its_splits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(segment_pixels, "STEPS", 2)
    write_dataset(tmp_path / "rooms", shards=2, rooms=3, layers=("color", "depth", "semantic"), size=(24, 32))
    with pytest.raises(SystemExit) as end:
        main(["split", str(tmp_path / "rooms"), "--shares", "train=0.5,val=0.5", "--balance"])
    assert not end.value.code
    capsys.readouterr()
    segment_pixels.main(tmp_path / "rooms")
    first, second = capsys.readouterr().out.splitlines()
    assert first.startswith("as they are: pixel_accuracy 0.") and second.startswith("balanced: ") and "miou" in second
