"""What a texture generator returns, and what is known of a generator."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.textures.noise import Field, Shape

Color = tuple[float, float, float]


class Pattern(NamedTuple):
    """One tile of a pattern, all (h, w) float32; periodic in both directions unless it is mapped once.

    weights: up to three fields in [0, 1], the shares of the second, third and fourth colour; what they leave is the base colour.
    shade: factor on the colour, about 1.  roughness: added to the material's.  height: in units of the texture's relief, 0 at the top.
    """

    weights: tuple[Field, ...]
    shade: Field | None = None
    roughness: Field | None = None
    height: Field | None = None


class Picture(NamedTuple):
    """One tile with colours of its own: rgb (h, w, 3) float32, linear; the rest as in :class:`Pattern`."""

    rgb: NDArray[np.float32]
    roughness: Field | None = None
    height: Field | None = None


class Request(NamedTuple):
    """What a generator is asked for: (h, w) of the tile, width over height of what it is mapped on, and the colours, base first, linear."""

    shape: Shape
    aspect: float
    colors: tuple[Color, ...]


Draw = Callable[[np.random.Generator, Request], Pattern | Picture]


class Generator(NamedTuple):
    """A kind of texture.

    draw: makes one tile.  units: size (u, v) of the tile in units of the texture's ``scale_m``.  shape: (h, w) in texels, powers of two.
    tints: factors on the base colour that stand for the colours that a texture does not name.  once: mapped once over the whole part
    instead of repeated, in both directions from 0 to 1.  shift: by which share of the tile each further row of tiles is moved along u,
    so that repeats do not line up; only for patterns with a seam between rows.  variants: how many different tiles there are; seeds are
    taken modulo this number, so that rooms share them; 0 for one per seed.  inked: the draw reads the request's colours; tiles of all
    others are shared by materials of any colour.
    """

    draw: Draw
    units: tuple[float, float] = (1.0, 1.0)
    shape: Shape = (256, 256)
    tints: tuple[Color, ...] = ((0.6, 0.6, 0.6), (0.35, 0.35, 0.35), (1.3, 1.3, 1.3))
    once: bool = False
    shift: float = 0.0
    variants: int = 12
    inked: bool = False
