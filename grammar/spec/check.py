"""Consistency of a grammar: probabilities sum to 1, the And-Or graph and the addresses have no cycles, every symbol is defined."""

from collections.abc import Collection, Mapping, Sequence

from grammar.spec.object_rules import CORE, CORNER, NONE, Mode, ObjectRule
from grammar.spec.room_rules import OPENINGS, SHAPES, OpeningRule, RoomRule
from grammar.spec.rules import MOVES, Branch, Convergence, Grammar, MoveRule, Node, truncated_normals
from grammar.spec.run_rules import CORNER_UNIT, END, SIDE_WINDOW, WINDOW
from grammar.spec.values import range_error
from scene_description import FieldError

_SUM_TOLERANCE = 1e-6


def check_grammar(grammar: Grammar, categories: Collection[str]) -> None:
    """Check a grammar against itself and the names of the known categories.

    Raises:
        FieldError: with the path of the first field that does not fit.
    """
    for path, normal in truncated_normals(grammar):
        if not normal.low <= normal.high:
            raise range_error(f"{path}.low", normal.low, normal.high)
    _check_room(grammar.room)
    _check_openings(grammar.openings)
    for symbol, node in grammar.nodes.items():
        _check_node(grammar, symbol, node)
    for symbol, rule in grammar.objects.items():
        _check_object(grammar, symbol, rule, categories)
    if grammar.root not in grammar.nodes:
        raise FieldError("root", "the symbol of a node", repr(grammar.root))
    _check_cycles(grammar)
    _check_chain(grammar.moves, grammar.schedule.convergence)


def _check_room(room: RoomRule) -> None:
    if room.area_low_m2 >= room.area_high_m2:
        raise range_error("room.area_low_m2", room.area_low_m2, room.area_high_m2)
    if room.sizes:
        _check_sum("room.sizes", [size.probability for size in room.sizes])
    if room.floor_share is not None and room.area_m2 is not None:
        raise FieldError("room.area_m2", "nothing beside floor_share, which decides the area", "both")
    slopes = room.slopes
    if slopes.eaves_height_m.high >= slopes.height_m.low:
        raise range_error("room.slopes.eaves_height_m.high", slopes.eaves_height_m.high, slopes.height_m.low)
    shapes = room.shapes
    _check_sum("room.shapes", [getattr(shapes, name) for name in SHAPES])
    if shapes.notch_low >= shapes.notch_high:
        raise range_error("room.shapes.notch_low", shapes.notch_low, shapes.notch_high)
    for name in ("breast_width_m", "breast_depth_m", "alcove_width_m", "alcove_depth_m", "bay_width_m", "bay_depth_m"):
        low, high = getattr(shapes, name)
        if low >= high:
            raise range_error(f"room.shapes.{name}", low, high)


def _check_openings(openings: Mapping[str, OpeningRule]) -> None:
    for kind, rule in openings.items():
        if kind not in OPENINGS:
            raise FieldError(f"openings.{kind}", f"one of {', '.join(OPENINGS)}", "an unknown key")
        _check_sum(f"openings.{kind}.multiplicity", rule.multiplicity)
    for kind in ("door", "window"):
        if kind not in openings:
            raise FieldError(f"openings.{kind}", "a value", "nothing (the key is missing)")
    if sum(openings["door"].multiplicity[1:]) < 1.0 - _SUM_TOLERANCE:
        raise FieldError("openings.door.multiplicity", "at least one door in every room", f"{openings['door'].multiplicity}")


def _check_chain(moves: MoveRule, test: Convergence) -> None:
    """Check the proposals of the chain and its test of convergence."""
    _check_sum("moves", [getattr(moves, name) for name in MOVES])
    _check_sum("moves.relocate_*", [moves.relocate_uniform, moves.relocate_wall, moves.relocate_around])
    if test.lag < test.window:
        raise FieldError(
            "schedule.convergence.lag", f"at least the window, {test.window}, so that the histograms share no samples", str(test.lag)
        )
    if moves.relocate_uniform <= 0.0:
        raise FieldError("moves.relocate_uniform", "a positive share, so that every pose can be left again", f"{moves.relocate_uniform:g}")


def _check_sum(path: str, probabilities: Sequence[float]) -> None:
    total = sum(probabilities)
    if abs(total - 1.0) > _SUM_TOLERANCE:
        raise FieldError(path, "probabilities that sum to 1", f"a sum of {total:.9g}")


