"""The table of readers of files from others; another one is another row of :data:`READERS`.

A row has valid samples that the program itself makes and the call that reads them, which may raise a ``SceneSynthError`` of one line.
"""

from __future__ import annotations

import base64
import io
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import evaluation_files
import numpy as np
import small_grammar
import trimesh
from fuzz.bag_readers import BAG_READERS, annotations, as_record
from fuzz.cases import Kind, Reader
from glb_files import pack_glb, triangle_tree
from PIL import Image
from sample_scene import sample_scene

from evaluation.evaluation_file import read_evaluation
from grammar.appearance.looks import read_looks
from grammar.catalog import read_catalog
from grammar.learning import ObservedObject, ObservedOpening, ObservedRoom, layout_line, read_category_map, read_layouts
from grammar.spec.grammar_file import read_grammar
from renderer import CameraConfig, RenderConfig
from renderer.files.image_io import decode_image, encode_image
from renderer.files.mesh_files import read_mesh_file
from renderer.lidar.config import ScanConfig
from renderer.scene.environment_map import read_rgbe
from scene_description import FileReading, read_scene, scene_to_json
from scene_description.annotations import annotations_from_json
from scene_description.share import config_path
from scene_description.tum_trajectory import trajectory_from_tum, trajectory_to_tum
from scene_synth_ros.bags.bag_manifest import ManifestBuilder, read_manifest
from scene_synth_ros.bags.bag_metadata import BagMetadata, FileInfo, TopicInfo, metadata_file, read_metadata
from scene_synth_ros.bags.dataset_files import (
    DATASET_MANIFEST_NAME,
    DATASET_MANIFEST_SCHEMA,
    PLAN_NAME,
    PLAN_SCHEMA,
    SHARD_SCHEMA,
    SHARDS_NAME,
    SPLITS_NAME,
    SPLITS_SCHEMA,
)
from scene_synth_ros.bags.qos_metadata import OfferedQos, qos_text, read_qos
from scene_synth_ros.bags.run_info import read_parameters
from scene_synth_ros.cli.commands.sample_command import parse_constraints
from scene_synth_ros.cli.parameters.run_profile import apply_overrides, load_profile
from scene_synth_ros.dataset.folders import open_folder
from scene_synth_ros.dataset.places import find_bags, read_split
from scene_synth_ros.dataset.rooms import RoomInfo
from scene_synth_ros.evaluate.truth_facts import run_facts
from scene_synth_ros.messages.frame_settings import FrameSettings, StreamConfig, settings_from_json, settings_to_json
from scene_synth_ros.report.sweep_file import read_sweep as read_sweep_report
from scene_synth_ros.shards.completion import read_completion, sealed
from scene_synth_ros.shards.open_store import open_store
from scene_synth_ros.shards.plan import read_plan
from scene_synth_ros.suite.status import NodeStatus, status_from_json, status_to_json
from scene_synth_ros.sweep.sweep_file import read_sweep
from scene_synth_ros.sweep.sweep_json import read_sweep_json

