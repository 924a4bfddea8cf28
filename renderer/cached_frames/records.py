"""Records that cross stages of shading: what is looked up, what sends a ray, and the memory of a thread."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.cached_frames.lamp_shapes import Lamps
from renderer.core.kernel import inlined
from renderer.core.layout import Layout
from renderer.core.ray_packet import LANES, aligned_floats
from renderer.irradiance_cache.gathering import CoarseLight
from renderer.path.ground_truth import TracedView
from renderer.path.light_nodes import Atlas
from renderer.path.records import LitScene, Scratch

MIRROR = np.float32(1e-3)
"""Width of GGX up to which each pixel shows what its own ray sees."""
SHARP = np.float32(0.01)
"""Width of GGX from which on lamps are shown by :mod:`renderer.cached_frames.lamps`, not by the ray."""
ROUGH = np.float32(0.03)
"""Width of GGX from which on what gloss shows is mixed over twice the distance."""
LAMP_RAYS = 2
"""By how many points of lamps and panes that rough gloss shows it is asked at most whether they are seen."""
MORE_RAYS = 3
"""How many more rays points of edges send on rough metal, which share what these see with no others."""
_FAINT = np.float32(0.06)
UNSEEN = np.float32(2.0)
"""UNDER_ALPHA of a coat alone."""

# A row of ``ShadeScratch.primary``: 16 primary hits while their rays are traced.
_PRIMARY = Layout()
SHARE = _PRIMARY.field(3)  # of the light from the gloss ray that leaves towards the camera
POINT = _PRIMARY.field(3)  # where it begins
AHEAD = _PRIMARY.field(3)  # its direction
EYE = _PRIMARY.field(3)  # where the camera's ray begins, or goes on behind a net
WAY = _PRIMARY.field(3)  # its direction
LIGHT = _PRIMARY.field(3)  # luminance of the pixel so far
LAMPS = _PRIMARY.field(3)  # what its gloss shows of lamps and panes, as far as its shadow rays reached them
BASE = _PRIMARY.field(3)  # what glass or a pane lets through of what it does not reflect
PANE = _PRIMARY.field()  # 1 for a window pane
KIND = _PRIMARY.field()  # 0 no ray, 1 one, 2 one that is mirrored and one that goes through
ALPHA = _PRIMARY.field()  # width of GGX of the surface
SHOWN_ALPHA = _PRIMARY.field()  # the same as the pixel shows it, across which the surface bends
UNDER = _PRIMARY.field(3)  # as SHARE, of the lobe under a smooth coat that has a ray of its own, else 0
UNDER_ALPHA = _PRIMARY.field()  # its width; 1 where there is no such coat, UNSEEN where what lies under it mirrors by no ray
RAY_ALPHA = _PRIMARY.field()  # width of the lobe by which the gloss ray is aimed: SHOWN_ALPHA or UNDER_ALPHA
SEEN = _PRIMARY.field(3)  # luminance that the gloss ray finds
GAIN = _PRIMARY.field(3)  # what its direction reflects, over SHARE
EVEN = _PRIMARY.field(3)  # illuminance over pi, lux: stands for that of what it finds where no node knows any
GLASS = _PRIMARY.field(3)  # what clear glass on its way scatters and mirrors towards it, and metal scatters
SUNLIGHT = _PRIMARY.field(3)  # luminance that rough metal on its way mirrors of the sun
MORE = _PRIMARY.field()  # 1 where MORE_RAYS more are sent, by other microfacets
KIND_BEFORE, SEEN_BEFORE = _PRIMARY.field(), _PRIMARY.field(3)  # KIND, and the sum of what was seen, while these are traced
MORE_AHEAD, MORE_GAIN = _PRIMARY.field(9), _PRIMARY.field(9)  # AHEAD and GAIN of each of these
TURNED = _PRIMARY.field()  # 1 where rough metal has sent it on, or a mirror if its lobe is rough
LEFT = _PRIMARY.field()  # 1 where it has left by a window pane

# A field of ``ShadeScratch.gloss``: what rough gloss of 16 hits shows of lamps and panes.
_GLOSS = Layout(LANES)
ASKS = _GLOSS.field()  # 1 where they are asked for
LOBE_R, LOBE_G, LOBE_B = _GLOSS.vector()  # SHARE
LOBE_ALPHA, LOBE_UNDER_ALPHA = _GLOSS.field(), _GLOSS.field()  # SHOWN_ALPHA, UNDER_ALPHA
BALL_X, BALL_Y, BALL_Z = _GLOSS.vector()  # unit direction to a ball
BALL_FACING = _GLOSS.field()  # cosine between that and what is flat, 1 for others
BALL_OVER, BALL_UNDER = _GLOSS.field(), _GLOSS.field()  # what the lobe mirrors of it, and the one under a coat, over Fresnel's term
OVER_FRAME, UNDER_FRAME = _GLOSS.field(9), _GLOSS.field(9)  # rows of the matrices that make these lobes cosine lobes, world
LEAST = _GLOSS.field()  # what a lamp is to add to count, r + g + b, cd/m2
BALL_HALF, BALL_FACET = _GLOSS.field(), _GLOSS.field()  # cosines of the microfacets that mirror it with the view and the normal
BALL_R, BALL_G, BALL_B = _GLOSS.vector()  # what the pixel reflects of it; then what it adds to the pixel where nothing stands between
REFLECTED = _GLOSS.field()  # what the pixel reflects of it, r + g + b
SENT_R, SENT_G, SENT_B = _GLOSS.vector()  # as BALL_R to BALL_B; of panes over what they let through of the sky
LAMPLIGHT = _GLOSS.field()  # what all add, r + g + b
LAMP_RAY_COUNT = _GLOSS.field()  # how many shadow rays it sends, 0 to LAMP_RAYS
ASKED = _GLOSS.field()  # LAMPLIGHT by the points to which these go, hidden or not
PICKED = _GLOSS.field(LAMP_RAYS)  # rows of ``Lamps.balls`` to which a shadow ray goes each
PICKED_U = _GLOSS.field(LAMP_RAYS)  # numbers in [0, 1) for points of these
PICKED_REFLECTED = _GLOSS.field(LAMP_RAYS)  # REFLECTED of these rows
PICKED_R, PICKED_G, PICKED_B = (_GLOSS.field(LAMP_RAYS) for _ in range(3))  # SENT over the sum of what they add


class Tables(NamedTuple):
    """What frames look up.

    fine: nodes, and rows: (n, ROW) of :mod:`renderer.irradiance_cache.nodes`, their light; sun: (n, 4), that by the sun, as of
    ``NodeLight``.  source: coarse nodes; even, around, leaving: as of :class:`renderer.irradiance_cache.cache.IrradianceCache`.
    spacing_m: of nodes.  least_share, roughest: hits send a ray whose microfacets reflect more than this and are less rough, or
    reflect half as much as is scattered.  pane_ior: of windows' panes, 1 without any.  bend: of triangles, as of
    :func:`renderer.cached_frames.curvature.bend_of_faces`.
    """

    fine: Atlas
    rows: NDArray[np.float32]
    sun: NDArray[np.float32]
    source: CoarseLight
    even: NDArray[np.float32]
    around: NDArray[np.float32]
    leaving: NDArray[np.float32]
    spacing_m: np.float32
    lamps: Lamps
    least_share: np.float32
    roughest: np.float32
    pane_ior: np.float32
    bend: NDArray[np.float32]


class CachedView(NamedTuple):
    """A view that is shaded: the scene and its cache, the hits, the key of the frame's random numbers, and which fine nodes it reads.

    is_read: (n,) bool.
    """

    scene: LitScene
    tables: Tables
    traced: TracedView
    frame_key: np.uint32
    is_read: NDArray[np.bool_]


class ShadeScratch(NamedTuple):
    """Memory of one thread.

    trace: rays and lanes; pixels: (2, 16) int32, columns and rows of the lanes' pixels; primary: (PRIMARY, 16), primary hits while their
    rays are traced; gloss: (GLOSS * 16,), what it shows of lamps; edges: (8, 96), rays of a tile's edges.
    """

    trace: Scratch
    pixels: NDArray[np.int32]
    primary: NDArray[np.float32]
    gloss: NDArray[np.float32]
    edges: NDArray[np.float32]


def make_shade_scratch(trace: Scratch) -> ShadeScratch:
    """Return that memory beside a thread's rays and lanes."""
    primary, edges = np.zeros((_PRIMARY.size, LANES), np.float32), np.zeros((8, 6 * LANES), np.float32)
    return ShadeScratch(trace, np.zeros((2, LANES), np.int32), primary, aligned_floats(_GLOSS.size), edges)


