"""What the base graph lacks: symbols for what the rooms hold and no rule explains, and members of units that are not always there.

A category that no symbol has, or objects far from all places of their symbols (a television on a wall, a chair without a desk), become
terminals of a Set node below the root.  Their rules begin with what most of their objects show (what holds them, what they stand by) and
are learned like all others.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from grammar.learning.assign import AssignedRoom, assign, is_of
from grammar.learning.category_map import ALSO_SEEN
from grammar.learning.observed import ObservedObject, ObservedRoom, box_gap, nearest_wall
from grammar.learning.sizes import learn_size
from grammar.spec.categories import Categories, Role
from grammar.spec.object_rules import NONE, AroundMode, ObjectRule, PlaceMode, SizeMode, WallMode
from grammar.spec.rules import Branch, Grammar, Node
from grammar.spec.values import TruncatedNormal

PULLED_UP: Role = "pulled_up"
_RAISED_M, _AT_WALL_M, _AT_CEILING_M = 0.3, 0.15, 0.3
_BESIDE_M = 0.5
_MOST_HAVE = 0.6
_OFTEN_MISSING = 0.1
_LEAST_CARRIES = 0.15
_MOST_RATE = 0.9


class Seen(NamedTuple):
    """An object that no symbol explains, in its room; ``below`` is the index of what it stands on."""

    room: ObservedRoom
    item: ObservedObject
    below: int | None


def completed(
    grammar: Grammar, categories: Categories, rooms: Sequence[ObservedRoom], least: int, any_size: bool
) -> tuple[Grammar, Mapping[str, int]]:
    """Return the grammar with symbols for what it lacks, and for each new symbol how many objects asked for it.

    A new symbol needs ``least`` objects and a tenth of its category's, since one of few objects that stand as none should would take the
    others over.  ``any_size``: accept every size of an object that the grammar has.
    """
    assigned = [assign(grammar, room, any_size) for room in rooms]
    in_data = Counter(item.category for room in rooms for item in room.objects)
    unexplained: dict[str, list[Seen]] = {}
    for room in assigned:
        for name, seen in _unexplained(grammar, categories, room, in_data.keys()):
            if seen.item.category in categories:
                unexplained.setdefault(name, []).append(seen)
    asked = {name: max(least, _OFTEN_MISSING * in_data[items[0].item.category]) for name, items in unexplained.items()}
    added = {name: items for name, items in sorted(unexplained.items()) if len(items) >= asked[name]}
    pulled_up = {name for name, items in added.items() if PULLED_UP in categories[items[0].item.category].roles}
    rules = _new_rules(grammar, added, pulled_up)
    added = {name: items for name, items in added.items() if name in rules}
    objects = {**grammar.objects, **rules}
    objects |= _with_loners(grammar, categories, assigned, least)
    nodes = _with_optional(grammar, assigned)
    # what stands for itself is one more choice of a node, or goes below a node of its own
    free = {name: items for name, items in added.items() if objects[name].mount != "object" and name not in pulled_up}
    nodes, chosen = _with_choices(grammar, nodes, free, rooms, in_data)
    free = {name: items for name, items in free.items() if name not in chosen}
    if free:
        branches = tuple(Branch(symbol=name, multiplicity=_multiplicity(items, len(rooms))) for name, items in free.items())
        nodes[ALSO_SEEN] = Node(kind="set", branches=branches)
        nodes, root = _below_root(nodes, grammar.root)
        grammar = replace(grammar, root=root)
    # what is pulled up to others or stands on them goes with these
    for name in sorted(pulled_up & added.keys()):
        for core in objects[name].cores or {}:
            nodes = _carrying(nodes, core, Branch(symbol=name, multiplicity=_at_each(objects[core], added[name], rooms)))
    for name in sorted(name for name in added if objects[name].mount == "object"):
        for supporter, share in (objects[name].supporters or {}).items():
            carried = sum(item.symbol == supporter for room in assigned for item in room.objects)
            rate = min(share * len(added[name]) / max(carried, 1), _MOST_RATE)
            nodes = _carrying(nodes, supporter, Branch(symbol=name, multiplicity=(1.0 - rate, rate)))
    return replace(grammar, nodes=nodes, objects=objects), {name: len(items) for name, items in added.items()}


def _new_rules(grammar: Grammar, added: Mapping[str, Sequence[Seen]], pulled_up: AbstractSet[str]) -> dict[str, ObjectRule]:
    """Return the rules of new symbols, but of those that would have nothing to stand on or be pulled up to."""
    rules: dict[str, ObjectRule] = {}
    for name, items in sorted(added.items(), key=lambda pair: pair[0] in pulled_up):
        rule = _rule(replace(grammar, objects={**grammar.objects, **rules}), items)
        if name in pulled_up:
            rule = _at_cores(rule)
        if (rule.mount != "object" or rule.supporters) and (name not in pulled_up or rule.cores):
            rules[name] = rule
    return rules


def _with_choices(
    grammar: Grammar,
    nodes: Mapping[str, Node],
    free: Mapping[str, Sequence[Seen]],
    rooms: Sequence[ObservedRoom],
    in_data: Mapping[str, int],
) -> tuple[dict[str, Node], set[str]]:
    """Return nodes with one more choice for what never stands beside another one of its category, and which symbols these are."""
    changed, chosen = dict(nodes), set[str]()
    for name, items in free.items():
        choice = _choice_of(grammar.nodes, items[0].item.category, grammar.objects) if _never_both(items, rooms) else None
        if choice is not None:
            share = len(items) / in_data[items[0].item.category]
            others = (replace(branch, probability=(branch.probability or 0.0) * (1.0 - share)) for branch in changed[choice].branches)
            changed[choice] = replace(changed[choice], branches=(*others, Branch(symbol=name, probability=share)))
            chosen.add(name)
    return changed, chosen


def _never_both(items: Sequence[Seen], rooms: Sequence[ObservedRoom]) -> bool:
    """Return whether no room holds more of the category than one object that asks for the new symbol."""
    alone = {id(seen.room) for seen in items}
    category = items[0].item.category
    return all(sum(item.category == category for item in room.objects) == 1 for room in rooms if id(room) in alone)


def _choice_of(nodes: Mapping[str, Node], category: str, objects: Mapping[str, ObjectRule]) -> str | None:
    """Return the Or node that chooses between objects of a category: each of its branches surely leads to one."""

    def holds(symbol: str) -> bool:
        if symbol not in nodes:
            return symbol in objects and objects[symbol].category == category
        within = [holds(branch.symbol) for branch in nodes[symbol].branches]
        kind = nodes[symbol].kind
        return (kind == "and" and any(within)) or (kind == "or" and all(within))

    return next((name for name, node in nodes.items() if node.kind == "or" and holds(name)), None)


def _at_cores(rule: ObjectRule) -> ObjectRule:
    """Return the rule of what is pulled up to its cores: it stands at one and not at walls."""
    cores = {name: weight for name, weight in (rule.cores or {}).items() if name != NONE}
    return replace(rule, cores={name: weight / sum(cores.values()) for name, weight in cores.items()} or None, wall=())


def _at_each(core: ObjectRule, items: Sequence[Seen], rooms: Sequence[ObservedRoom]) -> tuple[float, ...]:
    """Return the shares of a core's copies at which 0, 1, ... of the objects stand."""
    counts: Counter[int] = Counter()
    for room in rooms:
        here = [seen.item for seen in items if seen.room is room]
        copies = [other for other in room.objects if other.category == core.category]
        counts.update(sum(box_gap(item, copy) < _BESIDE_M for item in here) for copy in copies)
    total = max(sum(counts.values()), 1)
    return tuple(counts[k] / total for k in range(max(counts, default=0) + 1))


