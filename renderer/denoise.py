"""Denoising by Intel Open Image Denoise (Apache-2.0), through its binding ``pyoidn`` (MIT); the extra ``denoise`` installs both.

The network takes the mean radiance with albedo and normal of the first hits, or of what mirrors and clear glass show, as guides (Open
Image Denoise, documentation of the filter RT).
"""

from __future__ import annotations

import importlib.util
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.errors import RenderError

_HINT = "install scene_synth_ros[denoise], or set render.denoise to none or auto"


@cache
def is_installed() -> bool:
    """Return whether the denoiser can be used."""
    return importlib.util.find_spec("pyoidn") is not None


def is_asked(choice: str) -> bool:
    """Return whether ``render.denoise`` asks for denoising here.

    Raises:
        RenderError: it does, but the denoiser is not installed.
    """
    if choice == "oidn" and not is_installed():
        raise RenderError(f"render.denoise: expected pyoidn for 'oidn', got none installed; {_HINT}")
    return choice == "oidn" or (choice == "auto" and is_installed())


class Denoiser:
    """Open Image Denoise on this many threads; free to be made anew, but loading it takes some 0.1 s.

    Raises:
        RenderError: the library cannot be loaded or set up.
    """

    def __init__(self, threads: int) -> None:
        try:
            import pyoidn
        except (ImportError, OSError) as error:
            raise RenderError(f"render.denoise: expected pyoidn to load, got {error}; {_HINT}") from error
        self._oidn: Any = pyoidn
        self._device = pyoidn.Device(pyoidn.OIDN_DEVICE_TYPE_CPU)
        self._device.set_int("numThreads", threads)
        self._device.set_bool("setAffinity", False)
        self._device.commit()
        self._check()

    def clean(self, radiance: NDArray[np.float32], albedo: NDArray[np.float32], normals: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return denoised radiance.

        Args:
            radiance: (height, width, 3), at least 0, any unit.
            albedo: (height, width, 3), in [0, 1].
            normals: (height, width, 3), in [-1, 1].

        Raises:
            RenderError: the library failed.
        """
        oidn, result = self._oidn, np.zeros_like(radiance)
        images = {"color": radiance, "albedo": albedo, "normal": normals, "output": result}
        images = {name: np.ascontiguousarray(image, np.float32) for name, image in images.items()}
        with oidn.Filter(self._device, oidn.OIDN_FILTER_TYPE_RT) as network:
            for name, image in images.items():
                network.set_image(name, image, oidn.OIDN_FORMAT_FLOAT3)
            network.set_bool("hdr", True)
            network.commit()
            network.execute()
        self._check()
        return images["output"]

    def close(self) -> None:
        """Release the library's device; harmless when repeated."""
        if self._device is not None:
            self._device.release()
            self._device = None

    def _check(self) -> None:
        message = self._device.get_error()
        if message is not None:
            raise RenderError(f"render.denoise: Open Image Denoise failed: {message}; {_HINT}")
