"""Light metering: the exposure value at which the views of a room come out well, and the light that shall look white there."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from renderer.camera.config import CameraConfig, LensModel, SensorConfig
from renderer.camera.lenses import LENSES
from renderer.core.color import LUMINANCE
from renderer.core.errors import RenderError
from renderer.film.tone import MOST_BLACK, Exposure, white_luminance
from renderer.film.white_balance import AUTO_DEGREE, Chromaticity, metered_white, partly_adapted, white_of_kelvin
from renderer.path.config import RenderConfig
from renderer.renderer import Renderer
from renderer.scene.flat_scene import FlatScene
from scene_description import CameraPose
from scene_description.color_temperature import D65_XY
from scene_description.products import matmul

METER_CONSTANT = 12.5
"""K of ISO 2720 for reflected light, cd/m2 at EV 0 and ISO 100 times 100."""

_WIDTH, _SAMPLES, _VIEWS, _STEPS_PER_EV = 64, 16, 3, 8
_MOST_PIXELS = 2 * _WIDTH * _WIDTH
"""Of the meter's image, which has 64 columns unless it would be more than twice as high."""
_ZONE = 4
"""Side in pixels of the zones whose mean luminance is metered: noise of single pixels would lower logarithms and low quantiles."""
_DEPTH = 32
"""Segments of the meter's paths: what a room's light loses there is below any step, whatever the pictures lose."""
_AS_CONFIGURED = ("portable", "integrator", "cache_spacing_m", "cache_rays", "cache_light_samples")
_BASE_COLORS = {"path": "albedo", "cached": "base_color"}
"""Integrator -> the layer that tells colours of surfaces, of which it takes no kernels that pictures do not."""
_DARKEST = 1e-3
_BRIGHT_SHARE, _BRIGHT_STOPS = 0.92, 0.7
_MIDDLE_STOPS = -3.15
"""Most of the median luminance of any view, in stops above white: no view of a room is bleached because others are dark."""
_WINDOW_SHARE, _WINDOW_STOPS, _BLEACHED_STOPS, _DIMMED_STOPS = 0.97, 3.0, -0.3, -2.9
"""What no photographer's hand exceeds: stops above white that this share of what is seen keeps, that a view's median has at most, and at
least that of the brightest view."""
_MERGED_SHARE = 0.35
"""Of local tone mapping's stops, how many bright parts need not hold a room back, as shorter exposures show them."""
_DARK_SHARE, _BLACK_OF_DARK = 0.005, 0.8
"""What of all that is seen is darkest, and the black of the camera's curve over the most luminance of that."""
_KEY_CD_M2 = 10.0
"""Metered luminance at which a scene's key changes nothing: a room by lamplight."""
_HAND, _MOST_DEVIATION = 0x68616E64, 2.0
"""What sets the draw of a room's compensation apart from other draws by its key, and its bound in deviations."""


class LightReading(NamedTuple):
    """What a meter tells of a room.

    ev100, white_xy, black: as of ``Exposure``; deviate: a standard normal number of the room, within 2, for its compensation;
    bleached_ev100: below that exposure value windows or the middle of a view are bleached; dimmed_ev100: above that one the middle of all
    views is dim; held_back_ev: by how many stops bright parts make ``ev100`` darker than the room's log-average would have it.
    """

    ev100: float
    white_xy: Chromaticity
    black: float = 0.0
    deviate: float = 0.0
    bleached_ev100: float = -math.inf
    dimmed_ev100: float = math.inf
    held_back_ev: float = 0.0


def fixed_white(config: RenderConfig) -> Chromaticity | None:
    """Return the chromaticity that ``render.white_balance`` shows as white; None if it must be metered."""
    fixed = {"none": D65_XY, "kelvin": white_of_kelvin(config.white_balance_k), "auto": None}
    return fixed[config.white_balance]


def needs_meter(config: RenderConfig) -> bool:
    """Return whether exposure or white balance are asked to be metered."""
    return config.auto_exposure or fixed_white(config) is None