ROOM = ObservedRoom(
    id="flat1-bedroom",
    house="flat1",
    room_type="bedroom",
    polygon_m=((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)),
    height_m=2.5,
    objects=(
        ObservedObject(category="desk", size_m=(0.7, 1.4, 0.75), position_m=(0.4, 1.0, 0.0), yaw_rad=0.125),
        ObservedObject(category="laptop", size_m=(0.25, 0.35, 0.2), position_m=(0.4, 1.0, 0.75), yaw_rad=-1.0, on=0),
    ),
    openings={"door": (ObservedOpening(wall=0, offset_m=1.0, width_m=0.9, height_m=2.0, sill_m=0.0),)},
)
FOREIGN_ROOM = {
    "id": "house1-0-Bedroom", "room_type": "bedroom", "polygon": [[0, 0], [4, 0], [4, 3], [0, 3]], "height": 2.5,
    "objects": [
        {"cat": "bed", "raw": "Bed", "pos": [1.0, 1.1, 0.5], "size": [1.4, 2.0, 1.0], "yaw": 3.1},
        {"cat": "shelf", "pos": [2.0, 0.2, 0.9], "size": [0.8, 0.3, 1.8], "yaw": None, "on": 1},
    ],
    "doors": [["door", 1.0, -0.05, 0.0, 1.9, 0.05, 2.0]],
}  # fmt: skip
GRAMMAR = """
extends: base.yaml
room_type: closet
root: closet
room: {width_m: {mean: 3, sd: 1, low: 2, high: 4}, depth_m: {mean: 3, sd: 1, low: 2, high: 4}, area_low_m2: 4, area_high_m2: 20}
nodes:
  closet: {kind: and, branches: [{symbol: rest}, {symbol: shelf}]}
  rest: {kind: or, branches: [{symbol: bed, probability: 0.25}, {symbol: bins, probability: 0.75}]}
  bins: {kind: set, branches: [{symbol: bin, multiplicity: [0.1, 0.9]}]}
objects:
  bed: {category: bed, sizes: [{mean_m: [2, 1, 1], sd_m: [0.1, 0.1, 0.1]}], low_m: [1.8, 0.8, 0.9], high_m: [2.2, 1.2, 1.1]}
  bin: {category: waste_bin, sizes: [{mean_m: [0.3, 0.3, 0.4], sd_m: [0.1, 0.1, 0.1]}], low_m: [0.2, 0.2, 0.3], high_m: [0.4, 0.4, 0.5]}
  shelf: {category: bookshelf, sizes: [{mean_m: [0.3, 1, 2], sd_m: [0.1, 0.1, 0.1]}], low_m: [0.2, 0.8, 1.5], high_m: [0.4, 1.2, 2.2]}
"""
LOOKS = ("bed/frame: walnut", "room/wall: {lightness: [0.4, 0.6], chroma: 0.1, hue_deg: [20, 80]}", "'*': {roughness: [0.5, 0.6]}")
CATALOG = """
models:
- {file: chairs/eames.glb, category: desk_chair, unit_m: 0.01, odds: 3, rename: {a*: b}, surfaces: [{height_m: 0.4, inset_m: 0.02}]}
"""


def in_file(name: str, read: Callable[[Path], object]) -> Callable[[bytes, Path], object]:
    """Return a call that puts a case into a file of that name, which is read then."""

    def read_file(data: bytes, folder: Path) -> object:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
        return read(path)

    return read_file


def as_text(read: Callable[[str], object]) -> Callable[[bytes, Path], object]:
    """Return a call that reads a case as the text of a parameter or a message, which has no bytes that are none."""
    return lambda data, folder: read(data.decode("utf-8", "replace"))


def shipped(*names: str) -> list[bytes]:
    return [config_path(name).read_bytes() for name in names]


def encoded(*documents: Mapping[str, Any]) -> list[bytes]:
    return [json.dumps(document).encode() for document in documents]


def bag_metadata() -> list[bytes]:
    topic = TopicInfo(name="/synth/t", type_name="std_msgs/msg/String", qos=(OfferedQos(),), message_count=3)
    topics = (topic, replace(topic, name="/synth/u"))
    files = tuple(FileInfo(name=f"bag_{k}.mcap", start_ns=k, duration_ns=5, message_count=1) for k in range(2))
    metadata = BagMetadata(version=9, topics=topics, files=files, custom_data={"note": "a: b"})
    return [metadata_file(metadata).encode(), metadata_file(replace(metadata, version=5)).encode()]


def settings() -> list[bytes]:
    plain = FrameSettings(
        stamp_ns=7, scene="s", frame=0, exposure_ev100=3.0, camera=CameraConfig(), render=RenderConfig(), streams=StreamConfig()
    )
    return [settings_to_json(plain).encode(), settings_to_json(replace(plain, scan=ScanConfig(enabled=True), sent={"scan": 5})).encode()]


def manifests() -> list[bytes]:
    builder = ManifestBuilder()
    builder.add("/synth/camera/pose", 5, b"abc")
    return [builder.to_json()]


