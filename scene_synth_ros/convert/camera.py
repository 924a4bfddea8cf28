"""The camera of a recorded frame as formats ask for it: its lens and where it maps points, its pose, its shutter.

Pixel coordinates have the centre of the upper left pixel at (0, 0), as CameraInfo has.  Formats that put it at (0.5, 0.5) add
``HALF_PIXEL`` to the principal point.  The rows of a rolling shutter's picture are seen from the poses of their own times, where most
formats have one pose a frame.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.camera.lenses import LENSES
from scene_description import CameraPose
from scene_description.poses import world_from_optical
from scene_description.products import matmul, norm
from scene_synth_ros.convert.writer import ConvertError
from scene_synth_ros.dataset import Camera, Frame
from scene_synth_ros.messages.image_reader import MAX_PIXELS

HALF_PIXEL = 0.5
_MODELS = {"plumb_bob": "brown_conrady", "rational_polynomial": "rational", "equidistant": "kannala_brandt"}
"""distortion_model of CameraInfo -> lens model; without coefficients ``plumb_bob`` is a pinhole."""
_PANORAMA = "equirectangular"
_OPTICAL_FROM_OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])
"""OpenGL's camera has x right, y up and looks along -z."""


class Lens(NamedTuple):
    """A lens.

    Attributes:
        model: key of ``renderer.camera.lenses.LENSES``.
        width: of images, pixels.
        height: of images, pixels.
        fx: focal length, pixels.
        fy: focal length, pixels.
        cx: principal point, pixel centres at integers.
        cy: principal point, pixel centres at integers.
        coefficients: as many as the model has, in the order of CameraInfo's D.
    """

    model: str
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    coefficients: tuple[float, ...]

    def project(self, optical_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the pixels (n, 2) of points (n, 3) of the optical frame; NaN where the lens sees nothing."""
        places = LENSES[self.model].project(optical_m, self.coefficients)
        return np.asarray(places * (self.fx, self.fy) + (self.cx, self.cy))

    def directions(self, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the directions (n, 3), optical frame, that are seen at pixels (n, 2); NaN where there is none."""
        places = (np.asarray(pixels, np.float64) - (self.cx, self.cy)) / (self.fx, self.fy)
        return np.asarray(LENSES[self.model].bearing(places, self.coefficients))

    def sees(self) -> NDArray[np.bool_]:
        """Return which pixels (height, width) have a direction: all, or those within the circle of a fisheye."""
        rows, columns = np.mgrid[: self.height, : self.width]
        seen = np.isfinite(self.directions(np.stack([columns.ravel(), rows.ravel()], axis=1))).all(axis=1)
        return np.asarray(seen.reshape(self.height, self.width))


def lens_of(camera: Camera) -> Lens:
    """Return the lens of a camera.

    Raises:
        ConvertError: its distortion model is none of ours, has coefficients that ours has no place for, or it is not calibrated; or its
            images are larger than any.
    """
    width, height = int(camera.width), int(camera.height)
    if not 0 < width * height <= MAX_PIXELS:
        raise ConvertError(f"camera {camera.name}: expected an image of 1 to {MAX_PIXELS} pixels, got {width}x{height}")
    if camera.model == _PANORAMA:
        centre = 0.5 * (width - 1), 0.5 * (height - 1)
        return Lens(_PANORAMA, width, height, width / (2.0 * np.pi), height / np.pi, *centre, ())
    if camera.model not in _MODELS:
        known = ", ".join((*_MODELS, _PANORAMA))
        raise ConvertError(f"camera {camera.name}: expected a distortion model of {known}, got '{str(camera.model)[:40]}'")
    told = tuple(float(item) for item in camera.D)
    model = _MODELS[camera.model] if any(told) or camera.model == "equidistant" else "pinhole"
    count, k = LENSES[model].coefficients, camera.K
    beyond = sum(map(bool, told[count:]))
    if beyond:
        expected = f"expected at most {count} coefficients of {camera.model}, got {beyond} more that are not 0"
        raise ConvertError(f"camera {camera.name}: {expected}, which no format carries; rectify the images, or calibrate without them")
    fx, fy = float(k[0, 0]), float(k[1, 1])
    if not (np.isfinite([*k.ravel(), *told]).all() and fx > 0.0 and fy > 0.0):
        expected = "expected finite numbers in K and D and focal lengths above 0"
        raise ConvertError(f"camera {camera.name}: {expected}, got fx {fx:g}, fy {fy:g}; calibrate the camera")
    return Lens(model, width, height, fx, fy, float(k[0, 2]), float(k[1, 2]), (*told, *(0.0,) * 8)[:count])


def refuse_lens(lens: Lens, camera: str, form: str, expected: str, instead: str) -> ConvertError:
    """Return the refusal of a lens that a format has no place for."""
    told = f" {lens.coefficients}" if lens.coefficients else ""
    return ConvertError(f"{form}: camera {camera}: expected a lens {expected}, got {lens.model}{told}; {instead}")


def camera_pose(frame: Frame) -> CameraPose:
    """Return the pose of a frame's optical frame in the map, with a quaternion of exactly unit length."""
    x, y, z = (float(item) for item in frame.pose[0])
    turn = np.asarray(frame.pose[1], np.float64)
    qx, qy, qz, qw = (turn / norm(turn)).tolist()
    return CameraPose(stamp_ns=frame.stamp_ns, position_m=(x, y, z), orientation=(qx, qy, qz, qw))


def world_from_camera(pose: CameraPose) -> NDArray[np.float64]:
    """Return the matrix (4, 4) that takes points of the optical frame (x right, y down, z forward) to the map."""
    return world_from_optical(pose.position_m, pose.orientation)


def camera_from_world(pose: CameraPose) -> NDArray[np.float64]:
    """Return the matrix (4, 4) that takes points of the map to the optical frame."""
    return rigid_inverse(world_from_camera(pose))


def rigid_inverse(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the inverse of a rotation and shift (4, 4)."""
    back = np.eye(4)
    back[:3, :3] = matrix[:3, :3].T
    back[:3, 3] = matmul(-matrix[:3, :3].T, matrix[:3, 3])
    return back


def world_from_opengl(pose: CameraPose) -> NDArray[np.float64]:
    """Return the matrix (4, 4) that takes points of OpenGL's camera (x right, y up, z backward) to the map."""
    return np.asarray(matmul(world_from_camera(pose), _OPTICAL_FROM_OPENGL))


def row_time_s(frame: Frame) -> float:
    """Return the time from row to row of the camera of a frame; 0 for a global shutter, and where no settings were recorded."""
    camera = (frame.settings or {}).get("camera")
    told = camera.get("row_time_s") if isinstance(camera, Mapping) else None
    return float(told) if isinstance(told, int | float) else 0.0


def refuse_rolling_shutter(frame: Frame, camera: str, form: str) -> None:
    """Refuse a camera whose frames have no single pose.

    Raises:
        ConvertError: its shutter rolls.
    """
    told = row_time_s(frame)
    if told:
        raise ConvertError(
            f"{form}: camera {camera}: expected a global shutter, as each frame has one pose, got {told:g} s a row;"
            " record with camera.row_time_s 0, or choose --to tum, euroc or coco"
        )


def shutter_notes(frame: Frame, camera: str, form: str) -> dict[str, None]:
    """Return the line that tells of a rolling shutter, for formats of trajectories, which have no place for the time a row."""
    told = row_time_s(frame)
    if not told:
        return {}
    line = f"{form}: camera {camera}: the shutter takes {told:g} s a row, which the format does not tell; poses are the first row's"
    return {line: None}
