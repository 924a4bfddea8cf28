"""WebDataset: tar files of a few hundred megabytes, in which the files of one frame follow each other under one key.

Written as https://github.com/webdataset/webdataset (README, "The WebDataset Format") has it: plain POSIX tar; the key is what stands before
the first dot of a member's name.  Owners and times are zero, so equal frames give equal bytes.
"""

from __future__ import annotations

import hashlib
import io
import tarfile
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, cast

from scene_synth_ros.convert.files import npy_file, picture_file, write_json
from scene_synth_ros.convert.frame_record import frame_record, id_layers, json_bytes, label_tables, scene_text
from scene_synth_ros.convert.writer import Sequence, Source, Writer

if TYPE_CHECKING:
    from scene_synth_ros.dataset import Frame


SCHEMA = "scene_synth_webdataset/1"
SHARD_BYTES = 256 * 2**20
"""A tar file gets no further frame that would take it beyond this."""
_BLOCK = tarfile.BLOCKSIZE


class FormatWriter(Writer):
    """Writes ``shard-<number>.tar``, ``rooms/<room>.json`` and ``shards.json``."""

    def begin(self, out: Path, source: Source) -> None:
        """Begin with no shard."""
        super().begin(out, source)
        self._members: dict[str, str] = {}
        self._shards: list[dict[str, Any]] = []
        self._tar: tarfile.TarFile | None = None
        self._size = self._samples = 0
        (out / "rooms").mkdir()

    def encode(self, frame: Frame, number: int, state: Sequence) -> tuple[str, list[tuple[str, bytes]]]:
        """Return key and members of a sample, by name."""
        files = {"frame.json": json_bytes(frame_record(frame))}
        if id_layers(self.source.layers):
            files["labels.json"] = json_bytes(label_tables(frame, self.source.layers, self.tell))
        for layer in self.source.layers:
            suffix, data = picture_file(frame, layer) or ("npy", npy_file(frame[layer]))
            files[f"{layer}.{suffix}"] = data
            self._members[layer] = f"{layer}.{suffix}"
        if number == 0 and state.place == 0 and (scene := scene_text(frame, self.tell)) is not None:
            (self.out / "rooms" / f"{state.folder}.json").write_text(scene, encoding="utf-8")
        return f"{state.name}_{frame.number:06d}", sorted(files.items())

    def take(self, item: tuple[str, list[tuple[str, bytes]]], state: Sequence) -> None:
        """Append a sample, to a new shard where the old one is full."""
        key, files = item
        size = sum(_BLOCK + -(-len(data) // _BLOCK) * _BLOCK for _, data in files)
        if self._tar is None or self._size + size > SHARD_BYTES:
            self._next_shard()
        assert self._tar is not None
        for name, data in files:
            member = tarfile.TarInfo(f"{key}.{name}")
            member.size, member.mode = len(data), 0o444
            self._tar.addfile(member, io.BytesIO(data))
        self._size += size
        self._samples += 1

    def finish(self) -> tuple[str, ...]:
        """Close the last shard and write the index."""
        self._close_shard()
        document = {
            "schema": SCHEMA,
            "layers": {layer: self._members[layer] for layer in self.source.layers},
            "samples": sum(shard["samples"] for shard in self._shards),
            "shards": self._shards,
        }
        write_json(self.out / "shards.json", document)
        return super().finish()

    def _next_shard(self) -> None:
        self._close_shard()
        self._path = self.out / f"shard-{len(self._shards):06d}.tar"
        self._file = _HashedFile(self._path)
        self._tar = tarfile.open(fileobj=cast("IO[bytes]", self._file), mode="w|", format=tarfile.PAX_FORMAT)
        self._size = self._samples = 0

    def _close_shard(self) -> None:
        if self._tar is None:
            return
        self._tar.close()
        self._file.close()
        shard = {"name": self._path.name, "samples": self._samples, "bytes": self._file.size, "sha256": self._file.sha256}
        self._shards.append(shard)
        self._tar = None


class _HashedFile:
    """A file that is written once, front to back, and knows its length and SHA-256."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("wb")
        self._hash = hashlib.sha256()
        self.size = 0

    def write(self, data: bytes) -> int:
        """Append bytes."""
        self._hash.update(data)
        self.size += len(data)
        return self._file.write(data)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    @property
    def sha256(self) -> str:
        """Of what was written."""
        return self._hash.hexdigest()