COMPLETION = {
    "schema": SHARD_SCHEMA, "shard": 0, "first_room": 0,
    "rooms": [{"index": 0, "seed": 7, "room_type": "bedroom", "scene_id": "ab", "frames": 2, "start_ns": 0}],
    "failed": [], "files": [{"name": "00000/00000_0.mcap", "bytes": 5, "sha256": "00"}], "layers": {"/synth/t": "00"}, "messages": 3,
}  # fmt: skip
PLAN = {
    "schema": PLAN_SCHEMA, "rooms": 2, "frames": 2, "seed": 1, "rooms_per_shard": 1, "shard_bytes": 2**30, "shards": 2,
    "namespace": "/synth", "parameters": {"grammar_node": {}, "renderer_node": {}, "recorder_node": {}}, "extended_from": [1],
    "provenance": [{"program": {"grammar": "0f"}, "configuration": {}, "versions": {"numba": "1.0"}, "processor": {"features": "x"}}],
}  # fmt: skip
TRAIN = [{"room": 0, "scene": "ab", "copy": 0, "frames": [0, 1]}, {"room": 1, "frames": None}]
SPLITS = {"schema": SPLITS_SCHEMA, "splits": {"train": TRAIN}}
BALANCED = {"classes": {"train": {"bed": {"frames": 2, "objects": 3}}}, "splits": {"train": [{**TRAIN[0], "weights": [0.5, 1.5]}]}}
SWEEP_JSON = {
    "schema": "scene_synth_sweep/1", "spec": {"design": "grid"},
    "factors": [{"name": "light", "label": "Light", "unit": "lx", "attribute": "", "base": 1.0, "values": [1.0, 2.0]}],
    "variants": [
        {"id": "0000", "bag": "variants/0000", "base": {"room_type": "bedroom", "seed": 1, "index": 0, "file": ""},
         "factors": {"light": 2.0}, "changed": ["light"], "command": "scene_synth sweep s.yaml --only 0000"},
    ],
}  # fmt: skip


def dataset(name: str) -> Callable[[bytes, Path], object]:
    """Return a call that reads a case as a file of a dataset."""

    def read(path: Path) -> object:
        return find_bags(open_folder(path.parents[name.count("/")]), lambda line: None)

    return in_file(f"dataset_{Path(name).stem}/{name}", read)


def read_splits(path: Path) -> object:
    room = RoomInfo(index=0, seed=1, room_type="bedroom", scene_id="ab", frames=2)
    return read_split(open_folder(path.parent), "train", (room, replace(room, index=1)))


def read_shard(data: bytes, folder: Path) -> object:
    """Read a completion file whose seal fits what became of it, where it is still a mapping."""
    (folder / SHARDS_NAME).mkdir(exist_ok=True)
    try:
        data = json.dumps(sealed(json.loads(data))).encode()
    except (ValueError, TypeError, RecursionError):
        pass
    (folder / SHARDS_NAME / "00000.json").write_bytes(data)
    return read_completion(open_store(str(folder)), read_plan(encoded(PLAN)[0], PLAN_NAME), 0)


def evaluations() -> list[bytes]:
    frames = [evaluation_files.frame("0000", 0, {"light": 1.0}, {"abs_rel": 0.5, "delta_1": None})]
    truth = {"image_width": 64, "camera_model": "plumb_bob", "intrinsics": [60.0, 60.0, 32.0, 24.0], "distortion": [0.1], "seed": 7}
    return encoded(evaluation_files.document(frames), evaluation_files.document(frames, truth=truth))


def with_picture(tree: dict[str, Any], binary: bytearray) -> tuple[dict[str, Any], bytes]:
    picture = encode_image(np.full((4, 4, 3), 90, np.uint8), "png")
    tree["bufferViews"].append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(picture)})
    tree["images"], tree["textures"] = [{"bufferView": len(tree["bufferViews"]) - 1}], [{"source": 0}]
    tree["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {"index": 0}
    tree["buffers"][0]["byteLength"] = len(binary) + len(picture)
    return tree, bytes(binary) + picture


def glb_files() -> list[bytes]:
    tree, binary = triangle_tree()
    scene = trimesh.Scene(trimesh.creation.box((0.5, 0.1, 0.4)))
    return [pack_glb(tree, bytes(binary)), pack_glb(*with_picture(*triangle_tree())), scene.export(file_type="glb")]


def gltf_files() -> list[bytes]:
    tree, binary = triangle_tree()
    tree["buffers"][0]["uri"] = f"data:application/octet-stream;base64,{base64.b64encode(binary).decode()}"
    return encoded(tree)


def glb_tree(data: bytes) -> Any:
    return json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])


