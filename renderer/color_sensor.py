"""What a colour camera reads of light: the stages of lens, sensor and processing, one after another.

    light -> lateral chromatic aberration -> vignetting          the lens          renderer.camera.sensor
          -> glare -> blur                                                       .sensor, .blur
          -> shot noise, well, read noise, converter             the sensor        renderer.camera.sensor
          -> Bayer mosaic -> demosaicing                         its filters       renderer.camera.bayer
          -> white balance -> response curve, 8 bits             the processor     renderer.film.tone
          -> saturation -> sharpening                              .saturation, .sharpening
          -> JPEG                                                the file          renderer.files.image_io

The order is that of common image pipelines (R. Ramanath et al., "Color image processing pipeline", IEEE Signal Processing Magazine 22(1),
2005).  A mosaic is interpolated with the channels balanced, as gradients of one colour stand for those of another.  Every stage is left out
until a setting asks for it, so an ideal sensor reads the ideal picture byte for byte.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.camera.bayer import demosaic, mosaic
from renderer.camera.blur import blur, gaussian_weights
from renderer.camera.cameras import PosedCamera
from renderer.camera.config import SensorConfig
from renderer.camera.saturation import saturate
from renderer.camera.sensor import expose, magnify_channels, veil, vignetting
from renderer.camera.sharpening import sharpen
from renderer.files.image_io import through_jpeg
from renderer.film.tone import Exposure, balance, encode, thresholds, to_display, white_luminance
from renderer.film.white_balance import adaptation
from scene_description.products import inverse

_LEAST_OF_WHITE = 1.0 / 16.0
"""Of its brightest channel, the least of the others by which a mosaic is balanced: the blue of a candle is next to nothing."""


def read_color(
    radiance: NDArray[np.float32],
    camera: PosedCamera,
    sensor: SensorConfig,
    exposure: Exposure,
    tone_curve: str,
    frame_key: np.uint32,
    local_stops: float = 0.0,
) -> NDArray[np.uint8]:
    """Return the picture (height, width, 3), uint8, that a sensor makes of linear colour, cd/m2.

    ``camera``: whose rays tell the angles of vignetting; ``exposure``: which luminance is white, and which light; ``tone_curve``
    and ``local_stops``, as of :func:`renderer.film.tone.to_display`: of the response ``display``.
    """
    arriving = magnify_channels(radiance, sensor.red_shift_px, sensor.blue_shift_px)
    share = vignetting(camera, sensor.vignetting, sensor.corner_loss)
    arriving = arriving if share is None else arriving * share[..., None]
    arriving = veil(arriving, sensor.glare) if sensor.glare else arriving
    arriving = blur(arriving, gaussian_weights(sensor.blur_px)) if sensor.blur_px else arriving
    read = expose(arriving, white_luminance(exposure.ev100) * 2.0**sensor.headroom_ev, sensor, frame_key)
    if sensor.bayer != "none":
        read = _interpolated(read, sensor, exposure)
    if sensor.response == "display":
        picture = to_display(read, exposure, tone_curve, local_stops)
    else:
        picture = encode(balance(read, exposure), thresholds(sensor.response, sensor.response_gamma, sensor.response_points))
    picture = saturate(picture, sensor.color_saturation) if sensor.color_saturation != 1.0 else picture
    picture = sharpen(picture, sensor.sharpening) if sensor.sharpening else picture
    return through_jpeg(picture, sensor.jpeg_quality) if sensor.jpeg_quality else picture


def _interpolated(read: NDArray[np.float32], sensor: SensorConfig, exposure: Exposure) -> NDArray[np.float32]:
    """Return what is left of linear colour behind a mosaic; channels are interpolated as multiples of what white has."""
    white = inverse(adaptation(exposure.white_xy)).sum(axis=1)
    white = np.maximum(white, _LEAST_OF_WHITE * white.max()).astype(np.float32)
    return np.asarray(demosaic(mosaic(read / white, sensor.bayer), sensor.bayer, sensor.demosaic) * white)