def sensor_ev100(camera: CameraConfig, sensor: SensorConfig) -> float | None:
    """Return the exposure value that speed, aperture and time make, log2(100 N^2 / (t ISO)) (ISO 2720); None if no speed is set.

    Raises:
        RenderError: there is a speed, but no aperture or time.
    """
    if not sensor.iso:
        return None
    if not camera.f_stop or not camera.shutter_s:
        got = f"f_stop {camera.f_stop:g} and shutter_s {camera.shutter_s:g}"
        raise RenderError(f"sensor.iso: expected camera.f_stop and camera.shutter_s above 0 beside it, got {got}; set them, or iso to 0")
    return math.log2(camera.f_stop**2 / camera.shutter_s * 100.0 / sensor.iso)


def exposed(config: RenderConfig, metered: LightReading | None, fixed_ev100: float | None = None) -> Exposure:
    """Return the exposure of a room's frames: fixed by the sensor, metered and compensated, or as configured."""
    white = fixed_white(config)
    if fixed_ev100 is not None:
        config = replace(config, exposure_ev100=fixed_ev100, auto_exposure=False)
    if metered is None:
        return Exposure(config.exposure_ev100, white or D65_XY)
    merged_ev = min(metered.held_back_ev, _MERGED_SHARE * config.local_tone_stops)
    plain_ev100 = metered.ev100 - merged_ev - config.exposure_compensation_ev
    least, most = min(plain_ev100, metered.bleached_ev100), max(plain_ev100, metered.dimmed_ev100)
    by_hand_ev100 = min(max(plain_ev100 - _by_room_ev(config, metered), least), most)
    ev100 = by_hand_ev100 if config.auto_exposure else config.exposure_ev100
    black = config.black_share * min(metered.black * 2.0 ** (metered.ev100 - ev100), MOST_BLACK)
    return Exposure(ev100, white or partly_adapted(metered.white_xy, AUTO_DEGREE), black)


def _by_room_ev(config: RenderConfig, metered: LightReading) -> float:
    """Return by how many stops, in steps of 1/8, a room is shown brighter than all are, by its key and by its draw."""
    luminance = METER_CONSTANT / 100.0 * 2.0**metered.ev100
    by_room = config.exposure_key * math.log2(_key(luminance) / _key(_KEY_CD_M2)) + config.exposure_scatter_ev * metered.deviate
    return round(by_room * _STEPS_PER_EV) / _STEPS_PER_EV


def _key(luminance: float) -> float:
    """Return how bright a picture's middle shall be for a mean luminance in cd/m2.

    G. Krawczyk, K. Myszkowski and H.-P. Seidel, "Perceptual effects in real-time tone mapping", SCCG 2005.
    """
    return 1.03 - 2.0 / (2.0 + math.log10(luminance + 1.0))


def metered_layers(config: RenderConfig) -> tuple[str, ...]:
    """Return the layers that a meter asks a renderer for."""
    return "radiance", _BASE_COLORS[config.integrator], "range"


