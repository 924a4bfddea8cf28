"""Makes small GLB files by hand, for tests: right ones, and ones that lie."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.5]], np.float32)


def pack_glb(tree: dict[str, Any] | bytes, binary: bytes = b"") -> bytes:
    """A GLB of a JSON tree (or its text) and a binary chunk."""
    text = tree if isinstance(tree, bytes) else json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    body = struct.pack("<2I", len(text), 0x4E4F534A) + text
    if binary:
        body += struct.pack("<2I", len(binary), 0x004E4942) + binary
    return struct.pack("<3I", 0x46546C67, 2, 12 + len(body)) + body


def add_array(tree: dict[str, Any], binary: bytearray, rows: NDArray[Any], **more: object) -> int:
    """Append an accessor with its buffer view; return its index."""
    kinds = {"int8": 5120, "uint8": 5121, "int16": 5122, "uint16": 5123, "uint32": 5125, "float32": 5126}
    binary += b"\0" * (-len(binary) % 4)
    tree["bufferViews"].append({"buffer": 0, "byteOffset": len(binary), "byteLength": rows.nbytes})
    binary += rows.tobytes()
    tree["accessors"].append(
        {
            "bufferView": len(tree["bufferViews"]) - 1,
            "componentType": kinds[rows.dtype.name],
            "count": len(rows),
            "type": "SCALAR" if rows.ndim == 1 else f"VEC{rows.shape[1]}",
            **more,
        }
    )
    return len(tree["accessors"]) - 1


def triangle_tree() -> tuple[dict[str, Any], bytearray]:
    """One triangle with indices and texture coordinates: the tree of a valid file and its binary chunk."""
    binary = bytearray()
    tree: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "seat"}],
        "meshes": [{"primitives": [{"attributes": {}, "material": 0}]}],
        "materials": [{"name": "paint", "pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.4, 0.6, 1], "metallicFactor": 0}}],
        "accessors": [],
        "bufferViews": [],
        "buffers": [{}],
    }
    primitive = tree["meshes"][0]["primitives"][0]
    primitive["attributes"]["POSITION"] = add_array(tree, binary, TRIANGLE, min=[0, 0, 0], max=[1, 1, 0.5])
    primitive["attributes"]["TEXCOORD_0"] = add_array(tree, binary, TRIANGLE[:, :2].copy())
    primitive["indices"] = add_array(tree, binary, np.array([0, 1, 2], np.uint16))
    tree["buffers"][0]["byteLength"] = len(binary)
    return tree, binary


def triangle_glb() -> bytes:
    """The valid file."""
    tree, binary = triangle_tree()
    return pack_glb(tree, bytes(binary))
