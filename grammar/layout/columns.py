"""Columns and codes of the tables of a layout problem, its state and its proposals, by name; what they hold is said where the tables are.

Kernels read them as attributes of this module, ``problem.link[i, col.MOUNT] == col.FLOOR``, which numba takes as constants.
"""

FLOOR, WALL, CEILING, OBJECT, FIXED = range(5)
"""What holds an object: values of column ``MOUNT``."""

HALF_DEPTH, HALF_WIDTH, INNER_RADIUS, OUTER_RADIUS, BOTTOM, CENTRED, BACK_GAP = range(7)
"""Columns of ``Problem.object``."""

MOUNT, CORE, LEADS, BLOCKS, SOLIDS, ZONES, STRIPS, BOX_END, WALL_MODES, AROUND_MODES, PLACEMENTS, TARGETS, MODE_END, PINNED = range(14)
"""Columns of ``Problem.link``."""

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

SURFACE_X, SURFACE_Y, SURFACE_Z, SURFACE_HALF_DEPTH, SURFACE_HALF_WIDTH, SURFACE_OWNER = range(6)
"""Columns of ``Problem.surface``."""

X, Y, YAW, Z = range(4)
"""Columns of ``State.where``, and the first three of ``Proposal.pose``."""

SURFACE, ON_WALL, ACTIVE = range(3)
"""Columns of ``State.hold``."""

LEADER, NEW_SURFACE, NEW_WALL = range(3)
"""Columns of ``Proposal.tag``."""

TRIED, ACCEPTED = range(2)
"""Columns of the counts of proposals by move."""
