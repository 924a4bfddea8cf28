"""Plain folders: a folder for each room, in it one for each layer with a file for each frame, and JSON for everything else."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer import LAYERS
from renderer.files.exr_files import is_installed, write_exr
from scene_synth_ros.convert.files import npz_file, picture_file, write_json
from scene_synth_ros.convert.frame_record import frame_record, json_bytes, label_tables, scene_text
from scene_synth_ros.convert.writer import ConvertError, Sequence, Source, Writer

if TYPE_CHECKING:
    from scene_synth_ros.dataset import Frame

SCHEMA = "scene_synth_frames/1"


class _Room(NamedTuple):
    """A sequence on its way: its folder, and a record for each frame taken."""

    folder: Path
    records: list[dict[str, Any]]


class FormatWriter(Writer):
    """Writes ``<sequence>/<layer>/<frame>.png`` or ``.npz``, ``<sequence>/frames.json``, ``labels.json`` and ``scene.json``."""

    float_suffix = "npz"

    def begin_sequence(self, sequence: Sequence) -> _Room:
        """Make the folders."""
        folder = self.out / sequence.name
        for layer in self.source.layers:
            (folder / layer).mkdir(parents=True)
        return _Room(folder, [])

    def encode(self, frame: Frame, number: int, state: _Room) -> dict[str, Any]:
        """Write the files of a frame; return its record."""
        names = {}
        for layer in self.source.layers:
            found = picture_file(frame, layer)
            suffix = found[0] if found else self.float_suffix
            names[layer] = f"{layer}/{frame.number:06d}.{suffix}"
            path = state.folder / names[layer]
            if found:
                path.write_bytes(found[1])
            else:
                self.write_floats(path, layer, frame[layer])
        if number == 0:
            (state.folder / "labels.json").write_bytes(json_bytes(label_tables(frame, self.source.layers, self.tell)))
            if (scene := scene_text(frame, self.tell)) is not None:
                (state.folder / "scene.json").write_text(scene, encoding="utf-8")
        return frame_record(frame) | {"files": names}

    def take(self, item: dict[str, Any], state: _Room) -> None:
        """Keep the record."""
        state.records.append(item)

    def end_sequence(self, state: _Room) -> None:
        """Write what goes with the frames."""
        document = {"schema": SCHEMA, "frames": state.records}
        write_json(state.folder / "frames.json", document)

    def write_floats(self, path: Path, layer: str, pixels: NDArray[np.float32]) -> None:
        """Write a layer of floating-point numbers."""
        path.write_bytes(npz_file(layer, pixels))


class ExrFormatWriter(FormatWriter):
    """Writes the same folders with layers of floating-point numbers as ``.exr``, with the channel names of ``scene_synth render --exr``."""

    float_suffix = "exr"

    def begin(self, out: Path, source: Source) -> None:
        """Take folder and source.

        Raises:
            ConvertError: the library is missing.
        """
        if not is_installed():
            raise ConvertError("frames_exr: expected the library OpenEXR, got none; install scene_synth_ros[exr], or convert to frames")
        super().begin(out, source)

    def write_floats(self, path: Path, layer: str, pixels: NDArray[np.float32]) -> None:
        """Write a layer, channel by channel."""
        planes = pixels.reshape(*pixels.shape[:2], -1)
        names = LAYERS[layer].exr if layer in LAYERS else ()
        channels = names if len(names) == planes.shape[2] else tuple(f"{layer}.{number}" for number in range(planes.shape[2]))
        write_exr(path, {name: planes[..., number] for number, name in enumerate(channels)})