def glb_with_tree(data: bytes, text: bytes) -> bytes:
    return pack_glb(text, data[28 + int.from_bytes(data[12:16], "little") :])


MTL = "newmtl red\nKd 0.8 0.1 0.1\nNs 10\nd 0.5\nnewmtl oak\nKd 1 1 1\nPm 0.25\nNi 1.4\nKe 0 0 1\nmap_Kd wood.png\n"
OBJ = (
    "mtllib chair.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\n"
    "o seat\nusemtl red\nf 1 2 3\no back\nusemtl oak\nf 1/1/1 3/2/1 4/3/1 2/1/1\n"
)


def read_obj(data: bytes, folder: Path, *, library: bool = False) -> object:
    folder = folder / "obj"
    folder.mkdir(exist_ok=True)
    (folder / "wood.png").write_bytes(encode_image(np.full((4, 4, 3), 90, np.uint8), "png"))
    (folder / "chair.mtl").write_bytes(data if library else MTL.encode())
    (folder / "chair.obj").write_bytes(OBJ.encode() if library else data)
    return read_mesh_file(folder / "chair.obj", folder, FileReading())


def meshes(kind: str, *encodings: str) -> list[bytes]:
    box = trimesh.creation.box((0.5, 0.1, 0.4))
    box.visual.vertex_colors = np.tile([90, 50, 10, 255], (8, 1)).astype(np.uint8)
    files = [box.export(file_type=kind)] if not encodings else [box.export(file_type=kind, encoding=name) for name in encodings]
    return [file if isinstance(file, bytes) else file.encode() for file in files]


def pictures() -> list[bytes]:
    image = np.random.default_rng(1).integers(0, 255, (12, 16, 3)).astype(np.uint8)
    grey = np.arange(192, dtype=np.uint16).reshape(12, 16)
    return [encode_image(image, "png"), encode_image(grey, "png"), encode_image(image, "jpeg"), _webp(image)]


def _webp(image: Any) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(image).save(buffer, format="WEBP")
    return buffer.getvalue()


def radiance() -> list[bytes]:
    codes = np.full((8, 16, 4), 130, np.uint8)
    head = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=1.5\n\n-Y 8 +X 16\n"
    packed = b"".join(b"\x02\x02\x00\x10" + b"\x90\x82" * 4 for _ in range(8))
    return [head + codes.tobytes(), head + packed]


def mesh(kind: str) -> Callable[[bytes, Path], object]:
    return in_file(f"meshes/model.{kind}", lambda path: read_mesh_file(path, path.parent, FileReading()))


NAMES = read_category_map(config_path("learning/category_map.yaml"))
NAMES = replace(NAMES, catalogue=frozenset(small_grammar.CATEGORIES))


def row(kind: Kind, make: Callable[[], Sequence[bytes]], read: Callable[[bytes, Path], object], **more: Any) -> Reader:
    return Reader(kind=kind, make=make, read=read, **more)


def grammar_at(path: Path) -> object:
    return read_grammar(path, small_grammar.CATEGORIES)


def with_override(text: str) -> object:
    return apply_overrides({}, [f"grammar_node.rooms:={text}"])


def with_constraint(text: str) -> object:
    return parse_constraints([f"must_have:={text}"], "bedroom")


def status() -> list[bytes]:
    return [status_to_json(NodeStatus(node="/synth/renderer_node", role="renderer", state="ready", counts={"a": 1})).encode()]


def dataset_manifests() -> list[bytes]:
    return encoded({"schema": DATASET_MANIFEST_SCHEMA, "shards": [COMPLETION]})


def layouts() -> list[bytes]:
    return [layout_line(ROOM).encode(), json.dumps(FOREIGN_ROOM).encode()]


def layouts_at(path: Path) -> object:
    return read_layouts(path, NAMES, "bedroom")


def trajectories() -> list[bytes]:
    return [trajectory_to_tum(sample_scene().camera_path).encode()]


