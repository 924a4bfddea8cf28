"""The columns of a LeRobot dataset: what each is, the action as motion from frame to frame, and the statistics of their values.

Names, dtypes, shapes and paths are those of ``lerobot/datasets/{utils,feature_utils,dataset_metadata}.py`` and ``utils/constants.py``
(huggingface/lerobot 7427f318, Apache-2.0), version v3.0 of the format.  Statistics are as ``lerobot/datasets/compute_stats.py`` there
defines them: minimum, maximum, mean, standard deviation and quantiles over the frames; of images per channel and over some pixels, with a
shape (channels, 1, 1); ``count`` is the number of frames.  Quantiles here are values that occur (the inverse of the distribution
function), there they are read off histograms.
"""

import json
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_description.products import matmul, norm
from scene_synth_ros.convert.writer import ConvertError

VERSION = "v3.0"
DATA_PATH = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
EPISODES_PATH = "meta/episodes/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
CHUNK_FILES = 1000
DATA_FILE_MB = 100
VIDEO_FILE_MB = 200
IMAGES = "observation.images."
DISTORTION_LENGTH = 14
"""Coefficients of the longest model that OpenCV knows; the models here have fewer, and zeros after them."""
QUANTILES = {"q01": 0.01, "q10": 0.10, "q50": 0.50, "q90": 0.90, "q99": 0.99}
_SIDE = 150
"""Images are thinned out to about so many pixels on the longer side."""
_TOLERANCE = 1e-4
"""Of a rate, relative: stamps are whole nanoseconds."""

Stats = dict[str, NDArray[Any]]


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


def whole_rate(stamps: Sequence[Sequence[int]]) -> int:
    """Return the frames a second at which most frames of some sequences follow each other; 1 where none follows another.

    Args:
        stamps: of each sequence, ns, ascending.

    Raises:
        ConvertError: it is no whole number.
    """
    periods = Counter(after - before for sequence in stamps for before, after in pairwise(sequence))
    if not periods:
        return 1
    most = max(periods.values())
    period = min(period for period, count in periods.items() if count == most)
    rate = 1e9 / period
    if round(rate) < 1 or abs(round(rate) - rate) > _TOLERANCE * rate:
        raise ConvertError(
            f"lerobot: expected a whole number of frames a second, got {rate:g}; take every N-th frame (--every N), "
            "or record at another rate (grammar_node.rate_hz)"
        )
    return round(rate)


def runs(stamps: Sequence[int], fps: int) -> list[slice]:
    """Return the runs of a sequence's frames in which each follows the one before at the rate, to a tenth of the period."""
    period = 1e9 / fps
    breaks = [n for n, (before, after) in enumerate(pairwise(stamps), 1) if abs(after - before - period) > 0.1 * period]
    return [slice(first, end) for first, end in pairwise([0, *breaks, len(stamps)])]


def camera_twists(world_from_optical: NDArray[np.float64], fps: int) -> NDArray[np.float64]:
    """Return the constant velocities that take each pose to the next: linear (m/s), then angular (rad/s), both in the optical frame.

    The angular velocity is the rotation vector of ``R_k^T R_{k+1}`` over the period; the linear one is the way between the places over the
    period, seen from frame k.  The last frame has zeros.

    Args:
        world_from_optical: (frames, 4, 4).
        fps: frames a second.
    """
    twists = np.zeros((len(world_from_optical), 6))
    rotations, places = world_from_optical[:, :3, :3], world_from_optical[:, :3, 3]
    twists[:-1, :3] = matmul(np.diff(places, axis=0)[:, None], rotations[:-1])[:, 0] * fps
    for number, (before, after) in enumerate(pairwise(rotations)):
        twists[number, 3:] = rotation_vector(matmul(before.T, after)) * fps
    return twists


def rotation_vector(rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return axis times angle (rad) of a rotation matrix (3, 3) that turns by less than half a turn."""
    axis = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    sine, cosine = float(norm(axis)) / 2.0, (float(np.trace(rotation)) - 1.0) / 2.0
    angle = math.atan2(sine, cosine)
    return axis / 2.0 * (angle / sine if sine > 1e-12 else 1.0)


def thinned(pixels: NDArray[Any]) -> NDArray[Any]:
    """Return every n-th row and column of an image as (pixels, channels)."""
    step = max(1, max(pixels.shape[:2]) // _SIDE)
    return pixels[::step, ::step].reshape(-1, 1 if pixels.ndim == 2 else pixels.shape[2])


def vector_stats(values: NDArray[Any]) -> Stats:
    """Return the statistics of a feature, values (frames, size)."""
    return _stats(values.astype(np.float64), len(values))


def image_stats(samples: Sequence[NDArray[Any]], scale: float) -> Stats:
    """Return the statistics of images from their thinned pixels, divided by ``scale``; pixels that are not finite are left out."""
    pixels = np.concatenate(samples).astype(np.float64) / scale
    finite = pixels[np.isfinite(pixels).all(axis=1)]
    stats = _stats(finite if len(finite) else np.zeros((1, pixels.shape[1])), len(samples))
    return {name: value if name == "count" else value.reshape(-1, 1, 1) for name, value in stats.items()}


def together(episodes: Sequence[Mapping[str, Stats]]) -> dict[str, Stats]:
    """Return the statistics of all episodes: exact but for the quantiles, which are bounds, as in LeRobot's own ``aggregate_stats``."""
    return {key: _merged([episode[key] for episode in episodes]) for key in episodes[0]}


def _stats(values: NDArray[np.float64], count: int) -> Stats:
    stats: Stats = {
        "min": values.min(axis=0),
        "max": values.max(axis=0),
        "mean": values.mean(axis=0),
        "std": values.std(axis=0),
        "count": np.array([count], np.int64),
    }
    quantiles = np.quantile(values, list(QUANTILES.values()), axis=0, method="inverted_cdf")
    return stats | dict(zip(QUANTILES, quantiles, strict=True))


def _merged(parts: Sequence[Stats]) -> Stats:
    counts = np.array([part["count"][0] for part in parts], np.float64)
    weights = (counts / counts.sum()).reshape(-1, *[1] * parts[0]["mean"].ndim)
    means = np.stack([part["mean"] for part in parts])
    squares = np.stack([part["std"] ** 2 for part in parts])
    mean = (weights * means).sum(axis=0)
    merged: Stats = {
        "min": np.min([part["min"] for part in parts], axis=0),
        "max": np.max([part["max"] for part in parts], axis=0),
        "mean": mean,
        "std": np.sqrt((weights * (squares + (means - mean) ** 2)).sum(axis=0)),
        "count": np.array([int(counts.sum())], np.int64),
    }
    for name, share in QUANTILES.items():
        merged[name] = (np.min if share <= 0.5 else np.max)([part[name] for part in parts], axis=0)
    return merged
