"""Columns and codes of the tables of a layout problem, its state and its proposals, each with its place and what it holds.

Kernels read them as attributes of this module, ``problem.link[i, col.MOUNT] == col.FLOOR``, which numba takes as constants.  A table has as
many columns as its allocation has given places: the ``..._WIDTH`` after them.
"""

from grammar.geometry.boxes import LOCAL_BOX_WIDTH
from grammar.geometry.run_slots import LEG_COLUMNS as LEG_COLUMNS
from grammar.geometry.run_slots import MOST_LEGS


class Columns:
    """Gives the columns of a table their places, one after another, from the ``width`` that is taken."""

    def __init__(self, width: int = 0) -> None:
        self.width = width

    def column(self, count: int = 1) -> int:
        """Return the place of the next column, or of the first of ``count`` that follow one another."""
        place = self.width
        self.width += count
        return place


# Problem.object, (n, OBJECT_WIDTH): sizes and distances of objects, metres.
_object = Columns()
HALF_DEPTH = _object.column()
HALF_WIDTH = _object.column()
INNER_RADIUS = _object.column()  # of the circle about the origin around the solids
OUTER_RADIUS = _object.column()  # of that around solids and zones
BOTTOM = _object.column()  # height of the underside of what does not stand on an object
CENTRED = _object.column()  # 1 where it is drawn to the centroid of the floor
BACK_GAP = _object.column()  # greatest gap between its back and a wall, infinite where it may stand anywhere
SIDE_GAP = _object.column()  # the same between one of its sides and a wall
BEHIND = _object.column()  # how far its back stands off the line of its row of units
OBJECT_WIDTH = _object.width

# Problem.link, (n, LINK_WIDTH): what objects are to each other, and where their rows begin in other tables.
_link = Columns()
MOUNT = _link.column()  # FLOOR, WALL, ...
CORE = _link.column()  # index of the core object or -1
LEADS = _link.column()  # 1 where something may stand on it or be grouped around it
BLOCKS = _link.column()  # 1 where it takes floor from a robot
SOLIDS = _link.column()  # first row of its solids in Problem.box
ZONES = _link.column()  # first row of its zones there
STRIPS = _link.column()  # first row of the strips by which it is reached
BOX_END = _link.column()  # end of these
WALL_MODES = _link.column()  # first row of its wall modes in Problem.mode
AROUND_MODES = _link.column()  # first row of its modes around the core there
PLACEMENTS = _link.column()  # first row of its placements
TARGETS = _link.column()  # first row of the targets of its support address
MODE_END = _link.column()  # end of these, first row of its wishes in a row of units
WISH_END = _link.column()  # end of these
PINNED = _link.column()  # 1 where it stays put
ROW = _link.column()  # of units: the row that they stand in, or -1
LEG = _link.column()  # number of a leg; legs belong to places: the k-th unit of a row, by index, has that of place k
TURNS = _link.column()  # 1 where it turns
UNIT_KIND = _link.column()  # a number for its symbol
LIKES_END = _link.column()  # 1 where it likes the end
FILLS = _link.column()  # 1 where it carries something in line or stands as high
IN_LINE = _link.column()  # 1 where it hangs in line, and moves only with its unit
JUTS = _link.column()  # 1 where it juts out
END_ON = _link.column()  # 1 where it stands end-on
WATCHED = _link.column()  # of screens: index of the seat that they are watched from; of all else -1
LOUNGES = _link.column()  # 1 where people lounge on it or at it
LINK_WIDTH = _link.width

FLOOR, WALL, CEILING, OBJECT, FIXED = range(5)
"""What holds an object: values of column ``MOUNT``."""

# Problem.box, (m, BOX_WIDTH): the columns of boxes in their object's frame (grammar.geometry.boxes), and of zones two more.
_box = Columns(LOCAL_BOX_WIDTH)
ZONE_KIND = _box.column()
ZONE_DEPTH = _box.column()
BOX_WIDTH = _box.width