def _carrying(nodes: Mapping[str, Node], supporter: str, branch: Branch) -> dict[str, Node]:
    """Return the nodes where a Set node beside each copy of a supporter has one more branch; a unit of both is made where there is none."""
    nodes = dict(nodes)
    for node in list(nodes.values()):
        beside = [b.symbol for b in node.branches if b.symbol in nodes and nodes[b.symbol].kind == "set"]
        if node.kind == "and" and beside and supporter in [b.symbol for b in node.branches]:
            nodes[beside[0]] = replace(nodes[beside[0]], branches=(*nodes[beside[0]].branches, branch))
            return nodes
    unit, things = f"{supporter}_with_things", f"{supporter}_things_seen"
    for name, node in nodes.items():
        nodes[name] = replace(node, branches=tuple(replace(b, symbol=unit) if b.symbol == supporter else b for b in node.branches))
    nodes[unit] = Node(kind="and", branches=(Branch(symbol=supporter), Branch(symbol=things)))
    nodes[things] = Node(kind="set", branches=(branch,))
    return nodes


def _unexplained(grammar: Grammar, categories: Categories, room: AssignedRoom, recorded: AbstractSet[str]) -> list[tuple[str, Seen]]:
    """Return what has no symbol, or one that does not fit how it stands, with the name of the symbol that it asks for.

    A core that the rooms do not hold is missed only if its category is among the ``recorded`` ones.  What is pulled up to a table is
    expected at one: sampled rooms where it stands elsewhere are passed over (``chair_at_no_table``), so it gets no symbol for that.
    """
    found = [(_name(grammar, seen), Seen(room.room, seen, below)) for seen, below in room.left_over]
    for item in room.objects:
        rule = grammar.objects[item.symbol]
        cores = {grammar.objects[core].category for core in rule.cores or () if core in grammar.objects}
        free = rule.mount == "floor" and PULLED_UP not in categories[rule.category].roles
        alone = free and bool(cores & recorded) and NONE not in (rule.cores or {}) and not item.core_offered
        raised = rule.mount == "object" and item.on is None
        if alone or raised:
            found.append((_name(grammar, item.seen), Seen(room.room, item.seen, None)))
    return found


