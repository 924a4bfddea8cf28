"""The relocation: a pose drawn afresh from a mixture of a uniform pose, poses at walls and poses around the core or on a support surface.

What belongs to a core and stands at walls is drawn, with the share ``relocate_beside``, at the wall that a place around its core is nearest
to, beside that place: both relations hold at once, which independent draws hardly ever reach where both are tight.  An object's modes are
drawn by their probabilities, and widths grow with a mode's spread.  The mixture's density is computed for any pose, which the Hastings
ratio needs.  A pose's base measure is area times angle (length along the walls for what hangs there), over the bounding box of the room,
the walls, or the support surfaces.
"""

import math

import numpy as np

from grammar.geometry import walls
from grammar.geometry.kernels import inlined, kernel
from grammar.layout import columns as col
from grammar.layout.frames import (
    along_wall,
    hang,
    in_surface_frame,
    pick,
    placement_target,
    point_at_wall,
    put_on_surface,
    surface_owner,
    uniform_on_surface,
    wall_of_core,
    wrap,
)

_TWO_PI = 2.0 * math.pi
_LEAST_LENGTH_M = 1e-9
_FAR_SDS = 40.0
"""Beyond so many standard deviations a normal density is zero in float64."""


@kernel
def _normal_density(x, sd):  # type: ignore[no-untyped-def]
    return math.exp(-0.5 * (x / sd) ** 2) / (sd * math.sqrt(_TWO_PI))


@kernel
def _yaw_density(angle, mean, sd):  # type: ignore[no-untyped-def]
    """Return the density of a wrapped normal (narrow: sd is far below pi), or of a uniform angle where the mean is NaN."""
    return 1.0 / _TWO_PI if math.isnan(mean) else _normal_density(wrap(angle - mean), sd)


@kernel
def _draw_yaw(rng, mean, sd):  # type: ignore[no-untyped-def]
    return _TWO_PI * rng.random() if math.isnan(mean) else mean + sd * rng.standard_normal()


@kernel
def _draw_mode(rng, mode, first, end):  # type: ignore[no-untyped-def]
    """Draw one of an object's modes by their probabilities; there is at least one."""
    u, k = rng.random(), first
    while k < end - 1 and u >= mode[k, col.PROBABILITY]:
        u -= mode[k, col.PROBABILITY]
        k += 1
    return k


@kernel
def _free_length(problem, i):  # type: ignore[no-untyped-def]
    """Return the summed length of wall that the middle of object ``i`` can take."""
    total = 0.0
    for w in range(len(problem.wall)):
        total += max(problem.wall[w, walls.LENGTH] - 2.0 * problem.object[i, col.HALF_WIDTH], 0.0)
    return total


@kernel
def _follows(problem, core):  # type: ignore[no-untyped-def]
    """Return whether what hangs and belongs to ``core`` stays on the wall behind that."""
    return core >= 0 and problem.link[core, col.MOUNT] == col.FLOOR


@kernel
def _draw_wall(rng, problem, margin):  # type: ignore[no-untyped-def]
    """Draw a wall with probability in proportion to its length less ``margin``, and a place that keeps half of it from both ends."""
    wall, total, longest = problem.wall, 0.0, 0
    for w in range(len(wall)):
        total += max(wall[w, walls.LENGTH] - margin, 0.0)
        if wall[w, walls.LENGTH] > wall[longest, walls.LENGTH]:
            longest = w
    u, chosen = rng.random() * total, longest
    for w in range(len(wall)):
        u -= max(wall[w, walls.LENGTH] - margin, 0.0)
        if u < 0.0:
            chosen = w
            break
    return chosen, 0.5 * margin + max(wall[chosen, walls.LENGTH] - margin, 0.0) * rng.random()


@kernel
def _shares(problem, state, settings, i):  # type: ignore[no-untyped-def]
    """Return the mixture's shares for object ``i``: uniform, at walls, around its core or on its support."""
    link, core, mount = problem.link, problem.link[i, col.CORE], problem.link[i, col.MOUNT]
    uniform = settings.relocate_uniform
    wall = settings.relocate_wall if link[i, col.AROUND_MODES] > link[i, col.WALL_MODES] else 0.0
    centred = mount == col.CEILING and problem.object[i, col.CENTRED] > 0.0
    near = (core >= 0 and state.hold[core, col.ACTIVE]) or mount == col.OBJECT or centred
    around = settings.relocate_around if near else 0.0
    total = uniform + wall + around
    return uniform / total, wall / total, around / total


