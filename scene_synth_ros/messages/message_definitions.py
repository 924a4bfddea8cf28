"""Message definitions as rosbag2 writes them into MCAP schemas, and the type hashes that go with them.

Both come from the files that every interface package installs: ``share/<package>/msg/<Type>.msg`` and ``.json``.  Where a package is not
installed whose messages the recorder writes all the same, the definition comes from ``interfaces/`` beside this file: the fields of
``tf2_msgs`` (BSD 3-Clause) and ``vision_msgs`` 4 (Apache-2.0) as published, without their comments.
"""

import importlib
import json
import os
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from scene_description import SceneSynthError
from scene_synth_ros.messages.streams import DETECTIONS_2D_TYPE, DETECTIONS_3D_TYPE, LABEL_INFO_TYPE, TF_TYPE

_DELIMITER = "\n" + "=" * 80 + "\nMSG: "
_TYPE_NAME = re.compile(r"([A-Za-z0-9_]+)/(?:msg/)?([A-Za-z0-9_]+)")
_FIELD_TYPE = re.compile(r"^\s*([A-Za-z0-9_/]+)(?:\[[^\]]*\])?\s+", re.MULTILINE)
_PRIMITIVES = frozenset("bool byte char float32 float64 int8 uint8 int16 uint16 int32 uint32 int64 uint64 string wstring".split())
_INTERFACES = Path(__file__).parent / "interfaces"
_HASHES = {
    TF_TYPE: "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
    LABEL_INFO_TYPE: "RIHS01_3d37df4015cdf660cc851c51897f2acd957e1ca6205ba0a99aebffb9406b0783",
    DETECTIONS_2D_TYPE: "RIHS01_214274120007f4a683866481336b70310268cfa107aebe9d594a6acf75bda968",
    DETECTIONS_3D_TYPE: "RIHS01_793f5eab9595ac1c0da07873cc859db42eae51f0ee76056db8562515d830e018",
}
"""Of the types that are written without their packages."""


class MessageDefinitionError(SceneSynthError):
    """A message type whose definition cannot be found; one line that names the type."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MessageDefinition:
    """What a bag must say of a message type.

    ``text`` is the ``ros2msg`` schema: the type's own file, then every type it depends on, each once.  ``type_hash`` is the REP 2011
    hash (``RIHS01_...``), empty where the package installs none.
    """

    type_name: str
    text: str
    type_hash: str


def message_definition(type_name: str) -> MessageDefinition:
    """Return the definition of ``package/msg/Type``.

    Raises:
        MessageDefinitionError: the name is malformed, or the type or one that it depends on is not installed.
    """
    return _load(type_name, share_folders())


def message_class(type_name: str) -> Any:
    """Return the Python class of ``package/msg/Type``.

    Raises:
        ImportError, AttributeError: its package is not installed, or lacks the type.
    """
    package, _, name = type_name.partition("/msg/")
    return getattr(importlib.import_module(f"{package}.msg"), name)


@lru_cache(maxsize=64)
def installed_class(type_name: str) -> Any:
    """Return what :func:`message_class` returns, None where the package is not installed: vision_msgs and tf2_msgs are no PyPI wheels."""
    try:
        return message_class(type_name)
    except ImportError:
        return None


def type_name_of(message_type: type) -> str:
    """Return ``package/msg/Type`` of a message's Python class."""
    return f"{message_type.__module__.partition('.')[0]}/msg/{message_type.__name__}"


def share_folders() -> tuple[str, ...]:
    """Return where interface packages are looked for: the prefixes of ``AMENT_PREFIX_PATH``, then the interpreter's own."""
    prefixes = [prefix for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if prefix]
    return tuple(dict.fromkeys(str(Path(prefix) / "share") for prefix in [*prefixes, sys.prefix]))


@lru_cache(maxsize=256)
def _load(type_name: str, folders: tuple[str, ...]) -> MessageDefinition:
    text = "".join(_texts(type_name, folders, set(), type_name))
    return MessageDefinition(type_name=type_name, text=text, type_hash=_type_hash(type_name, folders))


def _texts(type_name: str, folders: tuple[str, ...], seen: set[str], root: str) -> Iterator[str]:
    """Yield a type's text and, depth first in order of name, the delimited texts of its dependencies not yet seen."""
    package, _ = _split(type_name, root)
    text = _own_text(type_name, folders, root)
    yield text
    for dependency in _dependencies(text, package):
        if dependency not in seen:
            seen.add(dependency)
            yield f"{_DELIMITER}{dependency}\n"
            yield from _texts(dependency, folders, seen, root)


def _dependencies(text: str, package: str) -> list[str]:
    """Return the message types of a definition's fields, as written there, but always with their package."""
    names = {name for name in _FIELD_TYPE.findall(text) if name not in _PRIMITIVES}
    return sorted(name if "/" in name else f"{package}/{name}" for name in names)


def _own_text(type_name: str, folders: tuple[str, ...], root: str) -> str:
    package, name = _split(type_name, root)
    for folder in (*folders, str(_INTERFACES)):
        path = Path(folder, package, "msg", f"{name}.msg")
        if path.is_file():
            return path.read_bytes().decode()
    needed = "" if type_name == root else f" (needed by '{root}')"
    raise MessageDefinitionError(
        f"message type '{type_name}'{needed}: no definition under {' or '.join(folders)}; install the package {package}"
    )


def _type_hash(type_name: str, folders: tuple[str, ...]) -> str:
    package, name = _split(type_name, type_name)
    full_name = f"{package}/msg/{name}"
    for folder in folders:
        path = Path(folder, package, "msg", f"{name}.json")
        if not path.is_file():
            continue
        try:
            hashes = {entry["type_name"]: entry["hash_string"] for entry in json.loads(path.read_bytes())["type_hashes"]}
        except (ValueError, KeyError, TypeError):
            raise MessageDefinitionError(f"message type '{type_name}': {path} is no type description; reinstall {package}") from None
        return str(hashes.get(full_name, ""))
    return _HASHES.get(full_name, "")


def _split(type_name: str, root: str) -> tuple[str, str]:
    match = _TYPE_NAME.fullmatch(type_name)
    if match is None:
        raise MessageDefinitionError(f"message type '{root}': expected 'package/msg/Type', got '{type_name}'")
    return match.group(1), match.group(2)
