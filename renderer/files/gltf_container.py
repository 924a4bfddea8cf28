"""The outer form of glTF 2.0 files: GLB chunks, JSON, buffers; sizes and counts are checked before anything is allocated.

Written after the glTF 2.0 specification (Khronos Group, version 2.0.1, chapters 3 and 4).  We read glTF ourselves rather than by trimesh
because trimesh names the primitives of a mesh at random, drops the material extensions, takes normalised integers as they stand, and
leaves out images that do not decode without a word.
"""

import base64
import binascii
import json
import struct
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, NoReturn
from urllib.parse import unquote

from renderer.core.errors import MeshFileError
from scene_description.strict import shorten

MAX_TREE_MARKS = 400_000
"""Greatest number of commas and opening brackets in a file's JSON, a bound on the memory that it takes once parsed."""
MAX_BUFFER_BYTES = 256_000_000
MAX_ITEMS = {"nodes": 10_000, "meshes": 10_000, "accessors": 100_000, "bufferViews": 100_000, "materials": 1_000, "images": 256,
             "textures": 1_000, "buffers": 64, "scenes": 256, "samplers": 1_000}  # fmt: skip
KNOWN_EXTENSIONS = frozenset(
    f"KHR_{name}"
    for name in (
        "materials_transmission", "materials_ior", "materials_clearcoat", "materials_sheen", "materials_emissive_strength",
        "materials_diffuse_transmission", "materials_specular", "materials_volume", "materials_unlit",
        "materials_pbrSpecularGlossiness", "materials_variants", "materials_iridescence",
        "materials_anisotropy",
        "materials_dispersion", "texture_transform", "mesh_quantization",
        "lights_punctual", "xmp_json_ld", "animation_pointer", "node_visibility",
    )
) | {"EXT_texture_webp"}  # fmt: skip
_MAGIC, _JSON_CHUNK, _BINARY_CHUNK = 0x46546C67, 0x4E4F534A, 0x004E4942

Fetch = Callable[[str], bytes]
"""Returns the bytes of a file that a model refers to, by its relative path."""


class Container(NamedTuple):
    """A parsed glTF file: its JSON tree and the bytes of its buffers, each as long as the tree says."""

    tree: Mapping[str, Any]
    buffers: tuple[memoryview, ...]
    fetch: Fetch


def read_container(data: bytes, binary: bool, fetch: Fetch) -> Container:
    """Split a GLB (``binary``) or glTF file into its JSON tree and buffers; ``fetch`` reads files that it refers to.

    Raises:
        MeshFileError: the form is broken, a count is beyond its limit, or an extension is required that is not known.
    """
    text, chunk = _split(data) if binary else (data, b"")
    tree = _parse(text)
    asset = tree.get("asset")
    if not isinstance(asset, Mapping) or not str(asset.get("version", "")).startswith("2."):
        fail("asset.version", "glTF 2", asset.get("version") if isinstance(asset, Mapping) else asset)
    for name, most in MAX_ITEMS.items():
        items = listed(tree, name)
        if len(items) > most:
            fail(name, f"at most {most}", len(items))
    required = [str(name) for name in listed(tree, "extensionsRequired")]
    unknown = sorted(set(required) - KNOWN_EXTENSIONS)
    if unknown:
        fail("extensionsRequired", "extensions that are read (save the file without compression)", ", ".join(unknown))
    return Container(tree, tuple(_buffer(i, item, chunk, fetch) for i, item in enumerate(listed(tree, "buffers"))), fetch)


def fail(path: str, expected: str, got: object) -> NoReturn:
    """Raise a MeshFileError of one line."""
    found = got if isinstance(got, str) and got.isprintable() and len(got) <= 120 else shorten(got)
    raise MeshFileError(f"{path}: expected {expected}, got {found}")


def listed(owner: Mapping[str, Any], name: str) -> list[Any]:
    """Return a list of the tree, empty where absent."""
    items = owner.get(name, [])
    if not isinstance(items, list):
        fail(name, "a list", items)
    return items


def mapped(owner: Mapping[str, Any], name: str, path: str = "") -> Mapping[str, Any]:
    """Return a mapping of the tree, empty where absent."""
    item = owner.get(name, {})
    if not isinstance(item, Mapping):
        fail(f"{path}{name}", "a mapping", item)
    return item