READERS: dict[str, Reader] = {
    # YAML
    "parameters": row("yaml", lambda: shipped("runs/demo.yaml", "rigs/stereo.yaml"), in_file("run.yaml", load_profile)),
    "override": row("yaml", lambda: [b"5", b"[1, a]", b"{a: 1.5}"], as_text(with_override)),
    "constraint": row("yaml", lambda: [b"[bed, desk]", b"[]"], as_text(with_constraint)),
    "run_facts": row("yaml", lambda: shipped("runs/demo.yaml"), lambda data, _: as_record(run_facts(read_parameters(data))), refusals=()),
    "look": row("yaml", lambda: [look.encode() for look in LOOKS], as_text(lambda text: read_looks((text,)))),
    "grammar": row("yaml", lambda: [GRAMMAR.encode()], in_file("closet.yaml", grammar_at), share=0.5),
    "shipped_grammar": row("yaml", lambda: shipped("grammars/hallway.yaml", "learned/bathroom.yaml"), in_file("hall.yaml", grammar_at),
                           tree_of=lambda data: None, share=0.1),
    "category_map": row("yaml", lambda: shipped("learning/category_map.yaml"), in_file("map.yaml", read_category_map), share=0.5),
    "catalog": row("yaml", lambda: [CATALOG.encode()], in_file("catalog.yaml", lambda path: read_catalog(path.parent))),
    "sweep": row("yaml", lambda: shipped("sweeps/camera.yaml", "sweeps/objects.yaml"), in_file("sweep.yaml", read_sweep)),
    "metadata": row("yaml", bag_metadata, in_file("metadata.yaml", read_metadata)),
    "qos": row("yaml", lambda: [qos_text((OfferedQos(),), version).encode() for version in (4, 5, 9)], as_text(read_qos)),
    # JSON
    "scene": row("json", lambda: [scene_to_json(sample_scene()).encode()], in_file("scene.json", read_scene)),
    "annotations": row("json", lambda: [text.encode() for text in annotations()], lambda data, folder: annotations_from_json(data)),
    "settings": row("json", settings, as_text(settings_from_json)),
    "status": row("json", status, as_text(status_from_json)),
    "evaluation": row("json", evaluations, in_file("evaluation.json", read_evaluation)),
    "sweep_json": row("json", lambda: encoded(SWEEP_JSON), in_file("sweep.json", read_sweep_json)),
    "reported_sweep": row("json", lambda: encoded(SWEEP_JSON), in_file("sweep.json", read_sweep_report), refusals=()),
    "plan": row("json", lambda: encoded(PLAN), lambda data, folder: read_plan(data, PLAN_NAME)),
    "completion": row("json", lambda: encoded(COMPLETION), dataset(f"{SHARDS_NAME}/00000.json")),
    "dataset_manifest": row("json", dataset_manifests, dataset(DATASET_MANIFEST_NAME)),
    "sealed_completion": row("json", lambda: encoded({**COMPLETION, "provenance": PLAN["provenance"][0]}), read_shard, refusals=()),
    "splits": row("json", lambda: encoded(SPLITS, SPLITS | BALANCED), in_file(f"splits/{SPLITS_NAME}", read_splits)),
    "bag_manifest": row("json", manifests, lambda data, folder: read_manifest(data)),
    "layouts": row("json", layouts, in_file("rooms.jsonl", layouts_at)),
    "trajectory": row("text", trajectories, as_text(trajectory_from_tum)),
    # models and pictures
    "glb": row("bytes", glb_files, mesh("glb"), tree_of=glb_tree, with_tree=glb_with_tree, share=2.0),
    "gltf": row("json", gltf_files, mesh("gltf")),
    "obj": row("text", lambda: [OBJ.encode()], read_obj),
    "mtl": row("text", lambda: [MTL.encode()], lambda data, folder: read_obj(data, folder, library=True)),
    "ply": row("text", lambda: meshes("ply", "ascii", "binary"), mesh("ply"), share=2.0),
    "stl": row("text", lambda: [*meshes("stl"), *meshes("stl_ascii")], mesh("stl")),
    "picture": row("bytes", pictures, lambda data, folder: decode_image(data, "picture", 1024), share=2.0),
    "radiance": row("bytes", radiance, in_file("map.hdr", read_rgbe)),
    **BAG_READERS,
}  # fmt: skip
