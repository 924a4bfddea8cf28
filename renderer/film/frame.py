"""All buffers of one view."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_description.annotations import FrameAnnotations


class Frame(NamedTuple):
    """One view: layer name -> image, C-contiguous, dtype and shape as the row of ``renderer.film.layers.LAYERS`` says.

    Images of a frame share blocks of memory, so one that is kept keeps others; copy it where that matters.  ``depth_opaque`` and its like
    are the very arrays of the first surfaces where no glass is seen, as ``depth_sensed`` is ``depth`` where the sensor is ideal.

    ``radiance`` is the linear colour behind ``color``: (height, width, 3) float32, RGB luminance in cd/m2; None where colour was
    not asked for.  ``samples``: how many samples per pixel colour and albedo took, 0 where they were not asked for.
    ``rays``: how many rays were traced for all layers, shadow rays among them.  ``sampling_s`` and ``denoising_s``: how long samples and
    the denoiser took (s); 0 where there were none; ``filling_s``: part of ``sampling_s`` in which light was computed that later frames find
    in the irradiance cache.  ``annotations``: what is told of its objects, where that was asked for.
    """

    layers: dict[str, NDArray[np.generic]]
    radiance: NDArray[np.float32] | None
    samples: int = 0
    rays: int = 0
    sampling_s: float = 0.0
    denoising_s: float = 0.0
    annotations: FrameAnnotations | None = None
    filling_s: float = 0.0
