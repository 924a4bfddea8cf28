"""Groups as people leave them: a core in its place, and the things of its Set node beside it or, by address nodes, on each other."""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from grammar.derivation.densities import draw_index
from grammar.small_things.place import GAP_M, TRIALS, Newcomer, Top, clear_of, in_frame, on_top, tops_of
from grammar.small_things.rules import Group, Member
from grammar.small_things.sites import Carrier, Surroundings
from grammar.small_things.walls import below_hooks
from scene_description import SceneObject

_MESSY_SPREAD = 3.0


class Joined(NamedTuple):
    """A thing that joined a group: itself, log-probability of the number of its kind, and of its supporter where it chose one."""

    item: SceneObject
    log_count: float
    log_address: float | None


def members(
    rng: np.random.Generator,
    group: Group,
    core: SceneObject,
    carrier: Carrier,
    mess: float,
    around: Surroundings,
    newcomer: Callable[[str], Newcomer | None],
) -> Iterator[Joined]:
    """Yield the members of a group in their places; where none is free a thing is left out.

    Args:
        rng: source of randomness.
        group: its rule.
        core: its core, in its place.
        carrier: what carries the core.
        mess: 0 tidy to 1 messy.
        around: the room; the one that takes what is yielded adds it to this.
        newcomer: name -> a thing without a place, None where no more of its kind may come.
    """
    there: dict[str, list[SceneObject]] = {core.category: [core]}
    for member in group.members:
        count = draw_index(rng, member.multiplicity)
        log_count = math.log(member.multiplicity[count])
        for _ in range(count):
            new = newcomer(member.thing)
            owners = there.get(member.upon, []) if member.upon else []
            if new is None or (member.upon and not owners):
                break
            if owners:
                owner = owners[int(rng.integers(len(owners)))]
                tops = tops_of(around.categories[owner.category], owner, seat=False)
                found = on_top(rng, new, owner, tops, mess, around.fits, around.taken)
            elif member.below:
                found = below_hooks(rng, new, core, around.fits, around.taken.with_more(carrier.free))
            else:
                found = _beside(rng, new, member, core, carrier, mess, around)
            if found is not None:
                there.setdefault(member.thing, []).append(found)
                yield Joined(found, log_count, -math.log(len(owners)) if owners else None)
                log_count = 0.0


def _beside(
    rng: np.random.Generator,
    new: Newcomer,
    member: Member,
    core: SceneObject,
    carrier: Carrier,
    mess: float,
    around: Surroundings,
) -> SceneObject | None:
    """Return a member near its place beside the core, on the same surface; None where no drawn pose is free."""
    taken = around.taken.with_more(carrier.free)
    for trial in range(TRIALS):
        spread = (member.sd_m + 0.01 * trial) * (1.0 + _MESSY_SPREAD * mess)
        x, y = (at + spread * float(rng.standard_normal()) for at in member.at_m)
        wobble = (0.05 + 0.6 * mess) * float(rng.standard_normal())
        turn = float(rng.uniform(-math.pi, math.pi)) if member.turn is None else member.turn + wobble
        placed = in_frame(new.item, core, x, y, 0.0, turn, core.support)
        on_it = carrier.item is None or _carried(placed, carrier.item, carrier.tops)
        if on_it and around.fits(placed) and clear_of(new, placed, taken):
            return placed
    return None


def _carried(item: SceneObject, owner: SceneObject, tops: Sequence[Top]) -> bool:
    """Return whether a footprint lies within the surface of its owner at its height."""
    dx, dy = item.position_m[0] - owner.position_m[0], item.position_m[1] - owner.position_m[1]
    c, s = math.cos(owner.yaw_rad), math.sin(owner.yaw_rad)
    x, y, turn = dx * c + dy * s, dy * c - dx * s, item.yaw_rad - owner.yaw_rad
    half = 0.5 * item.size_m[0], 0.5 * item.size_m[1]
    reach_x = half[0] * abs(math.cos(turn)) + half[1] * abs(math.sin(turn))
    reach_y = half[0] * abs(math.sin(turn)) + half[1] * abs(math.cos(turn))
    return any(
        abs(owner.position_m[2] + top.z - item.position_m[2]) < GAP_M
        and abs(x - top.x) + reach_x <= top.half_depth
        and abs(y - top.y) + reach_y <= top.half_width
        for top in tops
    )
