"""HDF5: one file, in it a group for each room and camera with an array for each layer, through ``h5py`` (BSD-3-Clause), the extra ``hdf5``.

Each frame is a chunk of its own, compressed by filters that every HDF5 library has (shuffle, deflate).  The chunks are compressed in the
threads of the encoder and stored as they are (``H5Dwrite_chunk``), because the library itself lets one thread in at a time.
"""

from __future__ import annotations

import zlib
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_synth_ros.convert.frame_record import frame_record, json_bytes, label_tables, scene_text
from scene_synth_ros.convert.writer import ConvertError, Sequence, Source, Writer

if TYPE_CHECKING:
    from scene_synth_ros.dataset import Frame


SCHEMA = "scene_synth_hdf5/1"
FILE = "rooms.h5"
_LEVEL = 1
_COLUMNS = {
    "stamp_ns": np.int64,
    "frame": np.int64,
    "K": np.float64,
    "D": np.float64,
    "position_m": np.float64,
    "quaternion_xyzw": np.float64,
    "world_from_optical": np.float64,
}
"""Key of a frame's record -> dtype of the array that holds it for all frames."""
_TEXTS = ("labels", "scene")
"""Of a whole room."""
_CONSTANTS = ("room", "room_type", "seed", "camera", "width", "height", "distortion_model", "row_time_s")
"""Keys of a frame's record that are attributes of the group."""


class _Chunk(NamedTuple):
    """A compressed layer of a frame, with the shape and dtype of its pixels."""

    data: bytes
    shape: tuple[int, ...]
    dtype: np.dtype[Any]


class _Encoded(NamedTuple):
    """A frame; ``texts`` are those of its whole room, with the first frame only."""

    record: dict[str, Any]
    chunks: dict[str, _Chunk]
    texts: dict[str, str]


class _Group:
    """A sequence on its way."""

    def __init__(self, sequence: Sequence) -> None:
        self.sequence = sequence
        self.records: list[dict[str, Any]] = []


class FormatWriter(Writer):
    """Writes ``rooms.h5``."""

    def begin(self, out: Path, source: Source) -> None:
        """Take folder and source.

        Raises:
            ConvertError: the library is missing, or a layer is called like what the file has beside layers.
        """
        for layer in source.layers:
            if layer in (*_COLUMNS, *_TEXTS):
                raise ConvertError(f"hdf5: layer {layer}: the name is taken; name the layers that you want: --layers NAME ...")
        try:
            import h5py
        except ImportError:
            raise ConvertError("hdf5: expected the library h5py, got none; install scene_synth_ros[hdf5]") from None
        super().begin(out, source)
        self._file = h5py.File(out / FILE, "w", libver=("v108", "v108"))
        self._file.attrs["schema"] = SCHEMA
        self._file.attrs["layers"] = list(source.layers)

    def begin_sequence(self, sequence: Sequence) -> _Group:
        """Return what is gathered of a sequence."""
        return _Group(sequence)

    def encode(self, frame: Frame, number: int, state: _Group) -> _Encoded:
        """Compress the layers of a frame."""
        chunks = {layer: _chunk(frame[layer]) for layer in self.source.layers}
        texts = {}
        if number == 0:
            texts["labels"] = json_bytes(label_tables(frame, self.source.layers, self.tell)).decode()
            if (scene := scene_text(frame, self.tell)) is not None:
                texts["scene"] = scene
        return _Encoded(frame_record(frame), chunks, texts)

    def take(self, item: _Encoded, state: _Group) -> None:
        """Store the chunks of a frame.

        Raises:
            ConvertError: a layer has another shape than in the frames before.
        """
        group = self._file.require_group(state.sequence.name)
        number = len(state.records)
        for name, text in item.texts.items():
            group.create_dataset(name, data=text)
        for layer, chunk in item.chunks.items():
            if layer not in group:
                shape = (len(state.sequence.frames), *chunk.shape)
                filters = {"compression": "gzip", "compression_opts": _LEVEL, "shuffle": chunk.dtype.itemsize > 1}
                group.create_dataset(layer, shape, chunk.dtype, chunks=(1, *chunk.shape), track_times=False, **filters)
            array = group[layer]
            if array.shape[1:] != chunk.shape or array.dtype != chunk.dtype:
                expected, got = f"{array.dtype} {array.shape[1:]}", f"{chunk.dtype} {chunk.shape}"
                raise ConvertError(f"hdf5: {state.sequence.name}: {layer}: expected {expected} in all frames, got {got} in frame {number}")
            array.id.write_direct_chunk((number, *(0 for _ in chunk.shape)), chunk.data)
        state.records.append(item.record)

    def end_sequence(self, state: _Group) -> None:
        """Store cameras, poses and stamps of the frames.

        Raises:
            ConvertError: the frames have different cameras.
        """
        group = self._file[state.sequence.name]
        for key in _CONSTANTS:
            values = {record[key] for record in state.records}
            if len(values) > 1:
                raise ConvertError(f"hdf5: {state.sequence.name}: expected one {key} in a room, got {', '.join(sorted(map(str, values)))}")
            group.attrs[key] = values.pop()
        for key, dtype in _COLUMNS.items():
            column = [record[key] for record in state.records]
            if len(set(map(np.shape, column))) > 1:
                raise ConvertError(f"hdf5: {state.sequence.name}: expected as many numbers of {key} in all frames, got other counts")
            group.create_dataset(key, data=np.array(column, dtype), track_times=False)

    def finish(self) -> tuple[str, ...]:
        """Close the file."""
        self._file.close()
        return super().finish()


def _chunk(pixels: NDArray[Any]) -> _Chunk:
    """Return pixels as HDF5's shuffle and deflate filters have them: first bytes of all values, then second bytes, and so on."""
    plain = np.ascontiguousarray(pixels)
    little = plain.astype(plain.dtype.newbyteorder("<"), copy=False)
    size = plain.dtype.itemsize
    data = little.view(np.uint8).reshape(-1, size).T.tobytes() if size > 1 else little.tobytes()
    return _Chunk(zlib.compress(data, _LEVEL), plain.shape, plain.dtype)
