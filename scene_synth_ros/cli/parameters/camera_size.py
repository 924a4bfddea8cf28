"""Another image size for a camera whose lens is given in pixels: the image is cut, which is told, or the lens is scaled with it."""

from collections.abc import Collection, Mapping
from typing import Any

from renderer import CameraConfig

_WIDTH, _HEIGHT = "camera.width", "camera.height"
_LENS = {"camera.focal_x_px": 0, "camera.focal_y_px": 1, "camera.principal_x_px": 0, "camera.principal_y_px": 1}
"""Parameter in pixels -> the side that it is measured along: width, height."""


def resized_camera(
    node: str, before: Mapping[str, Any], after: Mapping[str, Any], given: Collection[str], *, scale: bool
) -> tuple[dict[str, Any], str]:
    """Return the parameters of a renderer whose image size was changed, and what is to be told of it, empty where nothing is.

    ``given``: names of what the user has given, which stays as it is.
    ``scale``: whether the lens, and the side that was not given, are scaled with the image.
    """
    old, new = _size(before), _size(after)
    if old == new or not all(isinstance(side, int) and side > 0 for side in (*old, *new)):
        return dict(after), ""
    lens = {name: before[name] for name in _LENS if before.get(name, 0) not in (0, -1) and name not in given}
    if not scale:
        focal = lens.get("camera.focal_x_px")
        shares = " and ".join(f"{100 * a // b} % of its {what}" for a, b, what in zip(new, old, ("width", "height"), strict=True) if a < b)
        if focal is None or not shares:
            return dict(after), ""
        told = f"{node}: {new[0]} x {new[1]} pixels show the middle of a view of {old[0]} x {old[1]} with camera.focal_x_px {focal:g}"
        return dict(after), f"{told}: {shares}; --scale-camera shows all of it"
    factors = [new[0] / old[0], new[1] / old[1]]
    if _WIDTH not in given or _HEIGHT not in given:
        factors = [factors[0 if _WIDTH in given else 1]] * 2
    scaled = dict(after) | {_WIDTH: round(old[0] * factors[0]), _HEIGHT: round(old[1] * factors[1])}
    if "camera.focal_x_px" in lens:
        lens.setdefault("camera.focal_y_px", lens["camera.focal_x_px"])
    for name, value in lens.items():
        centre = 0.5 if "principal" in name else 0.0
        scaled[name] = (value + centre) * factors[_LENS[name]] - centre
    return scaled, ""


def _size(values: Mapping[str, Any]) -> tuple[Any, Any]:
    default = CameraConfig()
    return values.get(_WIDTH, default.width), values.get(_HEIGHT, default.height)