def _check_node(grammar: Grammar, symbol: str, node: Node) -> None:
    path = f"nodes.{symbol}"
    if symbol in grammar.objects:
        raise FieldError(path, "a symbol that is not an object too", repr(symbol))
    for i, branch in enumerate(node.branches):
        _check_branch(f"{path}.branches[{i}]", node.kind, branch)
        if branch.symbol not in grammar.nodes and branch.symbol not in grammar.objects:
            raise FieldError(f"{path}.branches[{i}].symbol", "the symbol of a node or an object", repr(branch.symbol))
    if node.kind == "or":
        _check_sum(f"{path}.branches", [branch.probability or 0.0 for branch in node.branches])


def _check_branch(path: str, kind: str, branch: Branch) -> None:
    for name, owner in (("probability", "or"), ("multiplicity", "set")):
        given = getattr(branch, name) is not None
        if given != (kind == owner):
            wanted = "a value" if kind == owner else f"no value in a node of kind '{kind}'"
            raise FieldError(f"{path}.{name}", wanted, repr(getattr(branch, name)) if given else "nothing (the key is missing)")
    if branch.multiplicity is not None:
        _check_sum(f"{path}.multiplicity", branch.multiplicity)


def _check_object(grammar: Grammar, symbol: str, rule: ObjectRule, categories: Collection[str]) -> None:
    path = f"objects.{symbol}"
    if rule.category not in categories:
        raise FieldError(f"{path}.category", f"one of {', '.join(sorted(categories))}", repr(rule.category))
    _check_sum(f"{path}.sizes", [mode.probability for mode in rule.sizes])
    if rule.heights:
        _check_sum(f"{path}.heights", [mode.probability for mode in rule.heights])
    if rule.heights and rule.centre_height_m is None:
        raise FieldError(f"{path}.heights", "no value without centre_height_m, which bounds them", "a value")
    for low, high in zip(rule.low_m, rule.high_m, strict=True):
        if low >= high:
            raise range_error(f"{path}.low_m", low, high)
    for name in ("cores", "supporters"):
        targets = getattr(rule, name)
        for target in targets or ():
            if target not in grammar.objects and not (name == "cores" and target in (*OPENINGS, CORNER, NONE)):
                also = f", {', '.join(OPENINGS)}, {CORNER} or {NONE}" if name == "cores" else ""
                raise FieldError(f"{path}.{name}", f"symbols of objects{also}", repr(target))
        if targets:
            _check_sum(f"{path}.{name}", list(targets.values()))
    needs = (
        ("centre_height_m", rule.centre_height_m is not None, rule.mount == "wall"),
        ("supporters", bool(rule.supporters), rule.mount == "object"),
        ("placements", bool(rule.placements), rule.mount == "object"),
        ("around", bool(rule.around), bool(rule.cores)),
    )
    for name, given, needed in needs:
        if given != needed:
            reason = f"mount '{rule.mount}'" if name != "around" else ("cores" if needed else "no cores")
            raise FieldError(f"{path}.{name}", f"{'a value' if needed else 'no value'} with {reason}", "a value" if given else "nothing")
    for name in ("wall", "around", "placements"):
        _check_modes(f"{path}.{name}", getattr(rule, name))
    _check_run_unit(grammar, path, rule)
    if rule.wall and rule.mount != "floor":
        raise FieldError(f"{path}.wall", "no value unless mount is 'floor'", "a value")
    _check_dependencies(grammar, symbol, rule)


def _check_run_unit(grammar: Grammar, path: str, rule: ObjectRule) -> None:
    """Check how an object stands in a run, or hangs in line above one."""
    if rule.in_line and (rule.mount != "wall" or not rule.cores):
        raise FieldError(f"{path}.in_line", "mount 'wall' and cores with it", f"mount '{rule.mount}'{'' if rule.cores else ', no cores'}")
    unit = rule.in_run
    if unit is None:
        return
    if rule.mount != "floor" or rule.cores:
        raise FieldError(f"{path}.in_run", "no value unless mount is 'floor' and without cores", "a value")
    if unit.end_on and (unit.turns or unit.stretches):
        raise FieldError(f"{path}.in_run.end_on", "no value with turns or stretches", "a value")
    for name in ("near", "apart"):
        for target in getattr(unit, name) or ():
            if target not in grammar.objects and target not in (END, CORNER_UNIT, WINDOW, SIDE_WINDOW):
                expected = f"symbols of objects, {END}, {CORNER_UNIT}, {WINDOW} or {SIDE_WINDOW}"
                raise FieldError(f"{path}.in_run.{name}", expected, repr(target))