def _name(grammar: Grammar, item: ObservedObject) -> str:
    name = item.name or item.category
    return f"{name}_apart" if name in grammar.objects or name in grammar.nodes else name


def _multiplicity(items: Sequence[Seen], rooms: int) -> tuple[float, ...]:
    """Return the shares of rooms with 0, 1, ... of the objects."""
    by_room = Counter(id(seen.room) for seen in items)
    counts = Counter(by_room.values())
    return tuple((rooms - len(by_room) if k == 0 else counts[k]) / rooms for k in range(max(counts) + 1))


def _below_root(nodes: Mapping[str, Node], root: str) -> tuple[dict[str, Node], str]:
    """Return the nodes with the new Set node below the root, which is an And node."""
    if nodes[root].kind == "and":
        return {**nodes, root: replace(nodes[root], branches=(*nodes[root].branches, Branch(symbol=ALSO_SEEN)))}, root
    above = f"{root}_and_more"
    return {above: Node(kind="and", branches=(Branch(symbol=root), Branch(symbol=ALSO_SEEN))), **nodes}, above


def _rule(grammar: Grammar, items: Sequence[Seen]) -> ObjectRule:
    """Return a rule with what most of the objects show; the details are learned like those of all rules."""
    sizes = np.array([seen.item.size_m for seen in items])
    mean, sd = sizes.mean(0), np.maximum(sizes.std(0), 0.02 * sizes.mean(0))
    mount = Counter(map(_mount, items)).most_common(1)[0][0]
    shown = [seen for seen in items if _mount(seen) == mount]
    low, high = 0.9 * sizes.min(0), 1.1 * sizes.max(0)
    rule = ObjectRule(
        category=items[0].item.category,
        mount=mount,  # type: ignore[arg-type]
        sizes=(SizeMode(mean_m=_three(mean), sd_m=_three(sd)),),
        low_m=_three(low),
        high_m=_three(high),
    )
    rule = learn_size(rule, [seen.item.size_m for seen in items], 0.0)
    if mount == "object":
        supporters = _supporters(grammar, shown)
        return replace(rule, supporters=supporters, placements=(PlaceMode(orientation_rad=None),))
    if mount == "wall":
        middles = np.array([seen.item.position_m[2] + 0.5 * seen.item.size_m[2] for seen in shown])
        return replace(
            rule,
            centre_height_m=TruncatedNormal(
                mean=float(middles.mean()), sd=max(float(middles.std()), 0.02), low=float(middles.min()), high=float(middles.max()) + 0.01
            ),
        )
    if mount == "ceiling":
        return replace(rule, room_centre=True)
    core = _core(grammar, shown)
    around = (AroundMode(side="front", gap_m=0.1), AroundMode(side="left", gap_m=0.1), AroundMode(side="right", gap_m=0.1))
    if core:
        return replace(rule, wall=(WallMode(distance_m=0.02),), cores=core, around=around)
    return replace(rule, wall=(WallMode(distance_m=0.02),))


def _mount(seen: Seen) -> str:
    """Return what holds an object."""
    bottom, height = seen.item.position_m[2], seen.item.size_m[2]
    if seen.below is not None:
        return "object"
    if bottom + height > seen.room.height_m - _AT_CEILING_M and bottom > 0.5 * seen.room.height_m:
        return "ceiling"
    pose = nearest_wall(seen.room.polygon_m, seen.item)
    return "wall" if bottom > _RAISED_M and pose is not None and pose.gap_m < _AT_WALL_M else "floor"


