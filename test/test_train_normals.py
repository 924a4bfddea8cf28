"""The example that trains networks: its rooms, its files, its judgement, and a short training where JAX is installed."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from examples.train_normals import pictures
from examples.train_normals.pictures import Views, keep_room, read_views
from examples.train_normals.rooms import sample_rooms, with_one_look
from examples.train_normals.study import difference, judge, mean_normal
from renderer import CameraConfig

UP, AHEAD = (0.0, -1.0, 0.0), (0.0, 0.0, -1.0)


def views(normal: tuple[float, float, float], gray: int = 100) -> Views:
    """Return two views of 32 x 32 pixels of one normal."""
    color = np.full((2, 32, 32, 3), gray, np.uint8)
    return Views(color, color + np.uint8(10), np.broadcast_to(np.float16(normal), (2, 32, 32, 3)))


def test_one_look_changes_light_and_materials_alone_and_files_are_read_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pictures, "CAMERA", CameraConfig(width=24, height=16))
    rooms = sample_rooms(("bedroom", "hallway"), 3, 5)
    assert rooms[:2] == sample_rooms(("bedroom", "hallway"), 2, 5) and [room.category for room in rooms] == [
        "bedroom",
        "hallway",
        "bedroom",
    ]
    alike = with_one_look(rooms)
    floors = [
        next(replace(material, id="floor") for material in room.materials if material.id == part.material)
        for room in alike
        for part in room.room.surfaces
        if part.name == "floor"
    ]
    assert floors[0] == floors[1] == floors[2]
    assert {(light.on, light.flux_lm, light.color_temperature_k) for room in alike for light in room.lights} == {(True, 2000.0, 4000.0)}
    own, same = (keep_room(room, tmp_path) for room in (rooms[1], alike[1]))
    monkeypatch.setattr(pictures, "render_room", None)
    assert keep_room(rooms[1], tmp_path) == own != same
    first, second = read_views(own), read_views(same)
    assert first.normals.tobytes() == second.normals.tobytes() and first.normals.shape == (4, 16, 24, 3)
    assert (first.color != second.color).mean() > 0.5 and (first.color != first.noisy).mean() > 0.5


def test_the_constant_is_the_mean_normal_and_gains_are_differences_of_rooms() -> None:
    constant = mean_normal([views(UP), views(AHEAD)])
    halfway = judge("constant", 0, "color", constant, [views(UP), views(AHEAD)], 1)
    assert halfway.metrics["mean"].value == pytest.approx(45.0) and halfway.metrics["within_30"].value == 0.0
    right = judge("up", 1, "noisy", mean_normal([views(UP)]), [views(UP), views(UP)], 1)
    gain = difference(right, halfway, "mean", 1)
    assert (gain.value, gain.low, gain.high) == pytest.approx((-45.0, -45.0, -45.0))


def test_training_learns_two_pictures_and_repeats_itself() -> None:
    pytest.importorskip("optax")
    from examples.train_normals.training import gather_examples, predict, train

    rooms = [views(UP, 20), views(AHEAD, 220)]
    examples = gather_examples(rooms, ("color", "noisy"))
    assert examples.pictures.shape == (2, 4, 32, 32, 3) and examples.pictures[1, 0, 0, 0, 0] == 30
    parameters = train(examples, steps=40, seed=1)
    learned = judge("both", 2, "color", lambda images: predict(parameters, images), rooms, 1)
    assert learned.metrics["mean"].value < 10.0
    again, other = train(examples, steps=40, seed=1), train(examples, steps=40, seed=2)
    assert np.array_equal(parameters["last"], again["last"]) and not np.array_equal(parameters["last"], other["last"])
