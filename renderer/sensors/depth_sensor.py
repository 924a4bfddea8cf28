"""A depth sensor in a scene: from the pose of its camera to the depth that it reads."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from renderer.camera.camera_rays import CENTRE, TILE
from renderer.camera.cameras import PosedCamera
from renderer.core.embree import SceneHandle
from renderer.core.errors import RenderError
from renderer.core.ray_packet import LANES
from renderer.core.workers import Workers
from renderer.path.surface_tables import Surfaces
from renderer.sensors import virtual_images
from renderer.sensors.beams import Beams, Eye, make_beam_scratch, make_beams, trace_beams
from renderer.sensors.block_matcher import census, make_match_scratch, match_rows
from renderer.sensors.devices import DepthSensorConfig, Principle, device_of
from renderer.sensors.multipath import GRID, cosine_directions, smooth_multipath, sum_multipath
from renderer.sensors.specks import remove_specks
from renderer.sensors.structured_light import read_structured_light
from renderer.sensors.surfaces_seen import LEFT_IMAGE, RIGHT_IMAGE
from renderer.sensors.time_of_flight import SUB_PIXELS, SUM_FIELDS, Returns, add_returns, mark_edges, read_time_of_flight

_BAND = 16
_NOWHERE = np.zeros(0, np.float32)


class DepthSensor:
    """Reads the depth of a scene as a device would; the same key gives the same bytes for any number of threads.

    The device's camera is the renderer's; its projector or second camera stands ``baseline_m`` to the right.
    ``scene``: Embree's, with its robust flag.

    Raises:
        RenderError: the model is ``ideal``, which needs no sensor.
    """

    def __init__(self, config: DepthSensorConfig, scene: SceneHandle, surfaces: Surfaces, workers: Workers) -> None:
        self._principle, self._device = device_of(config)
        if self._principle == "ideal":
            raise RenderError("depth_sensor.model: expected a device, got ideal, which reads the true depth")
        self._scene, self._surfaces, self._workers = scene, surfaces, workers
        self._scratch = [make_beam_scratch() for _ in range(workers.count)]

    def read(self, camera: PosedCamera, key: np.uint32) -> NDArray[np.float32]:
        """Return the sensed depth (height, width) in metres along the optical axis: -inf too near, +inf too far or nothing, NaN invalid.

        Raises:
            RenderError: the lens maps no plane, as a fisheye's.
        """
        if camera.sees_aside:
            raise RenderError("depth_sensor.model: expected a camera whose lens maps a plane, got a fisheye or a panorama; use model ideal")
        camera = camera._replace(lens_radius_m=np.float32(0.0))
        return _READERS[self._principle](self, camera, np.uint32(key))

    def _read_structured_light(self, camera: PosedCamera, key: np.uint32) -> NDArray[np.float32]:
        beams = self._trace(camera, self._beside(camera, self._device.baseline_m))
        result = np.empty((camera.height, camera.width), np.float32)
        self._by_rows(read_structured_light, camera, self._device, beams, key, result)
        return self._without_specks(result)

    def _read_time_of_flight(self, camera: PosedCamera, key: np.uint32) -> NDArray[np.float32]:
        device, light = self._device, self._beside(camera, self._device.baseline_m)
        beams = self._trace(camera, light)
        edges = np.zeros((-(-camera.height // TILE), -(-camera.width // TILE)), np.uint8)
        self._by_rows(mark_edges, camera, beams, edges)
        tiles = np.flatnonzero(edges).astype(np.int32)
        sums = np.zeros((camera.height, camera.width, SUM_FIELDS), np.float32)
        if len(tiles):
            beside = make_beams(camera.height, camera.width)
            for u, v in SUB_PIXELS:
                jitter = np.repeat(np.array([u, v], np.float32), LANES)
                self._trace(camera, light, jitter=jitter, tiles=tiles, beams=beside)
                self._by_rows(add_returns, camera, device, beside, tiles, sums)
        grid = np.zeros((1 - (-camera.height // GRID), 1 - (-camera.width // GRID), 2), np.float32)
        if device.multipath > 0.0:
            directions = cosine_directions()

            eye = Eye(self._scene, self._surfaces, camera, light)

            def add(worker: int, first: int) -> None:
                sum_multipath(eye, device, directions, beams, self._scratch[worker].rays, grid, first, self._workers.count)

            self._workers.run(add, range(self._workers.count))
            rough, grid = grid, np.zeros_like(grid)
            self._by_rows(smooth_multipath, camera, beams, rough, grid)
        result = np.empty((camera.height, camera.width), np.float32)
        self._by_rows(read_time_of_flight, camera, device, Returns(beams, edges, sums, grid), key, result)
        return result

    def _read_stereo(self, camera: PosedCamera, key: np.uint32) -> NDArray[np.float32]:
        device = self._device
        plain = camera._replace(bearings=np.zeros((0, 0, 3), np.float32))
        disparity = self._without_specks(self.match(*self.images(plain, key)))
        with np.errstate(divide="ignore", invalid="ignore"):
            depth = (np.float32(float(camera.focal_px) * device.baseline_m) / disparity).astype(np.float32)
            depth[depth < device.min_range_m] = -np.inf
            depth[depth > device.max_range_m] = np.inf
        return depth if not len(camera.bearings) else _through_lens(depth, camera)

    def images(self, camera: PosedCamera, key: np.uint32) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return what the two cameras of a stereo device see, (height, width) float32 of whole numbers up to 1023."""
        device, size = self._device, (camera.height, camera.width)
        projector = camera._replace(position=self._beside(camera, 0.5 * device.baseline_m))
        origin = projector.position if device.dots > 0.0 else _NOWHERE
        channel = virtual_images.RED if device.dots > 0.0 else virtual_images.LUMINANCE
        lights = []
        for offset in (0.0, device.baseline_m):
            eye = camera._replace(position=self._beside(camera, offset))
            beams, light = self._trace(eye, origin), np.empty(size, np.float32)
            self._by_rows(virtual_images.shade, eye, device, projector, beams, channel, light)
            lights.append(light)
        white = virtual_images.white_of(lights[0], device)
        left, right = np.empty(size, np.float32), np.empty(size, np.float32)
        for light, purpose, image in ((lights[0], LEFT_IMAGE, left), (lights[1], RIGHT_IMAGE, right)):
            self._by_rows(virtual_images.read_image, light, white, device, key, purpose, image)
        return left, right

    def match(self, left: NDArray[np.float32], right: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the disparity (height, width) of the left one of two images, pixels, NaN where there is none."""
        height, width = left.shape
        words = np.zeros((2, height, width), np.uint32)
        for image, word in zip((left, right), words, strict=True):
            self._by_rows(census, image, self._device, word)
        result = np.full((height, width), np.nan, np.float32)
        scratch = [make_match_scratch(width, self._device) for _ in range(self._workers.count)]

        def match(worker: int, begin: int) -> None:
            match_rows(words[0], words[1], left, self._device, scratch[worker], result, begin, min(begin + _BAND, height))

        self._workers.run(match, range(0, height, _BAND))
        return result

    def _without_specks(self, read: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return what the device leaves of what it reads, NaN where nothing is."""
        window = int(self._device.speck_px)
        if window < 2:
            return read
        result = np.empty_like(read)
        self._by_rows(remove_specks, read, window, result)
        return result

    def _trace(
        self,
        camera: PosedCamera,
        light: NDArray[np.float32],
        *,
        jitter: NDArray[np.float32] = CENTRE,
        tiles: NDArray[np.int32] | None = None,
        beams: Beams | None = None,
    ) -> Beams:
        """Return the beams of all pixels, or fill those of some tiles."""
        if tiles is None:
            tiles = np.arange(-(-camera.height // TILE) * -(-camera.width // TILE), dtype=np.int32)
        eye, traced = Eye(self._scene, self._surfaces, camera, light), beams or make_beams(camera.height, camera.width)

        def trace(worker: int, first: int) -> None:
            trace_beams(eye, jitter, tiles, self._scratch[worker], traced, first, self._workers.count)

        self._workers.run(trace, range(self._workers.count))
        return traced

    def _by_rows(self, fill: Callable[..., None], *arguments: object) -> None:
        """Call a kernel in every thread, each with rows, or tiles, of its own."""
        self._workers.run(lambda _, first: fill(*arguments, first, self._workers.count), range(self._workers.count))

    @staticmethod
    def _beside(camera: PosedCamera, right_m: float) -> NDArray[np.float32]:
        """Return the place so far to the right of a camera, (3,) float32."""
        return np.ascontiguousarray(camera.position + np.float32(right_m) * camera.rotation[:, 0])


def _through_lens(depth: NDArray[np.float32], camera: PosedCamera) -> NDArray[np.float32]:
    """Return a rectified image as the camera's own lens sees it, each pixel the nearest one; NaN beyond it."""
    height, width = depth.shape
    table = camera.bearings[1:-1, 1:-1]
    x = np.floor(table[..., 0] * camera.focal_px + 0.5 * width)
    y = np.floor(table[..., 1] * camera.focal_px + 0.5 * height)
    inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
    taken = depth[np.where(inside, y, 0).astype(np.int64), np.where(inside, x, 0).astype(np.int64)]
    return np.where(inside, taken, np.float32(np.nan)).astype(np.float32)


_READERS: dict[Principle, Callable[[DepthSensor, PosedCamera, np.uint32], NDArray[np.float32]]] = {
    "structured_light": DepthSensor._read_structured_light,
    "time_of_flight": DepthSensor._read_time_of_flight,
    "stereo": DepthSensor._read_stereo,
}
"""How a device measures -> what reads it."""
