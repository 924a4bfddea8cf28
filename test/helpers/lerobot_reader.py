"""A strict reader of LeRobotDataset v3.0, made from the format's published source alone; it knows nothing of what wrote a dataset.

From huggingface/lerobot 7427f318, src/lerobot: ``datasets/utils.py`` (paths, DatasetInfo), ``datasets/feature_utils.py`` (dtypes),
``utils/constants.py`` (DEFAULT_FEATURES), ``datasets/dataset_writer.py`` (episodes, row groups), ``datasets/io_utils.py`` (tasks, images),
``datasets/compute_stats.py`` (shapes of statistics), ``configs/video.py`` (depth maps).
"""

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import pyarrow as pa
import pyarrow.parquet as pq
from PIL import Image

INFO = {
    "codebase_version": str, "fps": int, "features": dict, "total_episodes": int, "total_frames": int, "total_tasks": int,
    "chunks_size": int, "data_files_size_in_mb": int, "video_files_size_in_mb": int, "data_path": str, "robot_type": str, "splits": dict,
}  # fmt: skip
DEFAULTS = {
    "timestamp": {"dtype": "float32", "shape": [1], "names": None},
    **{name: {"dtype": "int64", "shape": [1], "names": None} for name in ("frame_index", "episode_index", "index", "task_index")},
}
STATISTICS = {"min", "max", "mean", "std", "count", "q01", "q10", "q50", "q90", "q99"}
IMAGE = pa.struct([("bytes", pa.binary()), ("path", pa.string())])


class LeRobotFolder:
    """A dataset; every rule that it breaks is an AssertionError.

    Attributes:
        info: ``meta/info.json``.
        stats: ``meta/stats.json``.
        tasks: text of each task.
        episodes: rows of ``meta/episodes``.
        rows: of ``data``, in order, images as arrays.
    """

    def __init__(self, root: Path) -> None:
        self.info = json.loads((root / "meta/info.json").read_text())
        for key, kind in INFO.items():
            assert isinstance(self.info[key], kind), key
        assert (self.info["codebase_version"], self.info["video_path"]) == ("v3.0", None)
        assert self.info["data_path"] == "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
        self.features = self.info["features"]
        assert all(self.features[key] == row for key, row in DEFAULTS.items())
        assert not any("/" in key for key in self.features)
        tasks = pandas.read_parquet(root / "meta/tasks.parquet")
        assert (tasks.index.name, list(tasks.columns), len(tasks)) == ("task", ["task_index"], self.info["total_tasks"])
        assert tasks["task_index"].tolist() == list(range(len(tasks)))
        self.tasks = list(tasks.index)
        self.episodes = [row for path in sorted((root / "meta/episodes").glob("*/*.parquet")) for row in pq.read_table(path).to_pylist()]
        assert [row["episode_index"] for row in self.episodes] == list(range(self.info["total_episodes"]))
        self.rows = [row for episode in self.episodes for row in self._episode(root, episode)]
        assert [row["index"] for row in self.rows] == list(range(self.info["total_frames"]))
        self.stats = json.loads((root / "meta/stats.json").read_text())
        self._check_stats(self.stats)

    def _episode(self, root: Path, episode: dict[str, Any]) -> list[dict[str, Any]]:
        where = {key: episode[f"data/{key}"] for key in ("chunk_index", "file_index")}
        assert episode["meta/episodes/chunk_index"] == episode["meta/episodes/file_index"] == 0
        file = pq.ParquetFile(root / self.info["data_path"].format(**where))
        self._check_schema(file.schema_arrow)
        first = min(row["dataset_from_index"] for row in self.episodes if all(row[f"data/{key}"] == value for key, value in where.items()))
        table = file.read().slice(episode["dataset_from_index"] - first, episode["length"])
        assert episode["dataset_to_index"] - episode["dataset_from_index"] == episode["length"] == len(table)
        assert file.metadata.num_row_groups == len([row for row in self.episodes if row["data/file_index"] == where["file_index"]])
        rows = table.to_pylist()
        for number, row in enumerate(rows):
            assert (row["episode_index"], row["frame_index"]) == (episode["episode_index"], number)
            assert abs(row["timestamp"] - number / self.info["fps"]) < 1e-4
            assert self.tasks[row["task_index"]] in episode["tasks"]
            row |= {key: self._pixels(key, row[key]) for key, feature in self.features.items() if feature["dtype"] == "image"}
        self._check_stats({key: {name: episode[f"stats/{key}/{name}"] for name in STATISTICS} for key in self._counted()})
        return rows

    def _check_schema(self, schema: pa.Schema) -> None:
        assert schema.names == list(self.features)
        for key, row in self.features.items():
            if row["dtype"] == "image":
                kind = IMAGE
            else:
                kind = {"bool": pa.bool_()}.get(row["dtype"]) or pa.type_for_alias(row["dtype"])
                kind = kind if row["shape"] == [1] else pa.list_(kind, row["shape"][0])
            assert schema.field(key).type == kind, key

    def _pixels(self, key: str, value: dict[str, Any]) -> np.ndarray:
        """Return an image as lerobot's ``hf_transform_to_torch`` gets it, channels last."""
        picture, row = Image.open(io.BytesIO(value["bytes"])), self.features[key]
        assert row["names"] == ["height", "width", "channels"]
        depth = row["info"]["is_depth_map"]
        assert picture.mode in ({"F"} if depth else {"RGB", "I;16"})
        assert not depth or row["info"]["depth_unit"] == "m"
        pixels = np.asarray(picture)
        assert [*pixels.shape, *([1] if pixels.ndim == 2 else [])] == row["shape"]
        return pixels

    def _counted(self) -> list[str]:
        return [key for key, row in self.features.items() if row["dtype"] != "string"]

    def _check_stats(self, stats: dict[str, dict[str, Any]]) -> None:
        assert sorted(stats) == sorted(self._counted())
        for key, values in stats.items():
            assert values.keys() == STATISTICS
            row = self.features[key]
            shape = (row["shape"][2], 1, 1) if row["dtype"] == "image" else tuple(row["shape"])
            assert all(np.shape(value) == ((1,) if name == "count" else shape) for name, value in values.items()), key
            assert all(np.isfinite(value).all() for value in values.values()), key
