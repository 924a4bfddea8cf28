"""Frames of the layout, angles, walls, support surfaces and boxes of objects, and poses in these: kernels of energies and proposals."""

import math

import numpy as np

from grammar.geometry import walls
from grammar.geometry.boxes import place_boxes
from grammar.geometry.kernels import entry, inlined, kernel
from grammar.layout import columns as col

_METRES_A_TURN = 10.0


@kernel
def wrap(angle: float) -> float:
    """Return an angle in [-pi, pi)."""
    return angle - 2.0 * math.pi * math.floor((angle + math.pi) / (2.0 * math.pi))


@entry
def aslant(dx: float, dy: float, yaw: float, other_yaw: float) -> float:
    """Return the larger of the angles between the line from one object to another, (dx, dy), and the directions that the two look in."""
    line = math.atan2(dy, dx)
    return float(max(abs(wrap(yaw - line)), abs(wrap(other_yaw - line - math.pi))))


@entry
def place_object(problem, state, i):  # type: ignore[no-untyped-def]
    """Write the world boxes of object ``i`` after its pose changed."""
    where, link = state.where, problem.link
    x, y, z, yaw = where[i, col.X], where[i, col.Y], where[i, col.Z], where[i, col.YAW]
    place_boxes(problem.box, link[i, col.SOLIDS], link[i, col.BOX_END], x, y, z, yaw, state.placed)


@inlined
def along_wall(wall, w, x, y):  # type: ignore[no-untyped-def]
    """Return how far along wall ``w`` a point lies, in metres from its start."""
    return (x - wall[w, walls.START_X]) * wall[w, walls.ALONG_X] + (y - wall[w, walls.START_Y]) * wall[w, walls.ALONG_Y]


@inlined
def point_at_wall(wall, w, along, across):  # type: ignore[no-untyped-def]
    """Return x and y of the point ``along`` metres from the start of wall ``w`` and ``across`` metres into the room."""
    x = wall[w, walls.START_X] + wall[w, walls.ALONG_X] * along + wall[w, walls.NORMAL_X] * across
    return x, wall[w, walls.START_Y] + wall[w, walls.ALONG_Y] * along + wall[w, walls.NORMAL_Y] * across


@kernel
def wall_of_core(problem, state, core):  # type: ignore[no-untyped-def]
    """Return the wall on which what belongs to ``core`` hangs: the core's own, or the one at the back of a core that stands.

    That is the nearest one, where a metre counts as much as a turn of the wall's normal against the core's front whose cosine is 0.1 less.
    """
    if problem.link[core, col.MOUNT] != col.FLOOR:
        return state.hold[core, col.ON_WALL]
    wall, x, y, yaw = problem.wall, state.where[core, col.X], state.where[core, col.Y], state.where[core, col.YAW]
    best, least = 0, np.inf
    for w in range(len(wall)):
        along = min(max(along_wall(wall, w, x, y), 0.0), wall[w, walls.LENGTH])
        dx = x - wall[w, walls.START_X] - wall[w, walls.ALONG_X] * along
        dy = y - wall[w, walls.START_Y] - wall[w, walls.ALONG_Y] * along
        cost = math.sqrt(dx * dx + dy * dy) + _METRES_A_TURN * (1.0 - math.cos(yaw - wall[w, walls.WALL_YAW]))
        if cost < least:
            best, least = w, cost
    return np.int64(best)


@inlined
def surface_owner(problem, k):  # type: ignore[no-untyped-def]
    """Return the index of the object that support surface ``k`` belongs to."""
    return int(problem.surface[k, col.SURFACE_OWNER])


@kernel
def in_surface_frame(problem, state, k, x, y):  # type: ignore[no-untyped-def]
    """Return a world point in the frame of the middle of support surface ``k``."""
    where, surface, owner = state.where, problem.surface, surface_owner(problem, k)
    c, s = math.cos(where[owner, col.YAW]), math.sin(where[owner, col.YAW])
    dx, dy = x - where[owner, col.X], y - where[owner, col.Y]
    return dx * c + dy * s - surface[k, col.SURFACE_X], dy * c - dx * s - surface[k, col.SURFACE_Y]


