"""The user's files: geometry against trimesh's reading, parts by name, materials, axes; what is refused, and that nothing else happens."""

import json
import math
import sys
import tracemalloc
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from glb_files import TRIANGLE, add_array, pack_glb, triangle_glb, triangle_tree
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from python_calls import counted_calls

from renderer.core.errors import MeshFileError
from renderer.files.file_parts import MAX_PARTS
from renderer.files.image_io import decode_image, encode_image, image_size
from renderer.files.mesh_files import load_mesh_file, read_mesh_file
from renderer.files.trimesh_files import read_mtl
from scene_description import FileReading

PLAIN = FileReading()
Change = Callable[[dict[str, Any]], object]


def write(folder: Path, data: bytes, name: str = "model.glb") -> Path:
    path = folder / name
    path.write_bytes(data)
    return path


def tree_with(change: Change) -> bytes:
    tree, binary = triangle_tree()
    change(tree)
    return pack_glb(tree, bytes(binary))


def chair() -> trimesh.Scene:
    """Two nodes, y up, front +z, the back turned and moved by its node."""
    scene = trimesh.Scene()
    scene.add_geometry(trimesh.creation.box((0.5, 0.1, 0.4)), node_name="seat")
    matrix = trimesh.transformations.rotation_matrix(0.3, (1, 0, 0)) @ trimesh.transformations.translation_matrix((0, 0.35, -0.2))
    scene.add_geometry(trimesh.creation.icosphere(2, 0.2), node_name="Back Rest", transform=matrix)
    return scene


def test_same_triangles_as_trimesh_reads(tmp_path: Path) -> None:
    """An independent reader: same positions (up to our axes) and same size."""
    path = write(tmp_path, chair().export(file_type="glb"))
    ours = read_mesh_file(path, tmp_path, PLAIN)
    theirs = trimesh.load_scene(path)
    assert list(ours.parts) == ["seat", "Back_Rest"]
    width, height, depth = theirs.extents
    assert np.allclose(ours.size, (depth, width, height), atol=1e-6)
    turn = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
    for name, node in (("seat", "seat"), ("Back_Rest", "Back Rest")):
        matrix, geometry = theirs.graph[node]
        expected = trimesh.transform_points(theirs.geometry[geometry].vertices, matrix) @ turn.T
        mesh = ours.parts[name].mesh
        got = mesh.vertices[mesh.faces].astype(float) * max(ours.size)
        corners = expected[theirs.geometry[geometry].faces]
        assert np.allclose(np.sort(got.reshape(-1, 3), axis=0), np.sort(corners.reshape(-1, 3), axis=0), atol=1e-5)
        outward = mesh.vertices[mesh.faces].mean(axis=1) - mesh.vertices.mean(axis=0)
        flat = np.cross(*np.diff(mesh.vertices[mesh.faces], axis=1).transpose(1, 0, 2))
        assert (np.einsum("ij,ij->i", flat, outward) > 0).all()


def test_front_and_up_may_be_stated(tmp_path: Path) -> None:
    """A box with its front along -y of a z-up file: depth is the file's y, width its x; the front end lies at +x of ours."""
    box = trimesh.creation.box((2.0, 1.0, 3.0))
    tip = trimesh.creation.box((0.1, 0.1, 0.1))
    tip.apply_translation((0.0, -0.5, 0.0))
    path = write(tmp_path, trimesh.Scene({"box": box, "tip": tip}).export(file_type="glb"))
    read = read_mesh_file(path, tmp_path, FileReading(front="-y", up="+z"))
    assert np.allclose(read.size, (1.05, 2.0, 3.0), atol=1e-6)
    assert read.parts["tip"].mesh.vertices[:, 0].min() > read.parts["box"].mesh.vertices[:, 0].mean()
    with pytest.raises(MeshFileError, match="different axes"):
        read_mesh_file(path, tmp_path, FileReading(front="+y"))


