"""What is printed flat on things: strokes of made-up letters, as rectangles by left, low, right and high in metres."""

import math
from collections.abc import Sequence

import numpy as np

from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import make_mesh

Stroke = tuple[float, float, float, float]

_PROUD_M = 0.0004


def letter(rng: np.random.Generator, left: float, low: float, wide: float, tall: float, thick: float) -> list[Stroke]:
    """Return the strokes of a letter: an upright one, and some of three level ones and of the other upright one."""
    right = left + wide
    strokes = [(left, low, left + thick, low + tall)]
    strokes += [(left, low + at, right, low + at + thick) for at in (0.0, 0.5 * (tall - thick), tall - thick) if rng.random() < 0.55]
    return strokes + [(right - thick, low, right, low + tall)] * int(rng.integers(2))


def on_side(strokes: Sequence[Stroke], x: float) -> Mesh:
    """Return strokes on the side at ``x`` of a thing, read from outside: to the right is +y where x is positive, and -y where it is not."""
    a, b, c, d = np.array(strokes).T
    turned = math.copysign(1.0, x)
    on = np.full_like(a, x + turned * _PROUD_M)
    corners = np.stack([np.stack([on, turned * y, z], axis=-1) for y, z in ((a, b), (c, b), (c, d), (a, d))], axis=1).reshape(-1, 3)
    faces = (4 * np.arange(len(a))[:, None, None] + np.array([(0, 1, 2), (0, 2, 3)])).reshape(-1, 3)
    return make_mesh(corners, np.broadcast_to((turned, 0.0, 0.0), corners.shape), faces)
