"""A tiny sweep end to end: what stays, what changes, what is told, and that neither interruption nor workers change a byte."""

import hashlib
import json
import os
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image as Picture
from rclpy.serialization import deserialize_message
from sample_scene import sample_scene
from sensor_msgs.msg import Image
from std_msgs.msg import String

from grammar.synthesize import SceneSynthesizer
from renderer.irradiance_cache.cache import IrradianceCache
from renderer.scene.flatten import flatten
from scene_description import scene_from_json, scene_to_json
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.cli.command_line import main
from scene_synth_ros.cli.commands.sweep_command import read_plan
from scene_synth_ros.messages.conversions import msg_to_image
from scene_synth_ros.messages.frame_settings import FrameSettings, settings_from_json
from scene_synth_ros.render import room as room_module
from scene_synth_ros.sweep import run_sweep
from scene_synth_ros.sweep.plan import daylight_note
from scene_synth_ros.sweep.sweep_file import read_sweep
from scene_synth_ros.sweep.variant import RECORD_NAME
from scene_synth_ros.verify.bag_verify import verify_bag

SWEEP = """
base: {scenes: [room.json]}
run:
  frames: 2
  parameters: {camera.width: 32, camera.height: 24, render.samples_per_pixel: 1, render.threads: 1}
design: one_at_a_time
factors:
  light_intensity: {values: [1, 4]}
  camera.width: {range: [20, 33], steps: 2}
  object_moved: {target: {category: bed}, values: [[9.0, 0.0, 0.0]]}
"""
WHOLE = ["0000", "0001", "0002", "0003"]