@inlined
def is_faint(primary: NDArray[np.float32], k: int) -> bool:
    """Return whether lane k mirrors little, by a lobe that is not sharp."""
    most = max(primary[SHARE, k], primary[SHARE + 1, k], primary[SHARE + 2, k])
    return bool((primary[ALPHA, k] >= SHARP) & (most < _FAINT))


@inlined
def looks_under(x: int, y: int, primary: NDArray[np.float32], k: int) -> bool:
    """Return whether the ray of lane k, of pixel (x, y), is that of the lobe under its coat, as every second one's is."""
    return bool((primary[UNDER_ALPHA, k] < np.float32(1.0)) & ((x + y) & 1 == 1))


@inlined
def takes_from_others(x: int, y: int, metal: bool, primary: NDArray[np.float32], k: int) -> bool:
    """Return whether lane k, of pixel (x, y), sends no mirrored ray: three of four on rough surfaces, half on rough metal or if faint."""
    rough = primary[ALPHA, k] > ROUGH
    if rough and not metal:
        return bool((x | y) & 1)
    return (rough or (is_faint(primary, k) and not metal)) and (x + y) & 1 == 1


@inlined
def asks_lamps(x: int, y: int) -> bool:
    """Return whether pixel (x, y) sends shadow rays to lamps that light it little, as half of all do in each row, column and diagonal."""
    return bool((x + (y >> 1)) & 1 == 0)