def whole(value: object, path: str, least: int = 0, most: int = 2**31 - 1) -> int:
    """Return a whole number within bounds."""
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
        fail(path, f"a whole number in [{least}, {most}]", value)
    return value


def pointed(tree: Mapping[str, Any], name: str, index: object, path: str) -> Mapping[str, Any]:
    """Return the item of a list that an index points to."""
    items = listed(tree, name)
    item = items[whole(index, path, 0, len(items) - 1)]
    if not isinstance(item, Mapping):
        fail(f"{name}[{index}]", "a mapping", item)
    return item


def view_bytes(container: Container, index: object, path: str) -> memoryview:
    """Return the bytes of a buffer view, not copied."""
    view = pointed(container.tree, "bufferViews", index, path)
    buffer = container.buffers[whole(view.get("buffer"), f"bufferViews[{index}].buffer", 0, len(container.buffers) - 1)]
    first = whole(view.get("byteOffset", 0), f"bufferViews[{index}].byteOffset")
    length = whole(view.get("byteLength"), f"bufferViews[{index}].byteLength", 1)
    if first + length > len(buffer):
        fail(f"bufferViews[{index}]", f"a range within the {len(buffer)} bytes of its buffer", f"{first} to {first + length}")
    return buffer[first : first + length]


def uri_bytes(uri: object, fetch: Fetch, path: str) -> bytes:
    """Return the bytes of a data URI or of a file that the model refers to."""
    if not isinstance(uri, str):
        fail(path, "a URI", uri)
    if uri.startswith("data:"):
        _, comma, text = uri.partition(";base64,")
        if not comma:
            fail(path, "base64 in its data URI", "none")
        try:
            return base64.b64decode(text, validate=True)
        except (binascii.Error, ValueError):
            fail(path, "base64 in its data URI", "text that does not decode")
    if "://" in uri[:20]:
        fail(path, "a file in the catalogue", f"the address '{shorten(uri)}'")
    return fetch(unquote(uri))


def _split(data: bytes) -> tuple[bytes, bytes]:
    """Return the JSON and the binary chunk of a GLB."""
    if len(data) < 20:
        fail("header", "at least 20 bytes of a GLB", f"{len(data)}")
    magic, version, length, json_length, kind = struct.unpack_from("<5I", data)
    if magic != _MAGIC or version != 2:
        fail("header", "a GLB of version 2", f"magic {magic:#x}, version {version}")
    if length > len(data) or kind != _JSON_CHUNK or 20 + json_length > length:
        fail("header", f"chunks within the file's {len(data)} bytes, JSON first", f"length {length}, JSON of {json_length}")
    first = 20 + json_length
    if first + 8 > length:
        return data[20:first], b""
    size, kind = struct.unpack_from("<2I", data, first)
    if kind != _BINARY_CHUNK or first + 8 + size > length:
        fail("chunk 1", f"binary data within the file's {length} bytes", f"type {kind:#x} of {size} bytes")
    return data[20:first], data[first + 8 : first + 8 + size]


def _parse(text: bytes) -> Mapping[str, Any]:
    marks = text.count(b",") + text.count(b"[") + text.count(b"{")
    if marks > MAX_TREE_MARKS:
        fail("JSON", f"at most {MAX_TREE_MARKS} commas and brackets", marks)
    try:
        tree = json.loads(text, parse_constant=lambda name: fail("JSON", "finite numbers", name))
    except (ValueError, RecursionError) as error:
        fail("JSON", "text that parses", "nesting beyond the parser's depth" if isinstance(error, RecursionError) else "text that does not")
    if not isinstance(tree, Mapping):
        fail("JSON", "a mapping", tree)
    return tree


def _buffer(index: int, item: object, chunk: bytes, fetch: Fetch) -> memoryview:
    if not isinstance(item, Mapping):
        fail(f"buffers[{index}]", "a mapping", item)
    length = whole(item.get("byteLength"), f"buffers[{index}].byteLength", 1, MAX_BUFFER_BYTES)
    data = uri_bytes(item["uri"], fetch, f"buffers[{index}].uri") if "uri" in item else chunk
    if len(data) < length:
        fail(f"buffers[{index}].byteLength", f"at most the {len(data)} bytes that there are", length)
    return memoryview(data)[:length]
