"""A layout problem, its state and its proposals as a few tables that compiled code can take.

Objects are numbered from 0 over openings and placed objects alike, object id minus 1; openings are fixed.  World frame, metres, radians.
Few tables with named columns (:mod:`grammar.layout.columns`) rather than one array for each quantity: every array that a kernel takes costs
compile time in its callers.
"""

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from grammar.geometry.arrays import Bools, Boxes, Floats, Ints
from grammar.geometry.boxes import BOX_WIDTH
from grammar.layout import columns as col
from grammar.spec.energy_terms import Cliques
from grammar.spec.rules import MOVES, MoveRule


class Problem(NamedTuple):
    """Everything about a room that its chain leaves alone; n objects, whose rows of ``box`` and ``mode`` follow each other.

    object, link, box, mode, surface, row, slot: rows of the columns that :mod:`grammar.layout.columns` gives places and explains.
    wall: (w, 9) rows of :func:`grammar.geometry.walls.wall_rows`; slope: (c, 4) rows of :func:`grammar.geometry.slopes.slope_rows`.
    weight: (t,) lambda of the energy terms.
    x_low, y_low, x_high, y_high: bounding box of the floor; x_centre, y_centre: its centroid.
    """

    object: Floats
    link: Ints
    box: Boxes
    mode: Floats
    surface: Floats
    wall: Floats
    slope: Floats
    row: Ints
    slot: Floats
    weight: Floats
    x_low: float
    y_low: float
    x_high: float
    y_high: float
    x_centre: float
    y_centre: float

    @property
    def mount(self) -> Ints:
        """What holds each object, (n,)."""
        return self.link[:, col.MOUNT]

    @property
    def core(self) -> Ints:
        """Index of each object's core object or -1, (n,)."""
        return self.link[:, col.CORE]

    @property
    def pinned(self) -> Bools:
        """Whether each object stays where it is, (n,)."""
        return self.link[:, col.PINNED] > 0

    @property
    def surface_owner(self) -> Ints:
        """Index of each support surface's owner, (s,)."""
        return self.surface[:, col.SURFACE_OWNER].astype(np.int64)

    def modes(self, i: int, kind: int) -> Floats:
        """Return the rows of ``mode`` of object ``i``; ``kind``: column WALL_MODES, AROUND_MODES, PLACEMENTS or TARGETS."""
        return self.mode[self.link[i, kind] : self.link[i, kind + 1]]

    def targets(self, i: int) -> Ints:
        """Return the support surfaces that object ``i`` may stand on."""
        return self.modes(i, col.TARGETS)[:, col.TARGET].astype(np.int64)


class State(NamedTuple):
    """Where everything is; the chain writes these arrays in place.

    where: (n, WHERE_WIDTH) poses; hold: (n, HOLD_WIDTH) what each object stands and hangs on, and whether it takes part; placed: (m, 8) the
    problem's boxes in the world.  How far a run is shifted along its slot follows from the pose of the unit in place 0.
    """

    where: Floats
    hold: Ints
    placed: Boxes

    @property
    def pose(self) -> Floats:
        """View of x, y, yaw, (n, 3)."""
        return self.where[:, : col.Z]

    @property
    def z(self) -> Floats:
        """View of the undersides' heights, (n,)."""
        return self.where[:, col.Z]

    @property
    def surface(self) -> Ints:
        """View of the support surfaces, (n,)."""
        return self.hold[:, col.SURFACE]

    @property
    def on_wall(self) -> Ints:
        """View of the walls, (n,)."""
        return self.hold[:, col.ON_WALL]

    @property
    def active(self) -> Ints:
        """View of who takes part, (n,) 0 or 1."""
        return self.hold[:, col.ACTIVE]


def zero_state(problem: Problem) -> State:
    """Return a state in which nothing takes part yet; x, y, yaw and boxes are zero, and nothing stands on an object or hangs on a wall."""
    n = len(problem.object)
    where, hold = np.zeros((n, col.WHERE_WIDTH)), np.full((n, col.HOLD_WIDTH), -1, np.int64)
    where[:, col.Z], hold[:, col.ACTIVE] = problem.object[:, col.BOTTOM], 0
    return State(where, hold, np.zeros((len(problem.box), BOX_WIDTH)))


def copy_state(state: State) -> State:
    """Return a state with arrays of its own."""
    return State(state.where.copy(), state.hold.copy(), state.placed.copy())


class MoveSettings(NamedTuple):
    """:class:`grammar.spec.rules.MoveRule` for compiled code.

    cumulative: running sum of the moves' probabilities, in the order of ``MOVES``; translate_sd_m, rotate_sd_rad: (k,) standard deviations,
    each filled up by repetition to a common length; the rest as the rule has it.
    """

    cumulative: Floats
    translate_sd_m: Floats
    rotate_sd_rad: Floats
    carry: float
    quarter_turn: float
    relocate_uniform: float
    relocate_wall: float
    relocate_around: float
    relocate_beside: float
    wall_gap_sd_m: float
    wall_orientation_sd_rad: float
    around_sd_m: float
    around_orientation_sd_rad: float
    place_sd_m: float


class Proposal(NamedTuple):
    """Work space for one proposal: the objects that lead it (one, or two that swap) and where they go.

    pose: (2, POSE_WIDTH) new x, y, yaw; tag: (2, TAG_WIDTH) whose, and where they stand or hang.
    """

    pose: Floats
    tag: Ints


def move_settings(rule: MoveRule) -> MoveSettings:
    """Return the settings of the compiled moves."""
    size = math.lcm(len(rule.translate_sd_m), len(rule.rotate_sd_rad))
    return MoveSettings(
        np.cumsum([getattr(rule, name) for name in MOVES]),
        np.resize(rule.translate_sd_m, size),
        np.resize(rule.rotate_sd_rad, size),
        *(float(getattr(rule, name)) for name in MoveSettings._fields[3:]),
    )


def empty_proposal() -> Proposal:
    """Return work space for proposals."""
    return Proposal(np.zeros((2, col.POSE_WIDTH)), np.zeros((2, col.TAG_WIDTH), np.int64))


def _walls(problem: Problem) -> int:
    """Return the number of objects with modes at walls."""
    return int((problem.link[:, col.AROUND_MODES] > problem.link[:, col.WALL_MODES]).sum())


def _groups(problem: Problem) -> int:
    """Return the number of objects with a core object."""
    return int((problem.core >= 0).sum())


def _supports(problem: Problem) -> int:
    """Return the number of objects that may stand on an object."""
    return int((problem.link[:, col.MODE_END] > problem.link[:, col.TARGETS]).sum())


def _zones(problem: Problem) -> int:
    """Return the number of zones to be kept free."""
    return int((problem.link[:, col.STRIPS] - problem.link[:, col.ZONES]).sum())


def _centres(problem: Problem) -> int:
    """Return the number of objects that are drawn to the centroid of the floor."""
    return int((problem.object[:, col.CENTRED] > 0.0).sum())


COUNTERS: Mapping[Cliques, Callable[[Problem], int]] = {
    "wall": _walls,
    "group": _groups,
    "support": _supports,
    "zone": _zones,
    "centre": _centres,
}
"""Kind of clique -> its number in a problem."""