@kernel
def relocate(rng, problem, state, settings, i, proposal):  # type: ignore[no-untyped-def]
    """Draw a pose for object ``i``."""
    pose, mount = proposal.pose, problem.link[i, col.MOUNT]
    uniform, wall, _ = _shares(problem, state, settings, i)
    if mount == col.OBJECT:
        _draw_on_surface(rng, problem, state, settings, i, proposal, uniform)
        return
    u = rng.random()
    if mount == col.WALL:
        w, along = _draw_hanging(rng, problem, state, settings, i, u < uniform)
        hang(problem, proposal, np.int64(0), i, w, along)
    elif u < uniform:
        pose[0, col.X] = problem.x_low + (problem.x_high - problem.x_low) * rng.random()
        pose[0, col.Y] = problem.y_low + (problem.y_high - problem.y_low) * rng.random()
        if mount == col.FLOOR:
            pose[0, col.YAW] = wrap(_TWO_PI * rng.random())
    elif u < uniform + wall:
        _draw_at_wall(rng, problem, settings, i, proposal)
    elif mount == col.CEILING:
        pose[0, col.X] = problem.x_centre + settings.around_sd_m * rng.standard_normal()
        pose[0, col.Y] = problem.y_centre + settings.around_sd_m * rng.standard_normal()
    elif _beside_share(problem, settings, i) > 0.0 and rng.random() < settings.relocate_beside:
        _draw_beside_core(rng, problem, state, settings, i, proposal)
    else:
        _draw_around_core(rng, problem, state, settings, i, proposal)


@kernel
def _beside_share(problem, settings, i):  # type: ignore[no-untyped-def]
    """Return the share of the poses around its core at which an object is drawn at a wall; 0 for what has no places at walls."""
    return settings.relocate_beside if problem.link[i, col.AROUND_MODES] > problem.link[i, col.WALL_MODES] else 0.0


@kernel
def _wall_by_place(problem, state, i, k):  # type: ignore[no-untyped-def]
    """Return the wall that mode ``k`` around the core of object ``i`` is nearest to, and how far along it the place is."""
    where, wall, mode, core = state.where, problem.wall, problem.mode, problem.link[i, col.CORE]
    yaw = where[core, col.YAW]
    c, s = math.cos(yaw), math.sin(yaw)
    x = where[core, col.X] + mode[k, col.MODE_X] * c - mode[k, col.MODE_Y] * s
    y = where[core, col.Y] + mode[k, col.MODE_X] * s + mode[k, col.MODE_Y] * c
    best, chosen, place = np.inf, 0, 0.0
    for w in range(len(wall)):
        along = along_wall(wall, w, x, y)
        across = (x - wall[w, walls.START_X]) * wall[w, walls.NORMAL_X] + (y - wall[w, walls.START_Y]) * wall[w, walls.NORMAL_Y]
        off = abs(across) + max(-along, along - wall[w, walls.LENGTH], 0.0)
        if off < best:
            best, chosen, place = off, w, along
    return chosen, place


@inlined
def _draw_beside_core(rng, problem, state, settings, i, proposal):  # type: ignore[no-untyped-def]
    """Draw a pose at one of an object's wall modes, along the wall beside one of its modes around its core."""
    link, mode = problem.link, problem.mode
    m = _draw_mode(rng, mode, link[i, col.AROUND_MODES], link[i, col.PLACEMENTS])
    w, along = _wall_by_place(problem, state, i, m)
    along += settings.around_sd_m / mode[m, col.NEAR] * rng.standard_normal()
    _put_at_wall(rng, problem, settings, i, w, along, proposal.pose)


