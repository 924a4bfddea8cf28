"""The plain folders of ``frames`` with OpenEXR in place of NPZ."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from renderer import LAYERS
from renderer.files.exr_files import is_installed, write_exr
from scene_synth_ros.convert import frames
from scene_synth_ros.convert.errors import ConvertError
from scene_synth_ros.convert.writer import Source


class FormatWriter(frames.FormatWriter):
    """Writes layers of floating-point numbers as ``.exr``, with the channel names of ``scene_synth render --exr``."""

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