def _supporters(grammar: Grammar, items: Sequence[Seen]) -> dict[str, float]:
    """Return the symbols that carry the objects, by how often they do."""
    counts: Counter[str] = Counter()
    for seen in items:
        below = seen.room.objects[seen.below or 0]
        symbols = [symbol for symbol, rule in grammar.objects.items() if is_of(symbol, rule, below)]
        counts.update({symbol: 1.0 / len(symbols) for symbol in symbols})  # type: ignore[arg-type]
    total = sum(counts.values())
    kept = {symbol: count for symbol, count in counts.items() if count >= _LEAST_CARRIES * total}
    return {symbol: count / sum(kept.values()) for symbol, count in kept.items()}


def _core(grammar: Grammar, items: Sequence[Seen]) -> dict[str, float] | None:
    """Return the symbols of the category that most of the objects stand by, or None."""
    near: Counter[str] = Counter()
    for seen in items:
        near.update(
            {
                o.category
                for o in seen.room.objects
                if o is not seen.item and box_gap(seen.item, o) < _BESIDE_M and o.position_m[2] < _RAISED_M
            }
        )
    near.pop(items[0].item.category, None)
    category, count = near.most_common(1)[0] if near else ("", 0)
    symbols = [symbol for symbol, rule in grammar.objects.items() if rule.category == category and rule.mount == "floor" and not rule.cores]
    if count < _MOST_HAVE * len(items) or not symbols:
        return None
    return {**{symbol: 0.8 / len(symbols) for symbol in symbols}, NONE: 0.2}


def _with_loners(grammar: Grammar, categories: Categories, rooms: Sequence[AssignedRoom], least: int) -> dict[str, ObjectRule]:
    """Return the rules of what often stands far from every core in the room: it may have none, and stands at walls then.

    What has places of its own around a core (``one_each``), a chair at a table, keeps to them.
    """
    found: dict[str, ObjectRule] = {}
    for symbol, rule in grammar.objects.items():
        followed = any(other.same_place_as == symbol for other in grammar.objects.values())
        pulled_up = PULLED_UP in categories[rule.category].roles
        if rule.mount != "floor" or not rule.cores or NONE in rule.cores or followed or pulled_up or rule.one_each:
            continue
        offered = [item for room in rooms for item in room.objects if item.symbol == symbol and item.core_offered]
        alone = sum(item.core is None for item in offered)
        if alone >= least and alone > _OFTEN_MISSING * len(offered):
            share = alone / len(offered)
            cores = {**{name: weight * (1.0 - share) for name, weight in rule.cores.items()}, NONE: share}
            found[symbol] = replace(rule, cores=cores, wall=rule.wall or (WallMode(distance_m=0.02),))
    return found


def _with_optional(grammar: Grammar, rooms: Sequence[AssignedRoom]) -> dict[str, Node]:
    """Return the nodes where what units often lack in the rooms is a branch that may be missing, with a probability to learn.

    A unit is counted by its first symbol, so that one must occur in no other node.
    """
    counts = [Counter(item.symbol for item in room.objects) for room in rooms]
    nodes = dict(grammar.nodes)
    named = Counter(branch.symbol for node in nodes.values() for branch in node.branches)
    for name, node in grammar.nodes.items():
        first = node.branches[0].symbol
        if node.kind != "and" or name == grammar.root or named[first] > 1:
            continue
        branches = list(node.branches)
        for k, branch in enumerate(branches[1:], 1):
            lacking = sum(max(count[first] - count[branch.symbol], 0) for count in counts)
            there, total = sum(count[branch.symbol] for count in counts), sum(count[first] for count in counts)
            if branch.symbol in grammar.objects and there and lacking > _OFTEN_MISSING * total:
                maybe = f"{name}_{branch.symbol}"
                share = lacking / total
                nodes[maybe] = Node(kind="set", branches=(Branch(symbol=branch.symbol, multiplicity=(share, 1.0 - share)),))
                branches[k] = replace(branch, symbol=maybe)
        nodes[name] = replace(node, branches=tuple(branches))
    return nodes


def _three(values: np.ndarray) -> tuple[float, float, float]:
    return float(values[0]), float(values[1]), float(values[2])