@inlined
def _put_at_wall(rng, problem, settings, i, w, along, pose):  # type: ignore[no-untyped-def]
    """Draw gap and yaw at wall ``w`` by one of an object's wall modes."""
    link, mode, wall = problem.link, problem.mode, problem.wall
    half_d, half_w = problem.object[i, col.HALF_DEPTH], problem.object[i, col.HALF_WIDTH]
    k = _draw_mode(rng, mode, link[i, col.WALL_MODES], link[i, col.AROUND_MODES])
    turn = _draw_yaw(rng, mode[k, col.MODE_YAW], settings.wall_orientation_sd_rad / mode[k, col.STRAIGHT])
    across = mode[k, col.GAP] + settings.wall_gap_sd_m / mode[k, col.NEAR] * rng.standard_normal()
    across += half_d * abs(math.cos(turn)) + half_w * abs(math.sin(turn))
    pose[0, col.X], pose[0, col.Y] = point_at_wall(wall, w, along, across)
    pose[0, col.YAW] = wrap(wall[w, walls.WALL_YAW] + turn)


@inlined
def _draw_hanging(rng, problem, state, settings, i, is_uniform):  # type: ignore[no-untyped-def]
    """Draw a wall and a place along it for what hangs: anywhere that it may hang, or at a mode around its core."""
    wall, mode, where = problem.wall, problem.mode, state.where
    core, half_w = problem.link[i, col.CORE], problem.object[i, col.HALF_WIDTH]
    if is_uniform and _follows(problem, core):
        w = wall_of_core(problem, state, core)
        return w, half_w + max(wall[w, walls.LENGTH] - 2.0 * half_w, 0.0) * rng.random()
    if is_uniform:
        return _draw_wall(rng, problem, 2.0 * half_w)
    w = wall_of_core(problem, state, core)
    k = _draw_mode(rng, mode, problem.link[i, col.AROUND_MODES], problem.link[i, col.PLACEMENTS])
    along = along_wall(wall, w, where[core, col.X], where[core, col.Y]) - mode[k, col.MODE_Y]
    along += settings.around_sd_m / mode[k, col.NEAR] * rng.standard_normal()
    return w, along


@inlined
def _draw_at_wall(rng, problem, settings, i, proposal):  # type: ignore[no-untyped-def]
    """Draw a pose at one of an object's wall modes, anywhere along the walls."""
    w, along = _draw_wall(rng, problem, 0.0)
    _put_at_wall(rng, problem, settings, i, w, along, proposal.pose)


@inlined
def _draw_around_core(rng, problem, state, settings, i, proposal):  # type: ignore[no-untyped-def]
    """Draw a pose at one of an object's modes around its core."""
    link, mode, where, pose, core = problem.link, problem.mode, state.where, proposal.pose, problem.link[i, col.CORE]
    k = _draw_mode(rng, mode, link[i, col.AROUND_MODES], link[i, col.PLACEMENTS])
    sd = settings.around_sd_m / mode[k, col.NEAR]
    x, y = mode[k, col.MODE_X] + sd * rng.standard_normal(), mode[k, col.MODE_Y] + sd * rng.standard_normal()
    yaw = where[core, col.YAW]
    c, s = math.cos(yaw), math.sin(yaw)
    pose[0, col.X], pose[0, col.Y] = where[core, col.X] + x * c - y * s, where[core, col.Y] + x * s + y * c
    pose[0, col.YAW] = wrap(yaw + _draw_yaw(rng, mode[k, col.MODE_YAW], settings.around_orientation_sd_rad / mode[k, col.STRAIGHT]))


@kernel
def _draw_on_surface(rng, problem, state, settings, i, proposal, uniform):  # type: ignore[no-untyped-def]
    """Draw a target of an object's support address, and a pose there: uniform, or at one of its placements."""
    link, mode, first = problem.link, problem.mode, problem.link[i, col.TARGETS]
    surface = int(mode[first + pick(rng, link[i, col.MODE_END] - first), col.TARGET])
    u, v = uniform_on_surface(rng, problem, surface)
    if rng.random() < uniform:
        turn = _TWO_PI * rng.random()
    else:
        k = _draw_mode(rng, mode, link[i, col.PLACEMENTS], first)
        x, y = placement_target(problem, i, k, surface)
        sd = settings.place_sd_m / mode[k, col.NEAR]
        if not math.isnan(x):
            u = x + sd * rng.standard_normal()
        if not math.isnan(y):
            v = y + sd * rng.standard_normal()
        turn = _draw_yaw(rng, mode[k, col.MODE_YAW], settings.around_orientation_sd_rad / mode[k, col.STRAIGHT])
    put_on_surface(problem, state, proposal, surface, u, v, turn)


