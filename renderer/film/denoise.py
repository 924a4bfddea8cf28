"""Denoising by Intel Open Image Denoise (Apache-2.0), through its binding ``pyoidn`` (MIT); the extra ``denoise`` installs both.

The network takes the mean radiance with albedo and normal of the first hits, or of what mirrors and clear glass show, as guides.  These are
denoised first, each for itself, so that the network may take them for clean and keep whatever texture they show (Open Image Denoise,
documentation of the filter RT: prefiltering, ``cleanAux``).
"""

import importlib.util
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.core.errors import RenderError

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
        self._networks: list[Any] = []
        self._images: dict[str, NDArray[np.float32]] = {}
        self._check()

    def clean(self, radiance: NDArray[np.float32], albedo: NDArray[np.float32], normals: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return denoised radiance.

        ``radiance``: (height, width, 3), at least 0, any unit; ``albedo``, ``normals``: the same shape, in [0, 1] and [-1, 1].

        Raises:
            RenderError: the library failed.
        """
        if not self._networks or self._images["color"].shape != radiance.shape:
            self._prepare(radiance.shape)
        for name, image in (("color", radiance), ("albedo", albedo), ("normal", normals)):
            self._images[name][:] = image
        for network in self._networks:
            network.execute()
        self._check()
        return self._images["output"].copy()

    def _prepare(self, shape: tuple[int, ...]) -> None:
        """Set the networks up for images of a size, which takes as long as an image does; the guides are cleaned in place."""
        self._release()
        self._images = {name: np.zeros(shape, np.float32) for name in ("color", "albedo", "normal", "output")}
        guides = {name: self._images[name] for name in ("albedo", "normal")}
        self._networks = [self._network({name: guide, "output": guide}) for name, guide in guides.items()]
        self._networks.append(self._network(self._images, "hdr", "cleanAux"))
        self._check()

    def _network(self, images: dict[str, NDArray[np.float32]], *options: str) -> Any:
        network = self._oidn.Filter(self._device, self._oidn.OIDN_FILTER_TYPE_RT)
        for name, image in images.items():
            network.set_image(name, image, self._oidn.OIDN_FORMAT_FLOAT3)
        for option in options:
            network.set_bool(option, True)
        # Clean guides would choose a network of twice the work otherwise.
        network.set_int("quality", self._oidn.OIDN_QUALITY_BALANCED)
        network.commit()
        return network

    def close(self) -> None:
        """Release the library's device; harmless when repeated."""
        self._release()
        if self._device is not None:
            self._device.release()
            self._device = None

    def _release(self) -> None:
        for network in self._networks:
            network.release()
        self._networks = []

    def _check(self) -> None:
        message = self._device.get_error()
        if message is not None:
            raise RenderError(f"render.denoise: Open Image Denoise failed: {message}; {_HINT}")
