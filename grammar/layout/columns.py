"""Columns and codes of the tables of a layout problem, its state and its proposals, by name; what they hold is said where the tables are.

Kernels read them as attributes of this module, ``problem.link[i, col.MOUNT] == col.FLOOR``, which numba takes as constants.
"""

FLOOR, WALL, CEILING, OBJECT, FIXED = range(5)
"""What holds an object: values of column ``MOUNT``."""

HALF_DEPTH, HALF_WIDTH, INNER_RADIUS, OUTER_RADIUS, BOTTOM, CENTRED, BACK_GAP, SIDE_GAP, BEHIND = range(9)
"""Columns of ``Problem.object``."""

MOUNT, CORE, LEADS, BLOCKS, SOLIDS, ZONES, STRIPS, BOX_END, WALL_MODES, AROUND_MODES, PLACEMENTS, TARGETS, MODE_END, WISH_END, PINNED = (
    range(15)
)
"""Columns of ``Problem.link`` that every problem fills."""

RUN, LEG, TURNS, UNIT_KIND, LIKES_END, FILLS, IN_LINE, JUTS, END_ON = range(15, 24)
"""Columns of ``Problem.link`` about runs."""

WATCHED = 24
"""Column of ``Problem.link`` about screens."""

ZONE_KIND, ZONE_DEPTH = 6, 7
"""Columns of ``Problem.box`` after those of :mod:`grammar.geometry.boxes`."""

GAP = 0
"""First column of ``Problem.mode`` in wall modes."""

MODE_X, MODE_Y = 0, 1
"""First columns of ``Problem.mode`` in modes around a core object."""

DEPTH_FRACTION, WIDTH_FRACTION = 0, 1
"""First columns of ``Problem.mode`` in placements on a support surface."""

MODE_YAW, ODDS_COST, PROBABILITY, NEAR, STRAIGHT = range(2, 7)
"""Columns of ``Problem.mode`` that wall modes, modes around a core object and placements share."""

TARGET, ADDRESS_COST = 0, 1
"""Columns of ``Problem.mode`` in the targets of a support address."""

WISH_TARGET, WISH_NEAR, WISH_COST = range(3)
"""Columns of ``Problem.mode`` in the wishes of a unit of a run."""

END, CORNER_UNIT, WINDOW, LINE, SIDE_WINDOW = -1, -2, -3, -4, -5
"""Values of column ``WISH_TARGET`` beside kinds of units."""

RUN_HEAD, RUN_UNITS, RUN_SLOTS, RUN_SLOTS_END = range(4)
"""Columns of ``Problem.run``."""

DIRECTION, LEG_X, LEG_Y, LEG_YAW, SLIDE, RUN_GAP, RUN_JOINT = 0, 1, 2, 3, 10, 11, 12
"""Columns of ``Problem.slot``; ``LEG_X``, ``LEG_Y`` and ``LEG_YAW`` are those of the first leg, each next leg has three more."""

SURFACE_X, SURFACE_Y, SURFACE_Z, SURFACE_HALF_DEPTH, SURFACE_HALF_WIDTH, SURFACE_OWNER = range(6)
"""Columns of ``Problem.surface``."""

X, Y, YAW, Z = range(4)
"""Columns of ``State.where``, and the first three of ``Proposal.pose``."""

SURFACE, ON_WALL, ACTIVE, PLACE, SLOT = range(5)
"""Columns of ``State.hold``."""

LEADER, NEW_SURFACE, NEW_WALL = range(3)
"""Columns of ``Proposal.tag``."""

NEW_SLOT, NEW_SLIDE, FIRST_UNIT, SECOND_UNIT = 1, 0, 0, 1
"""Of a run that is moved: columns of ``Proposal.tag[0]`` and ``Proposal.pose[0]``, and of ``Proposal.tag[1]``."""

TRIED, ACCEPTED = range(2)
"""Columns of the counts of proposals by move."""