@kernel
def relocation_density(problem, state, settings, i, proposal):  # type: ignore[no-untyped-def]
    """Return the density with which a relocation of object ``i`` draws the pose in ``proposal``."""
    mount = problem.link[i, col.MOUNT]
    uniform, wall, around = _shares(problem, state, settings, i)
    if mount == col.OBJECT:
        return _surface_density(problem, state, settings, i, proposal, uniform)
    if mount == col.WALL:
        return _hanging_density(problem, state, settings, i, proposal, uniform, around)
    x, y, yaw = proposal.pose[0, col.X], proposal.pose[0, col.Y], proposal.pose[0, col.YAW]
    area = (problem.x_high - problem.x_low) * (problem.y_high - problem.y_low)
    if mount == col.CEILING:
        dx, dy, sd = x - problem.x_centre, y - problem.y_centre, settings.around_sd_m
        return uniform / area + around * _normal_density(dx, sd) * _normal_density(dy, sd)
    density = uniform / (area * _TWO_PI)
    if wall > 0.0:
        density += wall * _at_wall_density(problem, settings, i, x, y, yaw)
    if around > 0.0:
        beside = _beside_share(problem, settings, i)
        if beside > 0.0:
            density += around * beside * _beside_core_density(problem, state, settings, i, x, y, yaw)
        density = _add_core_density(problem, state, settings, i, proposal, around * (1.0 - beside), density)
    return density


@inlined
def _hanging_density(problem, state, settings, i, proposal, uniform, around):  # type: ignore[no-untyped-def]
    """Return the density along the walls of what hangs."""
    wall, mode, where, core = problem.wall, problem.mode, state.where, problem.link[i, col.CORE]
    w, x, y = proposal.tag[0, col.NEW_WALL], proposal.pose[0, col.X], proposal.pose[0, col.Y]
    length = wall[w, walls.LENGTH] - 2.0 * problem.object[i, col.HALF_WIDTH] if _follows(problem, core) else _free_length(problem, i)
    density = uniform / max(length, _LEAST_LENGTH_M)
    if around > 0.0 and wall_of_core(problem, state, core) == w:
        off = along_wall(wall, w, x, y) - along_wall(wall, w, where[core, col.X], where[core, col.Y])
        for k in range(problem.link[i, col.AROUND_MODES], problem.link[i, col.PLACEMENTS]):
            sd = settings.around_sd_m / mode[k, col.NEAR]
            density += around * mode[k, col.PROBABILITY] * _normal_density(off + mode[k, col.MODE_Y], sd)
    return density


@inlined
def _add_core_density(problem, state, settings, i, proposal, around, density):  # type: ignore[no-untyped-def]
    """Return ``density`` and that of the modes around the core, whose share is ``around``."""
    mode, where, core = problem.mode, state.where, problem.link[i, col.CORE]
    dx, dy, core_yaw = proposal.pose[0, col.X] - where[core, col.X], proposal.pose[0, col.Y] - where[core, col.Y], where[core, col.YAW]
    yaw, c, s = proposal.pose[0, col.YAW], math.cos(core_yaw), math.sin(core_yaw)
    for k in range(problem.link[i, col.AROUND_MODES], problem.link[i, col.PLACEMENTS]):
        u, v = dx * c + dy * s - mode[k, col.MODE_X], dy * c - dx * s - mode[k, col.MODE_Y]
        sd = settings.around_sd_m / mode[k, col.NEAR]
        near = around * mode[k, col.PROBABILITY] * _normal_density(math.sqrt(u * u + v * v), sd) / (sd * math.sqrt(_TWO_PI))
        if near > 0.0:
            density += near * _yaw_density(
                yaw - core_yaw, mode[k, col.MODE_YAW], settings.around_orientation_sd_rad / mode[k, col.STRAIGHT]
            )
    return density


