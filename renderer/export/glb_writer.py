"""Builds GLB files: a JSON tree that grows item by item, and one binary buffer.

Our own writer, because trimesh writes neither lights nor the extensions of materials, and pygltflib is the same JSON as dataclasses:
accessors, buffer views and alignment would still be ours to get right.
"""

import json
import struct
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

_COMPONENTS = {"float32": 5126, "uint16": 5123, "uint32": 5125}
_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
_TARGETS = {"vertices": 34962, "indices": 34963, "animation": None}
_MAGIC, _JSON_CHUNK, _BINARY_CHUNK = 0x46546C67, 0x4E4F534A, 0x004E4942


class GlbWriter:
    """Collects the items of a glTF 2.0 file; each ``add`` returns the item's index.  Equal calls give equal bytes."""

    def __init__(self, generator: str) -> None:
        self._tree: dict[str, Any] = {"asset": {"version": "2.0", "generator": generator}}
        self._binary = bytearray()
        self._extensions: set[str] = set()

    def add(self, kind: str, item: Mapping[str, Any]) -> int:
        """Append an item (without its None entries) to the list ``kind`` of the tree, for example ``nodes``."""
        items: list[Any] = self._tree.setdefault(kind, [])
        items.append({key: value for key, value in item.items() if value is not None})
        return len(items) - 1

    def set_child(self, parent: int, child: int) -> None:
        """Put one node below another."""
        self._tree["nodes"][parent].setdefault("children", []).append(child)

    def use_extension(self, name: str) -> None:
        """Declare an extension as used; none is required for reading."""
        self._extensions.add(name)

    def add_light(self, light: Mapping[str, Any]) -> int:
        """Append a light of KHR_lights_punctual."""
        self.use_extension("KHR_lights_punctual")
        lights: list[Any] = self._tree.setdefault("extensions", {}).setdefault("KHR_lights_punctual", {"lights": []})["lights"]
        lights.append(dict(light))
        return len(lights) - 1

    def add_array(self, rows: NDArray[Any], *, use: Literal["vertices", "indices", "animation"] = "vertices", bounds: bool = False) -> int:
        """Append an accessor of float32 (n,) or (n, 2 to 4), or unsigned whole numbers (n,); ``bounds`` states min and max."""
        view = self._add_view(np.ascontiguousarray(rows).tobytes(), _TARGETS[use])
        item: dict[str, Any] = {
            "bufferView": view,
            "componentType": _COMPONENTS[rows.dtype.name],
            "count": len(rows),
            "type": _TYPES[1 if rows.ndim == 1 else rows.shape[1]],
        }
        if bounds:
            item["min"], item["max"] = (np.atleast_1d(end).tolist() for end in (rows.min(axis=0), rows.max(axis=0)))
        return self.add("accessors", item)

    def add_png(self, data: bytes, name: str) -> int:
        """Append a PNG as an image and a texture that repeats it; return the texture's index."""
        if "samplers" not in self._tree:
            self.add("samplers", {"magFilter": 9729, "minFilter": 9987, "wrapS": 10497, "wrapT": 10497})
        image = self.add("images", {"bufferView": self._add_view(data, None), "mimeType": "image/png", "name": name})
        return self.add("textures", {"source": image, "sampler": 0})

    def to_bytes(self, root: int, extras: Mapping[str, Any]) -> bytes:
        """Return the file, with one scene of one root node."""
        tree = dict(self._tree)
        tree["scene"], tree["scenes"] = 0, [{"nodes": [root], "extras": dict(extras)}]
        tree["buffers"] = [{"byteLength": len(self._binary)}]
        if self._extensions:
            tree["extensionsUsed"] = sorted(self._extensions)
        text = json.dumps(tree, ensure_ascii=True, allow_nan=False, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        binary = bytes(self._binary) + b"\0" * (-len(self._binary) % 4)
        length = 12 + 8 + len(text) + 8 + len(binary)
        return b"".join(
            [
                struct.pack("<3I", _MAGIC, 2, length),
                struct.pack("<2I", len(text), _JSON_CHUNK),
                text,
                struct.pack("<2I", len(binary), _BINARY_CHUNK),
                binary,
            ]
        )

    def _add_view(self, data: bytes, target: int | None) -> int:
        self._binary += b"\0" * (-len(self._binary) % 4)
        offset = len(self._binary)
        self._binary += data
        return self.add("bufferViews", {"buffer": 0, "byteOffset": offset, "byteLength": len(data), "target": target})
