"""Path-traced pictures that others are compared with: kept in a folder, so that only the first run waits for them."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.sampled_rooms import SampledRoom, camera_of, preset_config
from renderer import Renderer
from scene_description import CameraPose
from scene_description.whole import whole_file


class Reference(NamedTuple):
    """One view by the path tracer: color and color_noisy, (h, w, 3) uint8, after and before the denoiser; radiance, (h, w, 3) float32."""

    color: NDArray[np.uint8]
    color_noisy: NDArray[np.uint8]
    radiance: NDArray[np.float32]


class References:
    """References of the preset ``photo`` (exact textures, 32 segments, no limit, denoised) with so many samples a pixel.

    A file of the folder is one view; its name tells room, scene key, camera pose, size and samples, and it is rendered anew where the
    exposure of the room has changed since.
    """

    def __init__(self, folder: Path | None, samples: int) -> None:
        """Keep pictures in ``folder``; None keeps none."""
        self._folder, self.samples = folder, samples
        self._config = preset_config("photo", samples_per_pixel=samples, denoise="oidn")

    def path_of(self, room: SampledRoom, view: int, size: tuple[int, int]) -> Path | None:
        """Return where the picture of a view is kept."""
        if self._folder is None:
            return None
        shape = f"{size[0]}x{size[1]}"
        return self._folder / f"{room.name.replace(' ', '_')}_{room.key:016x}_{_digest(room.path[view])}_{shape}_{self.samples}.npz"

    def view(self, room: SampledRoom, view: int, size: tuple[int, int]) -> Reference:
        """Return the picture of a room from the pose ``view`` of its path, of (width, height) pixels; rendered if it is not kept."""
        path = self.path_of(room, view, size)
        if path is not None and path.exists():
            with np.load(path) as kept:
                if kept["ev100"] == room.exposure.ev100 and np.array_equal(kept["white_xy"], room.exposure.white_xy):
                    return Reference(kept["color"], kept["color_noisy"], kept["radiance"])
        with Renderer(room.flat, camera_of(size), self._config, room.key) as renderer:
            frame = renderer.render(room.path[view], view, ("color", "color_noisy"), exposure=room.exposure)
        assert frame.radiance is not None
        found = Reference(np.asarray(frame.layers["color"]), np.asarray(frame.layers["color_noisy"]), frame.radiance)
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            with whole_file(path) as partial, partial.open("wb") as file:
                np.savez_compressed(file, **found._asdict(), ev100=room.exposure.ev100, white_xy=np.array(room.exposure.white_xy))
        return found


def _digest(pose: CameraPose) -> str:
    return hashlib.blake2b(np.array([*pose.position_m, *pose.orientation]).tobytes(), digest_size=4).hexdigest()