def test_parts_split_by_nodes_or_materials_and_renamed(tmp_path: Path) -> None:
    tree, binary = triangle_tree()
    tree["materials"].append({"name": "steel"})
    tree["meshes"].append({"primitives": [{**tree["meshes"][0]["primitives"][0], "material": 1}]})
    tree["nodes"] = [{"mesh": 0, "name": "Leg.001"}, {"mesh": 0, "name": "Leg.002", "translation": [0, 2, 0]}, {"mesh": 1, "name": "top"}]
    tree["scenes"] = [{"nodes": [0, 1, 2]}]
    path = write(tmp_path, pack_glb(tree, bytes(binary)))

    def names(**how: Any) -> dict[str, int]:
        return {name: len(part.mesh.faces) for name, part in read_mesh_file(path, tmp_path, FileReading(**how)).parts.items()}

    assert names() == {"Leg.001": 1, "Leg.002": 1, "top": 1}
    assert names(rename={"Leg*": "legs"}) == {"legs": 2, "top": 1}
    assert names(rename={"Leg*": "legs", "Leg.002": "foot"}) == {"legs": 1, "foot": 1, "top": 1}
    assert names(split="materials") == {"paint": 2, "steel": 1}
    assert names(split="none") == {"body": 2, "body_2": 1}, "materials of the file stay apart"
    assert names(split="none", own_materials=False) == {"body": 3}


def test_materials_and_extensions_are_read(tmp_path: Path) -> None:
    def glass(tree: dict[str, Any]) -> None:
        tree["materials"][0] |= {
            "emissiveFactor": [1, 0.5, 0],
            "extensions": {
                "KHR_materials_transmission": {"transmissionFactor": 0.9},
                "KHR_materials_diffuse_transmission": {"diffuseTransmissionFactor": 0.4},
                "KHR_materials_ior": {"ior": 1.33},
                "KHR_materials_clearcoat": {"clearcoatFactor": 0.5, "clearcoatRoughnessFactor": 0.1},
                "KHR_materials_sheen": {"sheenColorFactor": [0.1, 0.3, 0.2]},
                "KHR_materials_emissive_strength": {"emissiveStrength": 4.0},
            },
        }

    (material,) = read_mesh_file(write(tmp_path, tree_with(glass)), tmp_path, PLAIN).materials
    assert (material.name, material.base_color, material.metallic, material.roughness) == ("paint", (0.2, 0.4, 0.6), 0.0, 1.0)
    assert (material.transmission, material.ior, material.clearcoat, material.clearcoat_roughness) == (0.9, 1.33, 0.5, 0.1)
    assert material.diffuse_transmission == 0.4 and material.sheen == 0.3 and material.emission == (4.0, 2.0, 0.0)


def test_texture_coordinates_follow_the_transform(tmp_path: Path) -> None:
    """Offset, a quarter turn and a scale, as Blender's importer has them: u' = ou + sv v sin + su u cos, v' = ov - su u sin + sv v cos."""
    image = np.zeros((2, 3, 3), np.uint8)
    tree, binary = triangle_tree()
    tree["bufferViews"].append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(encode_image(image, "png"))})
    binary += encode_image(image, "png")
    tree["buffers"][0]["byteLength"] = len(binary)
    tree["images"], tree["textures"] = [{"bufferView": 3, "mimeType": "image/png"}], [{"source": 0}]
    change = {"offset": [0.25, 0.5], "rotation": math.pi / 2, "scale": [2, 3]}
    tree["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {"index": 0, "extensions": {"KHR_texture_transform": change}}
    read = read_mesh_file(write(tmp_path, pack_glb(tree, bytes(binary))), tmp_path, PLAIN)
    assert np.allclose(read.parts["seat"].mesh.uvs, [[0.25, 0.5], [0.25, 2.5], [3.25, 0.5]], atol=1e-6)
    assert decode_image(read.images[0], "image", 64).shape == (2, 3, 4)
    whole = load_mesh_file(tmp_path / "model.glb", tmp_path, (7.0, 8.0, 9.0))
    assert np.array_equal(whole["seat"].uvs, read.parts["seat"].mesh.uvs), "an image does not grow with the model"


def test_normalised_integers_and_interleaving(tmp_path: Path) -> None:
    """Quantised positions (KHR_mesh_quantization): 32767 stands for 1, and rows lie 8 bytes apart."""
    tree, binary = triangle_tree()
    rows = np.zeros((3, 4), np.int16)
    rows[:, :3] = np.round(TRIANGLE * 32767)
    index = add_array(tree, binary, rows, normalized=True)
    tree["accessors"][index]["type"] = "VEC3"
    tree["bufferViews"][-1]["byteStride"] = 8
    tree["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = index
    tree["buffers"][0]["byteLength"] = len(binary)
    read = read_mesh_file(write(tmp_path, pack_glb(tree, bytes(binary))), tmp_path, PLAIN)
    assert np.allclose(read.size, (0.5, 1.0, 1.0), atol=1e-4)


def test_strips_and_mirrored_nodes_keep_their_side(tmp_path: Path) -> None:
    square = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], np.float32)
    tree, binary = triangle_tree()
    primitive = {"attributes": {"POSITION": add_array(tree, binary, square)}, "mode": 5}
    tree["buffers"][0]["byteLength"] = len(binary)
    tree["meshes"] = [{"primitives": [primitive]}]
    tree["nodes"] = [{"mesh": 0, "name": "a"}, {"mesh": 0, "name": "b", "scale": [-1, 1, 1]}]
    tree["scenes"] = [{"nodes": [0, 1]}]
    read = read_mesh_file(write(tmp_path, pack_glb(tree, bytes(binary))), tmp_path, PLAIN)
    for part in read.parts.values():
        corners = part.mesh.vertices[part.mesh.faces]
        assert len(corners) == 2
        flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert (flat[:, 0] > 0).all(), "+z of the file is +x of ours; both triangles look there, also mirrored"
        assert np.allclose(part.mesh.normals, (1, 0, 0))