# Problem.mode, (k, MODE_WIDTH): modes, and rows of two other kinds.
_mode = Columns()
GAP = MODE_X = DEPTH_FRACTION = _mode.column()  # gap to the wall; x in the core's frame; fraction of the depth of a support (NaN: any)
MODE_Y = WIDTH_FRACTION = _mode.column()  # 0 in wall modes; y in the core's frame; fraction of the width of a support (NaN: any)
MODE_YAW = _mode.column()  # yaw against wall, core or surface (NaN: any)
ODDS_COST = _mode.column()  # -log of the density at the middle over that of the object's densest mode, over the inverse temperature
PROBABILITY = _mode.column()
NEAR = _mode.column()  # factor of the distance, 1 over the mode's spread
STRAIGHT = _mode.column()  # factor of the angle, 1 over its spread
MODE_WIDTH = _mode.width
_target = Columns()
TARGET = _target.column()  # of a support address: index of a support surface
ADDRESS_COST = _target.column()  # -log of its probability, over the inverse temperature
_wish = Columns()
WISH_TARGET = _wish.column()  # of a unit: kind of unit, or a code below
WISH_NEAR = _wish.column()  # 1 for near, 0 for apart
WISH_COST = _wish.column()  # nat, over the inverse temperature

END, CORNER_UNIT, WINDOW, LINE, SIDE_WINDOW, NOTHING = -1, -2, -3, -4, -5, -9
"""Values of column ``WISH_TARGET`` beside kinds of units."""

# Problem.surface, (s, SURFACE_WIDTH): support surfaces, their middles in the owner's frame, metres.
_surface = Columns()
SURFACE_X = _surface.column()
SURFACE_Y = _surface.column()
SURFACE_Z = _surface.column()
SURFACE_HALF_DEPTH = _surface.column()
SURFACE_HALF_WIDTH = _surface.column()
SURFACE_OWNER = _surface.column()  # index
SURFACE_WIDTH = _surface.width

# Problem.row, (r, ROW_WIDTH)
_row = Columns()
ROW_HEAD = _row.column()  # index of the unit that stands for all of them in moves
ROW_UNITS = _row.column()  # number of units
ROW_SLOTS = _row.column()  # first row in Problem.slot
ROW_SLOTS_END = _row.column()
ROW_WIDTH = _row.width

# Problem.slot, (q, SLOT_WIDTH): the fields of grammar.geometry.run_slots.Slot, and two gaps.
_slot = Columns()
DIRECTION = _slot.column()
LEG_X = _slot.column(MOST_LEGS * LEG_COLUMNS)  # of the first leg; each next one has LEG_COLUMNS more
LEG_Y, LEG_YAW = LEG_X + 1, LEG_X + 2
SLIDE = _slot.column()
ROW_GAP = _slot.column()  # between units and walls
ROW_JOINT = _slot.column()  # between units
SLOT_WIDTH = _slot.width

# State.where, (n, WHERE_WIDTH), and Proposal.pose, (2, POSE_WIDTH), which has no heights.
_where = Columns()
X = _where.column()
Y = _where.column()
YAW = _where.column()
POSE_WIDTH = _where.width
Z = _where.column()  # of the underside
WHERE_WIDTH = _where.width

# State.hold, (n, HOLD_WIDTH)
_hold = Columns()
SURFACE = _hold.column()  # the support surface that an object stands on, else -1
ON_WALL = _hold.column()  # the wall that it hangs on, else -1
ACTIVE = _hold.column()  # 1 once it takes part
PLACE = _hold.column()  # of a unit: its place in its row of units, else -1
SLOT = _hold.column()  # the slot of that row of units, else -1
HOLD_WIDTH = _hold.width

# Proposal.tag, (2, TAG_WIDTH)
_tag = Columns()
LEADER = _tag.column()  # index of an object
NEW_SURFACE = _tag.column()
NEW_WALL = _tag.column()
TAG_WIDTH = _tag.width

# Of a row of units that is moved: columns of Proposal.tag[0] and Proposal.pose[0], and of Proposal.tag[1].
NEW_SLOT, NEW_SLIDE, FIRST_UNIT, SECOND_UNIT = NEW_SURFACE, X, LEADER, NEW_SURFACE

TRIED, ACCEPTED = range(2)
"""Columns of the counts of proposals by move."""
