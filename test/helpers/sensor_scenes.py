"""A camera at the origin that looks along +x at planes and plates, and what a device reads there."""

import math

import numpy as np
from box_room import pose, quad, scene

from renderer import CameraConfig, DepthSensorConfig, RenderConfig, Renderer

EYE = pose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
NARROW = CameraConfig(width=320, height=240, horizontal_fov_rad=0.2)
WIDE = CameraConfig(width=320, height=240, horizontal_fov_rad=1.2)


def wall(distance, *, tilt=0.0, half=20.0, **what):
    """A plane that the optical axis meets at ``distance``, m, turned by ``tilt`` rad about the vertical."""
    along = np.array([math.sin(tilt), math.cos(tilt), 0.0])
    corner = np.array([distance, 0.0, 0.0]) - half * along - [0.0, 0.0, half]
    what = {"color": (0.5, 0.5, 0.5), "roughness": 1.0} | what
    return quad(tuple(corner), (0.0, 0.0, 2 * half), tuple(2 * half * along), **what)


def plate(distance, low, high, **what):
    """An upright rectangle facing the camera: ``low`` and ``high`` are its corners (right, down) in metres, as the camera sees them."""
    (left, top), (right, bottom) = low, high
    what = {"color": (0.5, 0.5, 0.5), "roughness": 1.0} | what
    return quad((distance, -left, -top), (0.0, left - right, 0.0), (0.0, 0.0, top - bottom), **what)


def read(pieces, camera=NARROW, *, frame=0, threads=2, key=7, **settings):
    """Return sensed and true depth."""
    with Renderer(scene(*pieces), camera, RenderConfig(threads=threads), key, depth_sensor=DepthSensorConfig(**settings)) as renderer:
        layers = renderer.render(EYE, frame, ("depth", "depth_sensed")).layers
    return layers["depth_sensed"], layers["depth"]


def incidence(shape, camera, tilt):
    """Return the angle of incidence on :func:`wall` in each pixel, rad."""
    v, u = np.mgrid[: shape[0], : shape[1]] + 0.5
    x, y = (u - 0.5 * shape[1]) / camera.focal_length_px, (v - 0.5 * shape[0]) / camera.focal_length_px
    return np.arccos(np.abs(math.sin(tilt) * x + math.cos(tilt)) / np.sqrt(1 + x * x + y * y))