def test_vertex_colours_tint_by_their_mean(tmp_path: Path) -> None:
    tree, binary = triangle_tree()
    colors = np.array([[255, 0, 0], [255, 255, 0], [255, 0, 0]], np.uint8)
    tree["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = add_array(tree, binary, colors, normalized=True)
    tree["buffers"][0]["byteLength"] = len(binary)
    read = read_mesh_file(write(tmp_path, pack_glb(tree, bytes(binary))), tmp_path, PLAIN)
    assert np.allclose(read.materials[read.parts["seat"].material].base_color, (0.2, 0.4 / 3, 0.0))


def test_without_trimesh_files_that_need_it_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    monkeypatch.setitem(sys.modules, "trimesh", None)
    monkeypatch.delitem(sys.modules, "renderer.files.trimesh_files", raising=False)
    with pytest.raises(MeshFileError, match=r"expected the Python package trimesh, which reads \.obj files; run 'pip install trimesh'"):
        read_mesh_file(tmp_path / "a.obj", tmp_path, PLAIN)


def test_obj_with_its_library(tmp_path: Path) -> None:
    (tmp_path / "wood.png").write_bytes(encode_image(np.full((4, 4, 3), 90, np.uint8), "png"))
    (tmp_path / "chair.mtl").write_text("newmtl red\nKd 0.8 0.1 0.1\nNs 0\nnewmtl oak\nKd 1 1 1\nPm 0.25\nmap_Kd wood.png\n")
    (tmp_path / "chair.obj").write_text(
        "mtllib chair.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\n"
        "o seat\nusemtl red\nf 1 2 3\no back\nusemtl oak\nf 1/1 3/2 4/3\n"
    )
    read = read_mesh_file(tmp_path / "chair.obj", tmp_path, PLAIN)
    look = {name: read.materials[part.material] for name, part in read.parts.items()}
    (seat,) = (item for name, item in look.items() if "seat" in name)
    (back,) = (item for name, item in look.items() if "back" in name)
    assert seat.base_color == (0.8, 0.1, 0.1) and seat.roughness == 1.0 and back.metallic == 0.25
    assert back.base_image is not None and image_size(read.images[back.base_image.image], "wood") == (4, 4)
    (mesh,) = (part.mesh for name, part in read.parts.items() if "back" in name)
    assert np.allclose(sorted(mesh.uvs.tolist()), [[0, 0], [0, 1], [1, 0]]), "v points up the image, as in the file"


def test_a_library_of_many_pictures_is_refused_before_they_are_read(tmp_path: Path) -> None:
    read: list[str] = []

    def fetch(name: str) -> bytes:
        read.append(name)
        return huge_image(4096)

    text = "".join(f"newmtl m{k}\nmap_Kd {k}.png\n" for k in range(1000))
    with pytest.raises(MeshFileError, match=r"material library: expected images of at most \d+ pixels together, got 83886080 or more$"):
        read_mtl(text.encode(), fetch)
    assert read == [f"{k}.png" for k in range(5)]


def test_what_a_model_refers_to_has_one_budget(tmp_path: Path) -> None:
    """Pictures of few pixels and files of 60 MB, of which only the first bytes are on the disk."""
    for k in range(8):
        with (tmp_path / f"{k}.png").open("wb") as file:
            file.write(encode_image(np.zeros((4, 4), np.uint8), "png"))
            file.truncate(60_000_000)
    (tmp_path / "a.mtl").write_text("".join(f"newmtl m{k}\nmap_Kd {k}.png\n" for k in range(8)))
    (tmp_path / "a.obj").write_text("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m0\nf 1 2 3\n")
    tree, binary = triangle_tree()
    tree["buffers"] += [{"byteLength": 60_000_000, "uri": "0.png"}] * 8
    (tmp_path / "a.glb").write_bytes(pack_glb(tree, bytes(binary)))
    for name, place in (("a.obj", "3.png"), ("a.glb", "0.png")):
        text = f"^model file '{name}': refers to '{place}': expected files of at most 200000000 bytes together"
        with pytest.raises(MeshFileError, match=text):
            read_mesh_file(tmp_path / name, tmp_path, PLAIN)


def huge_image(side: int) -> bytes:
    """A PNG of a few bytes that says it has side x side pixels."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return len(data).to_bytes(4, "big") + kind + data + zlib.crc32(kind + data).to_bytes(4, "big")

    header = side.to_bytes(4, "big") * 2 + bytes([8, 2, 0, 0, 0])
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(b"\0" * 10_000)) + chunk(b"IEND", b"")


def with_image(data: bytes) -> bytes:
    tree, binary = triangle_tree()
    tree["bufferViews"].append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(data)})
    binary += data
    tree["buffers"][0]["byteLength"] = len(binary)
    tree["images"], tree["textures"] = [{"bufferView": 3}], [{"source": 0}]
    tree["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {"index": 0}
    return pack_glb(tree, bytes(binary))


def deep(tree: dict[str, Any]) -> None:
    tree["nodes"] = [{"children": [i + 1]} for i in range(200)] + [{"mesh": 0}]


def many(tree: dict[str, Any]) -> None:
    """A bomb by instancing: one mesh of 300 000 triangles under 9 000 nodes."""
    tree["accessors"][2]["count"] = 900_000
    tree["nodes"] = [{"mesh": 0}] * 9_000
    tree["scenes"] = [{"nodes": list(range(9_000))}]


def set_count(index: int, count: object) -> Change:
    return lambda tree: tree["accessors"][index].update(count=count)


def raw_text(text: bytes) -> bytes:
    return pack_glb(text)


def nan_positions() -> bytes:
    tree, binary = triangle_tree()
    binary[:4] = np.float32(np.nan).tobytes()
    return pack_glb(tree, bytes(binary))


HOSTILE: dict[str, tuple[bytes, str]] = {
    "count beyond the file": (tree_with(set_count(0, 1_000_000)), "within the 36 bytes"),
    "count beyond the budget": (tree_with(set_count(0, 2_000_000_000)), "at most 1500000 vertices"),
    "negative count": (tree_with(set_count(0, -1)), "whole number"),
    "count of another type": (tree_with(set_count(0, 1e300)), "whole number"),
    "zero vertices": (tree_with(set_count(0, 0)), "whole number"),
    "instances without end": (tree_with(many), "at most 500000 triangles"),
    "deep nodes": (tree_with(deep), "levels of nodes"),
    "cycle": (tree_with(lambda t: t["nodes"][0].update(children=[0])), "without cycles"),
    "node beyond the list": (tree_with(lambda t: t["scenes"][0].update(nodes=[7])), r"\[0, 0\]"),
    "view beyond the buffer": (tree_with(lambda t: t["bufferViews"][0].update(byteLength=10**9)), "within the"),
    "buffer beyond the file": (tree_with(lambda t: t["buffers"][0].update(byteLength=10**8)), "bytes that there are"),
    "negative offset": (tree_with(lambda t: t["accessors"][0].update(byteOffset=-4)), "whole number"),
    "stride of zero": (tree_with(lambda t: t["bufferViews"][0].update(byteStride=0)), "whole number"),
    "unknown number type": (tree_with(lambda t: t["accessors"][0].update(componentType=9)), "componentType"),
    "material beyond the list": (tree_with(lambda t: t["meshes"][0]["primitives"][0].update(material=3)), "material"),
    "draco": (tree_with(lambda t: t.update(extensionsRequired=["KHR_draco_mesh_compression"])), "KHR_draco_mesh_compression"),
    "huge matrix": (tree_with(lambda t: t["nodes"][0].update(scale=[1e11, 1, 1])), "matrix"),
    "rotation of text": (tree_with(lambda t: t["nodes"][0].update(rotation="north")), "4 numbers"),
    "address on the net": (tree_with(lambda t: t["buffers"][0].update(uri="https://example.org/a.bin")), "in the catalogue"),
    "way out": (tree_with(lambda t: t["buffers"][0].update(uri="../../etc/passwd")), "inside the catalogue"),
    "encoded way out": (tree_with(lambda t: t["buffers"][0].update(uri="%2e%2e/%2e%2e/etc/passwd")), "inside the catalogue"),
    "absolute file": (tree_with(lambda t: t["buffers"][0].update(uri="/dev/zero")), "inside the catalogue"),
    "zero byte in a path": (tree_with(lambda t: t["buffers"][0].update(uri="a\0b")), "inside the catalogue"),
    "base64 of nothing": (tree_with(lambda t: t["buffers"][0].update(uri="data:;base64,!!")), "base64"),
    "NaN": (nan_positions(), "finite"),
    "NaN in JSON": (raw_text(b'{"asset": {"version": "2.0"}, "scene": NaN}'), "finite numbers"),
    "nesting": (raw_text(b"[" * 100_000), "nesting"),
    "many brackets": (raw_text(b"[" + b"[]," * 300_000 + b"[]]"), "commas and brackets"),
    "number of 10000 digits": (raw_text(b'{"asset": ' + b"9" * 10_000 + b"}"), "text that"),
    "no mapping": (raw_text(b"[]"), "a mapping"),
    "old version": (raw_text(b'{"asset": {"version": "1.0"}}'), "glTF 2"),
    "empty scene": (raw_text(b'{"asset": {"version": "2.0"}}'), "at least one triangle"),
    "chunk beyond the file": (triangle_glb()[:12] + b"\xff\xff\xff\x7f" + triangle_glb()[16:], "chunks within"),
    "cut off": (triangle_glb()[:-30], "chunks within"),
    "image of 10^10 pixels": (with_image(huge_image(100_000)), "at most|beyond any limit"),
    "image of 10^9 pixels": (with_image(huge_image(32_000)), "at most|beyond any limit"),
    "image of noise": (with_image(b"\x89PNG\r\n\x1a\n" + bytes(50)), "PNG, JPEG or WebP"),
    "image that runs code elsewhere": (with_image(b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n"), "PNG, JPEG or WebP"),
}  # fmt: skip


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_files_are_refused_at_once(tmp_path: Path, name: str) -> None:
    data, text = HOSTILE[name]
    path = write(tmp_path, data)
    with counted_calls() as calls, pytest.raises(MeshFileError, match=text) as caught:
        read_mesh_file(path, tmp_path, PLAIN)
    assert calls() < 100_000
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 400 and "model.glb" in str(caught.value)


def test_refusals_take_little_memory(tmp_path: Path) -> None:
    """The largest promises of the table, within a few megabytes beyond the file."""
    for name in ("count beyond the budget", "image of 10^9 pixels"):
        path = write(tmp_path, HOSTILE[name][0])
        tracemalloc.start()
        with pytest.raises(MeshFileError):
            read_mesh_file(path, tmp_path, PLAIN)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < 40_000_000, name


def test_an_image_that_is_shorter_than_it_says(tmp_path: Path) -> None:
    """Its header is fine, so the model loads; decoding it is refused, not filled with noise."""
    read = read_mesh_file(write(tmp_path, with_image(huge_image(1000)[:70] + bytes(40))), tmp_path, PLAIN)
    with pytest.raises(MeshFileError, match="image that decodes"):
        decode_image(read.images[0], "image", 2048)


def test_large_images_are_reduced_by_averaging() -> None:
    image = np.zeros((600, 300, 3), np.uint8)
    image[::2] = 200
    small = decode_image(encode_image(image, "png"), "image", 150)
    assert small.shape == (150, 75, 4) and (small[..., :3] == 100).all() and (small[..., 3] == 255).all()


@pytest.mark.parametrize(
    ("name", "data", "text"),
    [
        ("a.ply", b"ply\nformat binary_little_endian 1.0\nelement vertex 900000000000\nproperty float x\nend_header\n", "at most"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 1000\nproperty float x\nend_header\n", "a byte or more"),
        ("a.ply", b"ply\n" + b"comment x\n" * 9000, "PLY header"),
        ("a.stl", bytes(80) + b"\xff\xff\xff\x7f" + bytes(50), "stl"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99999999\n", "obj"),
        ("a.obj", b"mtllib ../secret.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "inside the catalogue"),
        ("a.obj", b"v 0 0\nv 1 0\nv 0 1\nf 1 2 3\n", "vertices and normals of 3 numbers"),
        ("a.obj", b"v 1e300 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "extent"),
    ],
)  # fmt: skip
def test_hostile_files_of_other_formats(tmp_path: Path, name: str, data: bytes, text: str) -> None:
    folder = tmp_path / "catalog"
    folder.mkdir()
    (tmp_path / "secret.mtl").write_text("newmtl secret\nKd 1 0 0\n")
    path = write(folder, data, name)
    with pytest.raises(MeshFileError, match=text) as caught:
        read_mesh_file(path, folder, PLAIN)
    assert "\n" not in str(caught.value)


def test_too_many_parts_say_what_to_do(tmp_path: Path) -> None:
    def crowd(tree: dict[str, Any]) -> None:
        tree["nodes"] = [{"mesh": 0, "name": f"n{i}"} for i in range(MAX_PARTS + 1)]
        tree["scenes"] = [{"nodes": list(range(MAX_PARTS + 1))}]

    path = write(tmp_path, tree_with(crowd))
    with pytest.raises(MeshFileError, match="split by 'materials'"):
        read_mesh_file(path, tmp_path, PLAIN)
    assert list(read_mesh_file(path, tmp_path, FileReading(rename={"n*": "all"})).parts) == ["all"]


BASE = triangle_glb()
JUNK = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**40), 2**40) | st.floats(allow_nan=False) | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=5,
)


def read_or_refuse(path: Path) -> None:
    try:
        read = read_mesh_file(path, path.parent, PLAIN)
    except MeshFileError as error:
        assert "\n" not in str(error)
    else:
        assert all(np.isfinite(part.mesh.vertices).all() and len(part.mesh.faces) for part in read.parts.values())


@settings(max_examples=150, deadline=2000, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(places=st.lists(st.tuples(st.integers(0, len(BASE) - 1), st.integers(0, 255)), min_size=1, max_size=8), cut=st.integers(0, 60))
def test_any_bytes_are_read_or_refused(tmp_path: Path, places: list[tuple[int, int]], cut: int) -> None:
    data = bytearray(BASE)
    for place, value in places:
        data[place] = value
    read_or_refuse(write(tmp_path, bytes(data[: len(data) - cut])))


def _paths(tree: Any, above: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    keys = list(tree) if isinstance(tree, dict) else list(range(len(tree))) if isinstance(tree, list) else []
    return [path for key in keys for path in ((*above, key), *_paths(tree[key], (*above, key)))]


PATHS = _paths(triangle_tree()[0])


@settings(max_examples=250, deadline=2000, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(path=st.sampled_from(PATHS), value=JUNK)
def test_any_value_anywhere_in_the_tree_is_read_or_refused(tmp_path: Path, path: tuple[Any, ...], value: Any) -> None:
    tree, binary = triangle_tree()
    inner: Any = tree
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = value
    read_or_refuse(write(tmp_path, pack_glb(json.dumps(tree).encode(), bytes(binary))))
