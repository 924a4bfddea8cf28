"""LeRobotDataset v3.0: the camera's paths as episodes, pictures in Parquet, through ``pyarrow`` (Apache-2.0), the extra ``lerobot``.

An episode is an unbroken run of the frames of a room.  ``observation.state`` is the pose of the optical frame in the map, ``action`` the
velocity of the camera until the next frame.  Colour is PNG or the recorded JPEG; depth is TIFF with the recorded float32 values, which
LeRobot reads as a depth map in metres; ids are PNG of 16 bits.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer import LAYERS
from renderer.files.image_io import encode_image
from scene_synth_ros.convert.files import picture_file, png_bytes, write_json
from scene_synth_ros.convert.formats import lerobot_columns as schema
from scene_synth_ros.convert.formats.lerobot_columns import (
    Stats,
    camera_twists,
    image_stats,
    runs,
    thinned,
    together,
    vector_stats,
    whole_rate,
)
from scene_synth_ros.convert.frame_record import frame_record
from scene_synth_ros.convert.writer import ConvertError, Sequence, Source, Writer

if TYPE_CHECKING:
    from scene_synth_ros.dataset import Frame


_TIMED = 100
"""Rooms from whose stamps the rate is told."""
_EPISODES = 1000
"""Episodes that are kept until they are written."""


class _Item(NamedTuple):
    """A frame: its record, its images as files, and some of their pixels."""

    record: dict[str, Any]
    images: dict[str, bytes]
    samples: dict[str, NDArray[Any]]
    features: dict[str, schema.Feature]


class FormatWriter(Writer):
    """Writes ``data/``, ``meta/info.json``, ``meta/stats.json``, ``meta/tasks.parquet`` and ``meta/episodes/``."""

    def begin(self, out: Path, source: Source) -> None:
        """Take folder and source.

        Raises:
            ConvertError: pyarrow is missing, or frames do not follow each other at a whole rate.
        """
        try:
            import pyarrow.parquet
        except ImportError:
            raise ConvertError("lerobot: expected the library pyarrow, got none; install scene_synth_ros[lerobot]") from None
        self._parquet = pyarrow.parquet
        super().begin(out, source)
        self._layers = (*source.roles.values(), *source.layers)
        sequences = source.sequences[:_TIMED]
        self._fps = whole_rate([[source.frame(one, place).stamp_ns for place in range(len(one.frames))] for one in sequences])
        self._features: dict[str, schema.Feature] = {}
        self._tasks: list[str] = []
        self._episodes: list[dict[str, Any]] = []
        self._stats: dict[str, Stats] | None = None
        self._rows: Any = None
        self._path = out
        self._episode_rows: Any = None
        self._file_index = self._frames = self._count = 0

    def begin_sequence(self, sequence: Sequence) -> list[_Item]:
        """Return what gathers the frames of a room."""
        del sequence
        return []

    def encode(self, frame: Frame, number: int, state: list[_Item]) -> _Item:
        """Encode the images of a frame.

        Raises:
            ConvertError: LeRobot has no image for a layer.
        """
        images, samples, features = {}, {}, {}
        for layer in self._layers:
            pixels = frame[layer]
            if pixels.dtype.kind == "f" and pixels.ndim == 3:
                raise ConvertError(
                    f"--layers {layer}: lerobot has no images of several floating-point numbers a pixel; convert to webdataset or hdf5"
                )
            channels = 1 if pixels.ndim == 2 else pixels.shape[2]
            in_metres = layer in LAYERS and LAYERS[layer].unit == "m"
            name, row = schema.image_feature(layer, pixels.shape[0], pixels.shape[1], channels, metres=in_metres)
            images[name], samples[name], features[name] = _image(frame, layer, pixels), thinned(pixels), row
        return _Item(frame_record(frame), images, samples, features)

    def take(self, item: _Item, state: list[_Item]) -> None:
        """Keep a frame until its room is complete.

        Raises:
            ConvertError: its images have another size than those before.
        """
        if not self._features:
            self._features = item.features | schema.VALUES
        for name, row in item.features.items():
            if row != self._features[name]:
                expected = self._features[name].shape
                raise ConvertError(
                    f"lerobot: {name}: expected images of one size, got {expected} and {row.shape}; take --rooms or --camera"
                )
        state.append(item)

    def end_sequence(self, state: list[_Item]) -> None:
        """Write the episodes of a room."""
        for run in runs([item.record["stamp_ns"] for item in state], self._fps):
            self._write_episode(state[run])

    def finish(self) -> tuple[str, ...]:
        """Write what is known of the whole."""
        self._close_rows()
        meta = self.out / "meta"
        info = schema.info_document(
            self._features,
            fps=self._fps,
            episodes=self._count,
            frames=self._frames,
            tasks=len(self._tasks),
            split=self.source.split or "train",
        )
        self._write_episodes()
        self._episode_rows.close()
        self._parquet.write_table(schema.tasks_table(self._tasks), meta / "tasks.parquet", compression="snappy")
        write_json(meta / "info.json", info, indent=4)
        stats = {key: _plain(values) for key, values in (self._stats or {}).items()}
        write_json(meta / "stats.json", stats, indent=4)
        return super().finish()

    def _write_episode(self, items: list[_Item]) -> None:
        first, number = items[0].record, self._count
        task = f"Look around the {first['room_type'].replace('_', ' ')}."
        if task not in self._tasks:
            self._tasks.append(task)
        columns = self._columns(items, number, self._tasks.index(task))
        where = self._write_rows(columns)
        stats = {name: vector_stats(_matrix(columns[name])) for name, row in schema.VALUES.items() if row.dtype != "string"}
        for name in items[0].images:
            scale = 255.0 if items[0].samples[name].dtype == np.uint8 and self._features[name].shape[2] == 3 else 1.0
            stats[name] = image_stats([item.samples[name] for item in items], scale)
        self._stats = stats if self._stats is None else together([self._stats, stats])
        episode = {"episode_index": number, "tasks": [task], "length": len(items), **where}
        episode |= {"dataset_from_index": self._frames, "dataset_to_index": self._frames + len(items)}
        episode |= {"meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0}
        episode |= {key: first[key] for key in ("room", "room_type", "seed", "camera")}
        episode |= {f"stats/{key}/{name}": value for key, values in stats.items() for name, value in _plain(values).items()}
        self._episodes.append(episode)
        self._frames += len(items)
        self._count += 1
        if len(self._episodes) == _EPISODES:
            self._write_episodes()

    def _write_episodes(self) -> None:
        """Write what is known of the episodes since the last time."""
        import pyarrow as pa

        if self._episode_rows is None:
            path = self.out / schema.EPISODES_PATH.format(chunk_index=0, file_index=0)
            path.parent.mkdir(parents=True)
            types = pa.Table.from_pylist(self._episodes).schema
            self._episode_rows = self._parquet.ParquetWriter(path, types, compression="snappy")
        if self._episodes:
            self._episode_rows.write_table(pa.Table.from_pylist(self._episodes, self._episode_rows.schema))
            self._episodes = []

    def _columns(self, items: list[_Item], episode: int, task: int) -> dict[str, Any]:
        records, count = [item.record for item in items], len(items)
        poses = np.array([record["world_from_optical"] for record in records])
        distortion = np.zeros((count, schema.DISTORTION_LENGTH))
        for row, record in zip(distortion, records, strict=True):
            if any(record["D"][schema.DISTORTION_LENGTH :]):
                expected = f"expected at most {schema.DISTORTION_LENGTH} coefficients of the lens, got {len(record['D'])}"
                raise ConvertError(f"lerobot: camera {record['camera']}: {expected}; rectify the images")
            row[: len(record["D"])] = record["D"][: schema.DISTORTION_LENGTH]
        state = [[*record["position_m"], *record["quaternion_xyzw"]] for record in records]
        values: dict[str, Any] = {
            "observation.state": np.array(state, np.float32),
            "action": camera_twists(poses, self._fps).astype(np.float32),
            "next.done": np.arange(count) == count - 1,
            "camera.K": np.array([record["K"] for record in records]).reshape(count, 9),
            "camera.D": distortion,
            "camera.distortion_model": [record["distortion_model"] for record in records],
            "camera.row_time_s": np.array([record["row_time_s"] for record in records]),
            "stamp_ns": np.array([record["stamp_ns"] for record in records]),
            "room": np.array([record["room"] for record in records]),
            "room_frame": np.array([record["frame"] for record in records]),
            "timestamp": (np.arange(count) / self._fps).astype(np.float32),
            "frame_index": np.arange(count),
            "episode_index": np.full(count, episode),
            "index": np.arange(self._frames, self._frames + count),
            "task_index": np.full(count, task),
        }
        for name in items[0].images:
            file = f"{name}/episode-{episode:06d}/frame-{{:06d}}"
            values[name] = [{"bytes": item.images[name], "path": file.format(k)} for k, item in enumerate(items)]
        return {name: values[name] for name in self._features}

    def _write_rows(self, columns: dict[str, Any]) -> dict[str, int]:
        """Write an episode as a row group of its own, to a new file where the old one is full; return where it is."""
        import pyarrow as pa

        types = schema.arrow_schema(self._features)
        arrays = [_array(pa, columns[field.name], field.type) for field in types]
        table = pa.Table.from_arrays(arrays, schema=types)
        if self._rows is not None and self._path.stat().st_size + table.nbytes > schema.DATA_FILE_MB * 2**20:
            self._close_rows()
            self._file_index += 1
        where = dict(zip(("chunk_index", "file_index"), divmod(self._file_index, schema.CHUNK_FILES), strict=True))
        if self._rows is None:
            self._path = self.out / schema.DATA_PATH.format(**where)
            self._path.parent.mkdir(parents=True, exist_ok=True)
            plain = [name for name, row in self._features.items() if row.dtype != "image"]
            self._rows = self._parquet.ParquetWriter(self._path, types, compression="snappy", use_dictionary=plain, write_statistics=plain)
        self._rows.write_table(table, row_group_size=len(table))
        return {f"data/{name}": value for name, value in where.items()}

    def _close_rows(self) -> None:
        if self._rows is not None:
            self._rows.close()
            self._rows = None


def _image(frame: Frame, layer: str, pixels: NDArray[Any]) -> bytes:
    """Return a layer as the file that LeRobot decodes to its values."""
    if pixels.dtype.kind == "f":
        return encode_image(pixels, "tiff")
    if pixels.ndim == 2:
        return png_bytes(pixels.astype(np.uint16, copy=False))
    found = picture_file(frame, layer)
    assert found is not None
    return found[1]


def _array(pa: Any, values: Any, kind: Any) -> Any:
    if isinstance(values, np.ndarray) and values.ndim == 2:
        flat = pa.array(values.ravel(), kind.value_type)
        return pa.FixedSizeListArray.from_arrays(flat, type=kind)
    return pa.array(values, kind)


def _matrix(values: NDArray[Any]) -> NDArray[Any]:
    return values.reshape(len(values), -1)


def _plain(stats: Stats) -> dict[str, list[Any]]:
    return {name: value.tolist() for name, value in stats.items()}