@pytest.fixture(scope="module")
def sweep(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the sweep's file, and its variants in ``out``; the last one cannot be."""
    folder = tmp_path_factory.mktemp("sweep")
    (folder / "room.json").write_text(scene_to_json(sample_scene()), encoding="utf-8")
    (folder / "sweep.yaml").write_text(SWEEP, encoding="utf-8")
    assert run(folder, folder / "out", "--contact-sheet", str(folder / "sheet.png")) == 1
    return folder


def run(sweep: Path, out: Path, *words: str) -> int:
    with pytest.raises(SystemExit) as end:
        main(["sweep", str(sweep / "sweep.yaml"), "--out", str(out), *words])
    return int(end.value.code or 0)


def digests(out: Path) -> dict[str, str]:
    return {str(file.relative_to(out)): hashlib.sha256(file.read_bytes()).hexdigest() for file in out.glob("variants/*/*")}


def images(bag: Path, layer: str) -> Iterator[np.ndarray]:
    with BagReader(bag) as reader:
        for message in reader.messages([f"/synth/camera/{layer}/image_raw"]):
            yield msg_to_image(deserialize_message(message.data, Image))


def settings(bag: Path) -> list[FrameSettings]:
    with BagReader(bag) as reader:
        texts = [deserialize_message(message.data, String).data for message in reader.messages(["/synth/renderer_node/settings"])]
    return [settings_from_json(text) for text in texts]


def test_the_plan_begins_with_the_base_and_leaves_out_what_is_the_base_again(sweep: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plan = read_plan(sweep / "sweep.yaml")
    assert [(variant.id, variant.changed) for variant in plan.variants] == [
        ("0000", ()),
        ("0001", ("light_intensity",)),
        ("0002", ("camera.width",)),
        ("0003", ("camera.width",)),
        ("0004", ("object_moved",)),
    ]
    assert [variant.factors["camera.width"] for variant in plan.variants] == [32, 32, 20, 33, 32]
    assert run(sweep, sweep / "none", "--plan") == 0
    assert "20*" in capsys.readouterr().out and not (sweep / "none").exists()


def test_the_document_lists_what_was_made_and_why_the_rest_was_not(sweep: Path) -> None:
    document = json.loads((sweep / "out" / "sweep.json").read_text(encoding="utf-8"))
    assert document["schema"] == "scene_synth_sweep/1" and document["spec"]["design"] == "one_at_a_time"
    lamps, width, _ = document["factors"]
    assert (lamps["label"], lamps["base"], lamps["values"]) == ("lamp intensity", 1.0, [1, 4])
    assert (width["unit"], width["base"], width["values"]) == ("px", 32, [20, 33])
    assert [variant["id"] for variant in document["variants"]] == WHOLE and document["missing"] == []
    one = document["variants"][1]
    assert one["changed"] == ["light_intensity"] and one["factors"] == {
        "light_intensity": 4,
        "camera.width": 32,
        "object_moved": [0.0, 0.0, 0.0],
    }
    assert one["base"] == {"room_type": "bedroom", "seed": sample_scene().seed, "index": sample_scene().index, "file": "room.json"}
    assert one["command"] == f"scene_synth sweep {sweep}/sweep.yaml --only 0001 --out sweep_0001"
    (refused,) = document["refused"]
    assert refused["id"] == "0004" and "object_moved of category bed" in refused["reason"]
    with BagReader(sweep / "out" / one["bag"]) as reader:
        record = reader.summary.records[RECORD_NAME]
    assert record["id"] == "0001" and record["command"] == "scene_synth sweep sweep.yaml --only 0001 --out sweep_0001"
    assert [json.loads(record[key]) for key in ("base", "factors", "changed")] == [one[key] for key in ("base", "factors", "changed")]


def test_the_sheet_has_a_picture_of_each_variant(sweep: Path) -> None:
    """Four columns of 32 pixels with gaps of 3, and one row of 24 pixels with a line of text below."""
    with Picture.open(sweep / "sheet.png") as sheet:
        assert sheet.size == (3 + 4 * 35, 3 + 24 + 15 + 3)
        assert np.asarray(sheet)[3:27, 3:35].std() > 5.0


def test_what_the_change_does_not_touch_is_the_same_to_the_bit_at_the_same_exposure(sweep: Path) -> None:
    base, lit = (sweep / "out" / "variants" / name for name in ("0000", "0001"))
    for layer in ("depth", "normals", "semantic", "instance"):
        assert all(np.array_equal(a, b, equal_nan=layer == "depth") for a, b in zip(images(base, layer), images(lit, layer), strict=True))
    before, after = (float(np.mean([image.mean() for image in images(bag, "color")])) for bag in (base, lit))
    assert after > 1.05 * before, "the exposure is held, so more light is brighter"
    keys = [[(frame.stamp_ns, frame.frame, frame.scene, frame.exposure) for frame in settings(bag)] for bag in (base, lit)]
    assert keys[0] == keys[1] and len(keys[0]) == 2
    assert verify_bag(lit).good


def test_the_base_is_a_room_that_others_are_compared_with(sweep: Path) -> None:
    """Its description and its geometry are those of the variants: where surfaces touch, the same one of them is met in every bag."""
    scenes = []
    for name in WHOLE:
        with BagReader(sweep / "out" / "variants" / name) as reader:
            (message,) = reader.messages(["/synth/scene"])
        scenes.append(json.loads(deserialize_message(message.data, String).data))
    assert [len(scene.pop("counterfactuals")) for scene in scenes] == [0, 1, 0, 0]
    assert flatten(scene_from_json(json.dumps(scenes[0] | {"counterfactuals": []}))).steady
    base, lit = messages(sweep, "0000"), messages(sweep, "0001")
    changed = {topic for topic in base if base[topic] != lit[topic]}
    assert len(base) > 15 and changed == {"/synth/scene", "/synth/camera/color/image_raw"}


def messages(sweep: Path, name: str) -> dict[str, list[bytes]]:
    """Return topic -> its messages in the bag of a variant."""
    found: dict[str, list[bytes]] = {}
    with BagReader(sweep / "out" / "variants" / name) as reader:
        for message in reader.messages():
            found.setdefault(message.topic, []).append(bytes(message.data))
    return found


def test_a_sun_is_asked_for_before_rooms_are_sampled(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = "base: {room_types: [bedroom], grammar: {daylight: night}}\nfactors:\n  sun_elevation_deg: {values: [30]}\n"
    (tmp_path / "sweep.yaml").write_text(text, encoding="utf-8")
    assert run(tmp_path, tmp_path / "out") == 2
    told = capsys.readouterr()
    assert "expected rooms with a sun, got daylight night; base.grammar.daylight: overcast or clear has one" in told.err
    assert told.out == "sampling 1 base room (the first run compiles kernels)\n"
    rules = SceneSynthesizer.from_config()
    spec = read_sweep(tmp_path / "sweep.yaml")
    drawn = replace(spec, grammar={})
    assert daylight_note(drawn, "s", rules).startswith("factors.sun_elevation_deg needs a sun; the variants of rooms")
    assert daylight_note(replace(spec, grammar={"daylight": "clear"}), "s", rules) == ""


def test_a_second_run_makes_only_what_is_missing_damaged_or_of_another_plan(
    sweep: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(sweep, tmp_path / "s")
    out = tmp_path / "s" / "out"
    whole, made = digests(out), []
    shutil.rmtree(out / "variants" / "0001")
    (out / "variants" / f".0001.{os.uname().nodename}.{2**22 + 1}.partial" / "0001").mkdir(parents=True)  # of a process that is gone
    file = out / "variants" / "0002" / "0002_0.mcap"
    file.write_bytes(file.read_bytes()[:-2000])
    write = run_sweep.OfflineBag.close
    monkeypatch.setattr(run_sweep.OfflineBag, "close", lambda bag: (made.append(bag._directory.name), write(bag))[1])
    assert run(tmp_path / "s", out, "--only", "0000", "0001", "0002", "0003") == 0
    assert made == ["0001", "0002"] and not list(out.glob("variants/.*"))
    assert digests(out) == whole
    (tmp_path / "s" / "sweep.yaml").write_text(SWEEP.replace("values: [1, 4]", "values: [1, 2]"), encoding="utf-8")
    assert run(tmp_path / "s", out, "--only", "0000", "0001") == 0
    assert made == ["0001", "0002", "0001"]


def test_workers_change_no_byte(sweep: Path, tmp_path: Path) -> None:
    assert run(sweep, tmp_path / "out", "--workers", "2", "--only", "0001", "0004") == 1
    whole, made = digests(sweep / "out"), digests(tmp_path / "out")
    assert made.keys() == {"variants/0001/0001_0.mcap", "variants/0001/metadata.yaml"} and made.items() <= whole.items()


def test_the_variants_of_a_room_come_to_one_worker_unless_there_are_few_rooms(sweep: Path) -> None:
    variants = read_plan(sweep / "sweep.yaml").variants
    assert [len(task) for task in run_sweep.tasks_of(variants, 1)] == [3, 2]
    base = variants[0].base._replace(file="other.json")
    other = [replace(variant, base=base) for variant in variants]
    tasks = list(run_sweep.tasks_of([*variants, *other] * 2, 2))
    assert [len(task) for task in tasks] == [5, 5, 5, 5] and all(len({id(v.base) for v in task}) == 1 for task in tasks)


def test_a_factor_of_the_sensor_makes_neither_geometry_nor_light_anew(sweep: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = {"flatten": 0, "solve": 0}
    flatten_room, solve = room_module.flatten, IrradianceCache.solve

    def counted(name: str, is_new: bool) -> None:
        calls[name] += is_new

    monkeypatch.setattr(room_module, "flatten", lambda *of: (counted("flatten", True), flatten_room(*of))[1])
    of_solve = lambda cache, *of: (counted("solve", cache._coarse_light is not None), solve(cache, *of))[1]  # noqa: E731
    monkeypatch.setattr(IrradianceCache, "solve", of_solve)
    text = "base: {scenes: [room.json]}\nrun: {overlays: [realtime, stereo], frames: 1, parameters: {camera.width: 32}}\n"
    (tmp_path / "sweep.yaml").write_text(text + "factors: {sensor.read_noise_e: {values: [0.0, 3.0, 9.0]}}\n", encoding="utf-8")
    shutil.copy(sweep / "room.json", tmp_path)
    assert run(tmp_path, tmp_path / "out") == 0
    assert calls == {"flatten": 1, "solve": 1}
    assert run(tmp_path, tmp_path / "alone", "--only", "0002") == 0
    assert digests(tmp_path / "alone").items() <= digests(tmp_path / "out").items()


def test_folders_of_others_are_left_alone(sweep: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "letter.txt").write_text("dear")
    assert run(sweep, tmp_path) == 2
    assert "expected a new folder or one of a sweep" in capsys.readouterr().err
    assert run(sweep, tmp_path / "new", "--only", "0009") == 2
    assert "--only 0009: expected ids of this sweep, 0000 to 0004" in capsys.readouterr().err