@kernel
def placement_target(problem, i, m, k):  # type: ignore[no-untyped-def]
    """Return x and y that placement ``m`` of object ``i`` means on support surface ``k``, in its frame (NaN: anywhere)."""
    mode, surface = problem.mode, problem.surface
    half_d, half_w = problem.object[i, col.HALF_DEPTH], problem.object[i, col.HALF_WIDTH]
    c, s = 1.0, 0.0
    if not math.isnan(mode[m, col.MODE_YAW]):
        c, s = abs(math.cos(mode[m, col.MODE_YAW])), abs(math.sin(mode[m, col.MODE_YAW]))
    x = mode[m, col.DEPTH_FRACTION] * max(surface[k, col.SURFACE_HALF_DEPTH] - half_d * c - half_w * s, 0.0)
    return x, mode[m, col.WIDTH_FRACTION] * max(surface[k, col.SURFACE_HALF_WIDTH] - half_d * s - half_w * c, 0.0)


@kernel
def pick(rng, count):  # type: ignore[no-untyped-def]
    """Return a uniform index below ``count``."""
    return min(int(rng.random() * count), count - 1)


@inlined
def start_from(state, proposal, place, i):  # type: ignore[no-untyped-def]
    """Begin a proposal for object ``i`` with the pose that it has."""
    proposal.tag[place, col.LEADER], proposal.tag[place, col.NEW_SURFACE] = i, state.hold[i, col.SURFACE]
    proposal.tag[place, col.NEW_WALL] = state.hold[i, col.ON_WALL]
    copy_pose(state, i, proposal, place)


@inlined
def copy_pose(state, i, proposal, place):  # type: ignore[no-untyped-def]
    """Propose the pose that object ``i`` has."""
    proposal.pose[place, col.X], proposal.pose[place, col.Y] = state.where[i, col.X], state.where[i, col.Y]
    proposal.pose[place, col.YAW] = state.where[i, col.YAW]


@kernel
def hang(problem, proposal, place, i, w, along):  # type: ignore[no-untyped-def]
    """Put object ``i`` with its back to wall ``w``, its middle ``along`` metres from the wall's start."""
    x, y = point_at_wall(problem.wall, w, along, problem.object[i, col.HALF_DEPTH])
    proposal.tag[place, col.NEW_WALL] = w
    proposal.pose[place, col.X], proposal.pose[place, col.Y] = x, y
    proposal.pose[place, col.YAW] = problem.wall[w, walls.WALL_YAW]


@kernel
def put_on_surface(problem, state, proposal, k, u, v, turn):  # type: ignore[no-untyped-def]
    """Put the leading object on support surface ``k`` at u, v in its frame, turned by ``turn`` against its owner."""
    where, owner = state.where, surface_owner(problem, k)
    yaw = where[owner, col.YAW]
    c, s = math.cos(yaw), math.sin(yaw)
    u, v = u + problem.surface[k, col.SURFACE_X], v + problem.surface[k, col.SURFACE_Y]
    proposal.tag[0, col.NEW_SURFACE] = k
    proposal.pose[0, col.X] = where[owner, col.X] + u * c - v * s
    proposal.pose[0, col.Y] = where[owner, col.Y] + u * s + v * c
    proposal.pose[0, col.YAW] = wrap(yaw + turn)


@kernel
def uniform_on_surface(rng, problem, k):  # type: ignore[no-untyped-def]
    """Draw a uniform place on support surface ``k``, in its frame."""
    u = problem.surface[k, col.SURFACE_HALF_DEPTH] * (2.0 * rng.random() - 1.0)
    return u, problem.surface[k, col.SURFACE_HALF_WIDTH] * (2.0 * rng.random() - 1.0)
