"""The features of a LeRobot dataset: what each column is, for ``meta/info.json``, for Arrow and for Hugging Face's ``datasets``.

Names, dtypes, shapes and paths are those of ``lerobot/datasets/{utils,feature_utils,dataset_metadata}.py`` and ``utils/constants.py``
(huggingface/lerobot 7427f318, Apache-2.0), version v3.0 of the format.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, NamedTuple

VERSION = "v3.0"
DATA_PATH = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
VIDEO_PATH = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"
EPISODES_PATH = "meta/episodes/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
CHUNK_FILES = 1000
DATA_FILE_MB = 100
VIDEO_FILE_MB = 200
IMAGES = "observation.images."
DISTORTION_LENGTH = 14
"""Coefficients of the longest model that OpenCV knows; the models here have fewer, and zeros after them."""


class Feature(NamedTuple):
    """A column.

    Attributes:
        dtype: numpy's name, ``image`` or ``string``.
        shape: of a value; (height, width, channels) of an image.
        names: of the parts of a value; None for none.
        info: more of it.
    """

    dtype: str
    shape: tuple[int, ...]
    names: tuple[str, ...] | None = None
    info: Mapping[str, Any] | None = None


STATE = ("x", "y", "z", "qx", "qy", "qz", "qw")
ACTION = ("vx", "vy", "vz", "wx", "wy", "wz")
VALUES: dict[str, Feature] = {
    "observation.state": Feature("float32", (7,), STATE),
    "action": Feature("float32", (6,), ACTION),
    "next.done": Feature("bool", (1,)),
    "camera.K": Feature("float64", (9,)),
    "camera.D": Feature("float64", (DISTORTION_LENGTH,)),
    "camera.distortion_model": Feature("string", (1,)),
    "camera.row_time_s": Feature("float64", (1,)),
    "stamp_ns": Feature("int64", (1,)),
    "room": Feature("int64", (1,)),
    "room_frame": Feature("int64", (1,)),
    "timestamp": Feature("float32", (1,)),
    "frame_index": Feature("int64", (1,)),
    "episode_index": Feature("int64", (1,)),
    "index": Feature("int64", (1,)),
    "task_index": Feature("int64", (1,)),
}
"""Columns that are no images; the last five are those that every LeRobot dataset has."""


def image_feature(layer: str, height: int, width: int, channels: int, *, metres: bool) -> tuple[str, Feature]:
    """Return name and row of a layer; ``metres``: it is a depth map."""
    info = {"is_depth_map": True, "depth_unit": "m"} if metres else {"is_depth_map": False}
    return f"{IMAGES}{layer}", Feature("image", (height, width, channels), ("height", "width", "channels"), info)


def info_document(features: Mapping[str, Feature], *, fps: int, episodes: int, frames: int, tasks: int, split: str) -> dict[str, Any]:
    """Return ``meta/info.json``."""
    return {
        "codebase_version": VERSION,
        "robot_type": "scene_synth_camera",
        "fps": fps,
        "total_episodes": episodes,
        "total_frames": frames,
        "total_tasks": tasks,
        "chunks_size": CHUNK_FILES,
        "data_files_size_in_mb": DATA_FILE_MB,
        "video_files_size_in_mb": VIDEO_FILE_MB,
        "data_path": DATA_PATH,
        "video_path": None,
        "splits": {split: f"0:{episodes}"},
        "features": {name: _info_row(feature) for name, feature in features.items()},
    }


def arrow_schema(features: Mapping[str, Feature]) -> Any:
    """Return the Arrow schema of the data files, with what ``datasets`` wants to know of it in its metadata."""
    import pyarrow as pa

    image = pa.struct([("bytes", pa.binary()), ("path", pa.string())])
    fields = []
    for name, feature in features.items():
        value = image if feature.dtype == "image" else _arrow_type(pa, feature.dtype)
        fields.append((name, value if feature.dtype == "image" or feature.shape == (1,) else pa.list_(value, feature.shape[0])))
    told = {"info": {"features": {name: _datasets_row(feature) for name, feature in features.items()}}}
    return pa.schema(fields, metadata={"huggingface": json.dumps(told)})


def tasks_table(tasks: list[str]) -> Any:
    """Return ``meta/tasks.parquet``: a pandas frame with the task's text as index and its number as the only column."""
    import pyarrow as pa

    columns = [
        {"name": "task_index", "field_name": "task_index", "pandas_type": "int64", "numpy_type": "int64", "metadata": None},
        {"name": "task", "field_name": "task", "pandas_type": "unicode", "numpy_type": "object", "metadata": None},
    ]
    names = {"name": None, "field_name": None, "pandas_type": "unicode", "numpy_type": "object", "metadata": {"encoding": "UTF-8"}}
    told = {"index_columns": ["task"], "column_indexes": [names], "columns": columns, "pandas_version": "2.0.0"}
    table = pa.table({"task_index": pa.array(range(len(tasks)), pa.int64()), "task": pa.array(tasks, pa.string())})
    return table.replace_schema_metadata({"pandas": json.dumps(told)})


def _info_row(feature: Feature) -> dict[str, Any]:
    row: dict[str, Any] = {
        "dtype": feature.dtype,
        "shape": list(feature.shape),
        "names": None if feature.names is None else list(feature.names),
    }
    return row if feature.info is None else row | {"info": dict(feature.info)}


def _datasets_row(feature: Feature) -> dict[str, Any]:
    if feature.dtype == "image":
        return {"_type": "Image"}
    value = {"dtype": feature.dtype, "_type": "Value"}
    return value if feature.shape == (1,) else {"feature": value, "length": feature.shape[0], "_type": "Sequence"}


def _arrow_type(pa: Any, dtype: str) -> Any:
    return pa.bool_() if dtype == "bool" else pa.type_for_alias(dtype)