@kernel
def _pose_at_wall_density(problem, settings, i, w, x, y, yaw):  # type: ignore[no-untyped-def]
    """Return the density of gap and yaw at wall ``w``, the sum over an object's wall modes."""
    wall, mode, first, last = problem.wall, problem.mode, problem.link[i, col.WALL_MODES], problem.link[i, col.AROUND_MODES]
    half_d, half_w = problem.object[i, col.HALF_DEPTH], problem.object[i, col.HALF_WIDTH]
    nx, ny, c, s, density = wall[w, walls.NORMAL_X], wall[w, walls.NORMAL_Y], math.cos(yaw), math.sin(yaw), 0.0
    across = (x - wall[w, walls.START_X]) * nx + (y - wall[w, walls.START_Y]) * ny
    gap = across - half_d * abs(c * nx + s * ny) - half_w * abs(s * nx - c * ny)
    for k in range(first, last):
        off, sd = gap - mode[k, col.GAP], settings.wall_gap_sd_m / mode[k, col.NEAR]
        if abs(off) < _FAR_SDS * sd:
            turn_sd = settings.wall_orientation_sd_rad / mode[k, col.STRAIGHT]
            turn = _yaw_density(yaw - wall[w, walls.WALL_YAW], mode[k, col.MODE_YAW], turn_sd)
            density += mode[k, col.PROBABILITY] * _normal_density(off, sd) * turn
    return density


@kernel
def _at_wall_density(problem, settings, i, x, y, yaw):  # type: ignore[no-untyped-def]
    """Return the density of a pose drawn at the walls: the sum over walls and modes, over the walls' summed length."""
    wall, density, length = problem.wall, 0.0, 0.0
    for w in range(len(wall)):
        length += wall[w, walls.LENGTH]
        if 0.0 <= along_wall(wall, w, x, y) <= wall[w, walls.LENGTH]:
            density += _pose_at_wall_density(problem, settings, i, w, x, y, yaw)
    return density / length


@kernel
def _beside_core_density(problem, state, settings, i, x, y, yaw):  # type: ignore[no-untyped-def]
    """Return the density of a pose drawn at a wall beside the places around the core: the sum over these."""
    mode, density = problem.mode, 0.0
    for m in range(problem.link[i, col.AROUND_MODES], problem.link[i, col.PLACEMENTS]):
        w, along = _wall_by_place(problem, state, i, m)
        off, sd = along_wall(problem.wall, w, x, y) - along, settings.around_sd_m / mode[m, col.NEAR]
        if abs(off) < _FAR_SDS * sd:
            density += mode[m, col.PROBABILITY] * _normal_density(off, sd) * _pose_at_wall_density(problem, settings, i, w, x, y, yaw)
    return density


@kernel
def _surface_density(problem, state, settings, i, proposal, uniform):  # type: ignore[no-untyped-def]
    """Return the density on the support surface of the proposal, over the number of an object's targets."""
    link, mode, surface = problem.link, problem.mode, proposal.tag[0, col.NEW_SURFACE]
    half_d, half_w = problem.surface[surface, col.SURFACE_HALF_DEPTH], problem.surface[surface, col.SURFACE_HALF_WIDTH]
    u, v = in_surface_frame(problem, state, surface, proposal.pose[0, col.X], proposal.pose[0, col.Y])
    turn = proposal.pose[0, col.YAW] - state.where[surface_owner(problem, surface), col.YAW]
    density = uniform / (4.0 * half_d * half_w * _TWO_PI)
    for k in range(link[i, col.PLACEMENTS], link[i, col.TARGETS]):
        x, y = placement_target(problem, i, k, surface)
        sd = settings.place_sd_m / mode[k, col.NEAR]
        across = 0.5 / half_d if math.isnan(x) else _normal_density(u - x, sd)
        along = 0.5 / half_w if math.isnan(y) else _normal_density(v - y, sd)
        turned = _yaw_density(turn, mode[k, col.MODE_YAW], settings.around_orientation_sd_rad / mode[k, col.STRAIGHT])
        density += (1.0 - uniform) * mode[k, col.PROBABILITY] * across * along * turned
    return density / (link[i, col.MODE_END] - link[i, col.TARGETS])