class LightMeter:
    """Meters a room from small renderings along a path: one answer for all its frames, whatever the quality of their light.

    Light is that of the configured integrator, so that nothing is compiled for the meter alone: looked up, it is that of the irradiance
    cache's coarse nodes, which pictures need, too; traced, paths are longer than theirs.

    The exposure value is log2(100 L / K) of the log-average luminance L of zones, or what shows 92 % of them below 0.7 stops above white,
    or half of each view below 3.15 stops under it, whichever is darkest, in steps of 1/8 EV; the white is that of
    :func:`renderer.film.white_balance.metered_white`; the black, in steps of 1/8 EV too, is 0.8 of the luminance that 0.5 % of the zones
    stay below.  Steps keep them the same on processors whose last bits differ; everything else makes them depend on the scene only.

    ``config``: integrator, settings of the irradiance cache and ``portable`` are taken from it; ``poses``: the path; a few of its views are
    metered.
    """

    def __init__(self, flat: FlatScene, camera: CameraConfig, config: RenderConfig, scene_key: int, poses: Sequence[CameraPose]) -> None:
        self._flat, self._scene_key, self._poses = flat, scene_key, poses
        self._camera = _small_camera(camera)
        configured = {name: getattr(config, name) for name in _AS_CONFIGURED}
        self._config = RenderConfig(samples_per_pixel=_SAMPLES, max_depth=_DEPTH, **configured)
        self._left = sorted({round(i) for i in np.linspace(0, len(poses) - 1, _VIEWS)})
        self._seen: list[tuple[NDArray[np.float32], NDArray[np.float32]]] = []
        self._zones: list[NDArray[np.float64]] = []

    def read(self, threads: int = 0, *, like: Renderer | None = None, cancelled: Callable[[], bool] | None = None) -> LightReading:
        """Return the reading; go on where a call that was cancelled has stopped.

        ``threads``: as of ``RenderConfig``; ``like``: as of ``Renderer``; ``cancelled``: as of ``Renderer.render``.

        Raises:
            RenderCancelled: ``cancelled`` returned True.
        """
        layers = metered_layers(self._config)
        config = replace(self._config, threads=threads)
        with Renderer(self._flat, self._camera, config, self._scene_key, like=like, coarse=True) as renderer:
            while self._left:
                frame = renderer.render(self._poses[self._left[0]], self._left[0], layers, cancelled=cancelled)
                light, base, distance = (np.asarray(frame.layers[name], np.float32) for name in layers)
                seen = ~np.isnan(distance)  # not beyond the circle of a fisheye
                self._seen.append((light[seen], base[seen]))
                self._zones.append(_zone_luminance(light, seen))
                del self._left[0]
        views = [np.maximum(zones, _DARKEST) for zones in self._zones]
        logs = np.mean([el.log2(view).mean() for view in views])
        luminance = np.concatenate(views)
        bright, window = np.quantile(luminance, (_BRIGHT_SHARE, _WINDOW_SHARE)).tolist()
        middle = max(float(np.quantile(view, 0.5)) for view in views)
        limit, bleached = (
            max(math.log2(high / white_luminance(stops)), math.log2(middle / white_luminance(middle_stops)))
            for high, stops, middle_stops in ((bright, _BRIGHT_STOPS, _MIDDLE_STOPS), (window, _WINDOW_STOPS, _BLEACHED_STOPS))
        )
        even = float(logs) + math.log2(100.0 / METER_CONSTANT)
        ev100 = max(even, limit)
        dark = max(_BLACK_OF_DARK * float(np.quantile(luminance, _DARK_SHARE)), _DARKEST)
        dimmed = math.log2(middle / white_luminance(_DIMMED_STOPS))
        ev100, bleached, dimmed, held_back, dark_ev = (
            round(stops * _STEPS_PER_EV) / _STEPS_PER_EV
            for stops in (ev100, bleached, dimmed, ev100 - even, math.log2(dark / white_luminance(0.0)))
        )
        light, base = (np.concatenate(column) for column in zip(*self._seen, strict=True))
        deviate = float(np.clip(np.random.default_rng((self._scene_key, _HAND)).standard_normal(), -_MOST_DEVIATION, _MOST_DEVIATION))
        return LightReading(ev100, metered_white(light, base), 2.0 ** (dark_ev - ev100), deviate, bleached, dimmed, held_back)


def _zone_luminance(light: NDArray[np.float32], seen: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the mean luminance (n,) of what is ``seen`` (h, w) of an image (h, w, 3), by zones; those that see nothing are left out."""
    luminance = np.where(seen, matmul(light.astype(np.float64).reshape(-1, 3), LUMINANCE).reshape(seen.shape), 0.0)
    rows, columns = (np.arange(0, side, _ZONE) for side in seen.shape)
    images = luminance, seen.astype(np.float64)
    total, count = (np.add.reduceat(np.add.reduceat(image, rows, axis=0), columns, axis=1) for image in images)
    return np.asarray(total[count > 0.0] / count[count > 0.0])


def _small_camera(camera: CameraConfig) -> CameraConfig:
    """Return a camera of few pixels that sees about as much, through a lens that maps a plane or through one of the same kind."""
    width, height = _WIDTH, max(1, _WIDTH * camera.height // camera.width)
    if width * height > _MOST_PIXELS:
        width = max(1, math.isqrt(_MOST_PIXELS * camera.width // camera.height))
        height = _MOST_PIXELS // width
    model: LensModel = "pinhole" if LENSES[camera.model].planar else camera.model
    return CameraConfig(model=model, width=width, height=height, horizontal_fov_rad=camera.horizontal_fov_rad)


def meter(
    flat: FlatScene,
    camera: CameraConfig,
    config: RenderConfig,
    scene_key: int,
    poses: Sequence[CameraPose],
    *,
    like: Renderer | None = None,
) -> LightReading:
    """Return what a :class:`LightMeter` reads; ``threads`` is taken from ``config`` too, and ``like`` as of ``Renderer``."""
    return LightMeter(flat, camera, config, scene_key, poses).read(config.threads, like=like)