def _check_dependencies(grammar: Grammar, symbol: str, rule: ObjectRule) -> None:
    """Check the fields by which an object's addresses, places and sizes depend on other objects."""
    path, cores = f"objects.{symbol}", rule.cores or {}
    if rule.within is not None and rule.within not in grammar.nodes:
        raise FieldError(f"{path}.within", "the symbol of a node", repr(rule.within))
    if CORNER in cores and rule.mount != "floor":
        raise FieldError(f"{path}.cores", f"no '{CORNER}' unless mount is 'floor'", f"mount '{rule.mount}'")
    for i, mode in enumerate(rule.around):
        for target in mode.of:
            if target not in cores:
                raise FieldError(f"{path}.around[{i}].of", f"cores of the object ({', '.join(cores)})", repr(target))
        if mode.side in ("latch", "hinge") and set(mode.of or cores) != {"door"}:
            raise FieldError(f"{path}.around[{i}].side", "latch or hinge for the core 'door' only", f"cores {', '.join(mode.of or cores)}")
    for core in cores:
        if core != NONE and not any(not mode.of or core in mode.of for mode in rule.around):
            raise FieldError(f"{path}.around", f"a place that is meant for '{core}'", "none")
    if rule.one_each and not cores:
        raise FieldError(f"{path}.one_each", "no value without cores", repr(rule.one_each))
    if rule.same_place_as is not None:
        like = grammar.objects.get(rule.same_place_as)
        if like is None or like.one_each != "place" or len(like.around) != len(rule.placements):
            count = len(rule.placements)
            expected = f"an object with one_each: place and as many places around its core as this one has placements ({count})"
            raise FieldError(f"{path}.same_place_as", expected, repr(rule.same_place_as))
    for i, tie in enumerate(rule.tied):
        names = (*OPENINGS, CORE) if cores else OPENINGS
        if tie.to not in grammar.objects and tie.to not in names:
            raise FieldError(f"{path}.tied[{i}].to", f"the symbol of an object, {', '.join(names[:-1])} or {names[-1]}", repr(tie.to))
        if tie.axis == "middle" and rule.mount != "wall":
            raise FieldError(f"{path}.tied[{i}].axis", "no 'middle' unless mount is 'wall'", "'middle'")


def _check_modes(path: str, modes: Sequence[Mode]) -> None:
    """Check that either all modes of a relation have a probability, positive and summing to 1, or none."""
    given = [mode.probability for mode in modes if mode.probability is not None]
    if given and len(given) < len(modes):
        raise FieldError(path, "a probability in all modes or in none", f"{len(given)} in {len(modes)} modes")
    if given and min(given) <= 0.0:
        raise FieldError(path, "modes with positive probabilities (leave the others out)", f"{min(given):g}")
    if given:
        _check_sum(path, given)


def _check_cycles(grammar: Grammar) -> None:
    """Check that the nodes make a graph without cycles that the root leads to, and that addresses make none either."""
    done: set[str] = set()

    def visit(symbol: str, above: tuple[str, ...]) -> None:
        if symbol in above:
            raise FieldError(f"nodes.{symbol}", "a graph without cycles", " -> ".join((*above[above.index(symbol) :], symbol)))
        if symbol in grammar.nodes and symbol not in done:
            for branch in grammar.nodes[symbol].branches:
                visit(branch.symbol, (*above, symbol))
        done.add(symbol)

    visit(grammar.root, ())
    for symbol in grammar.nodes:
        if symbol not in done:
            raise FieldError(f"nodes.{symbol}", f"nodes that '{grammar.root}' leads to", "a node that nothing leads to")
    for symbol in grammar.objects:
        _check_address_cycles(grammar, symbol, ())


def _check_address_cycles(grammar: Grammar, symbol: str, above: tuple[str, ...]) -> None:
    """Follow all addresses of an object; ``above`` are the symbols that led to it."""
    if symbol in above:
        raise FieldError(f"objects.{symbol}", "addresses without cycles", " -> ".join((*above[above.index(symbol) :], symbol)))
    rule = grammar.objects.get(symbol)
    if rule is not None:
        others = [tie.to for tie in rule.tied if tie.to != CORE] + ([rule.same_place_as] if rule.same_place_as else [])
        for target in dict.fromkeys((*(rule.cores or ()), *(rule.supporters or ()), *others)):
            _check_address_cycles(grammar, target, (*above, symbol))
