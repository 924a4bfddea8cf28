"""What makes a grammar file a grammar: probabilities that add up, a graph without cycles, references that lead somewhere."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from grammar.spec.rules import CORNER, MOVES, NONE, Branch, Grammar, Mode, Node, ObjectRule, normals, range_error
from scene_description import FieldError

_SUM_TOLERANCE = 1e-6
OPENINGS = ("door", "window")


def check_grammar(grammar: Grammar, categories: Collection[str]) -> None:
    """Check a grammar against itself and the names of the known categories.

    Raises:
        FieldError: with the path of the first thing that does not fit.
    """
    for path, normal in normals(grammar):
        if not normal.low <= normal.high:
            raise range_error(f"{path}.low", normal.low, normal.high)
    if grammar.room.area_low_m2 >= grammar.room.area_high_m2:
        raise range_error("room.area_low_m2", grammar.room.area_low_m2, grammar.room.area_high_m2)
    shapes = grammar.room.shapes
    _check_sum("room.shapes", [shapes.rectangle, shapes.l_shape, shapes.t_shape, shapes.u_shape])
    if shapes.notch_low >= shapes.notch_high:
        raise range_error("room.shapes.notch_low", shapes.notch_low, shapes.notch_high)
    for kind, opening in grammar.openings.items():
        if kind not in OPENINGS:
            raise FieldError(f"openings.{kind}", f"one of {', '.join(OPENINGS)}", "an unknown key")
        _check_sum(f"openings.{kind}.multiplicity", opening.multiplicity)
    for kind in OPENINGS:
        if kind not in grammar.openings:
            raise FieldError(f"openings.{kind}", "a value", "nothing (the key is missing)")
    if sum(grammar.openings["door"].multiplicity[1:]) < 1.0 - _SUM_TOLERANCE:
        raise FieldError("openings.door.multiplicity", "at least one door in every room", f"{grammar.openings['door'].multiplicity}")
    for symbol, node in grammar.nodes.items():
        _check_node(grammar, symbol, node)
    for symbol, thing in grammar.objects.items():
        _check_object(grammar, symbol, thing, categories)
    if grammar.root not in grammar.nodes:
        raise FieldError("root", "the symbol of a node", repr(grammar.root))
    _check_cycles(grammar)
    _check_sum("moves", [getattr(grammar.moves, name) for name in MOVES])
    moves = grammar.moves
    _check_sum("moves.relocate_*", [moves.relocate_uniform, moves.relocate_wall, moves.relocate_around])
    test = grammar.schedule.convergence
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


def _check_object(grammar: Grammar, symbol: str, thing: ObjectRule, categories: Collection[str]) -> None:
    path = f"objects.{symbol}"
    if thing.category not in categories:
        raise FieldError(f"{path}.category", f"one of {', '.join(sorted(categories))}", repr(thing.category))
    _check_sum(f"{path}.sizes", [mode.probability for mode in thing.sizes])
    for low, high in zip(thing.low_m, thing.high_m, strict=True):
        if low >= high:
            raise range_error(f"{path}.low_m", low, high)
    for name in ("cores", "supporters"):
        targets = getattr(thing, name)
        for target in targets or ():
            if target not in grammar.objects and not (name == "cores" and target in (*OPENINGS, CORNER, NONE)):
                also = f", {', '.join(OPENINGS)}, {CORNER} or {NONE}" if name == "cores" else ""
                raise FieldError(f"{path}.{name}", f"symbols of objects{also}", repr(target))
        if targets:
            _check_sum(f"{path}.{name}", list(targets.values()))
    needs = (
        ("centre_height_m", thing.centre_height_m is not None, thing.mount == "wall"),
        ("supporters", bool(thing.supporters), thing.mount == "object"),
        ("placements", bool(thing.placements), thing.mount == "object"),
        ("around", bool(thing.around), bool(thing.cores)),
    )
    for name, given, needed in needs:
        if given != needed:
            reason = f"mount '{thing.mount}'" if name != "around" else ("cores" if needed else "no cores")
            raise FieldError(f"{path}.{name}", f"{'a value' if needed else 'no value'} with {reason}", "a value" if given else "nothing")
    for name in ("wall", "around", "placements"):
        _check_modes(f"{path}.{name}", getattr(thing, name))
    if thing.wall and thing.mount != "floor":
        raise FieldError(f"{path}.wall", "no value unless mount is 'floor'", "a value")
    _check_unit(grammar, symbol, thing)


def _check_unit(grammar: Grammar, symbol: str, thing: ObjectRule) -> None:
    """Check what makes an object's addresses and measures depend on those of others."""
    path, cores = f"objects.{symbol}", thing.cores or {}
    if thing.within is not None and thing.within not in grammar.nodes:
        raise FieldError(f"{path}.within", "the symbol of a node", repr(thing.within))
    if CORNER in cores and thing.mount != "floor":
        raise FieldError(f"{path}.cores", f"no '{CORNER}' unless mount is 'floor'", f"mount '{thing.mount}'")
    for i, mode in enumerate(thing.around):
        for target in mode.of:
            if target not in cores:
                raise FieldError(f"{path}.around[{i}].of", f"cores of the object ({', '.join(cores)})", repr(target))
    for core in cores:
        if core != NONE and not any(not mode.of or core in mode.of for mode in thing.around):
            raise FieldError(f"{path}.around", f"a place that is meant for '{core}'", "none")
    if thing.one_each and not cores:
        raise FieldError(f"{path}.one_each", "no value without cores", repr(thing.one_each))
    if thing.same_place_as is not None:
        like = grammar.objects.get(thing.same_place_as)
        if like is None or like.one_each != "place" or len(like.around) != len(thing.placements):
            count = len(thing.placements)
            expected = f"an object with one_each: place and as many places around its core as this one has placements ({count})"
            raise FieldError(f"{path}.same_place_as", expected, repr(thing.same_place_as))
    for i, tie in enumerate(thing.tied):
        if tie.to not in grammar.objects and tie.to not in OPENINGS:
            raise FieldError(f"{path}.tied[{i}].to", f"the symbol of an object, {' or '.join(OPENINGS)}", repr(tie.to))
        if tie.axis == "middle" and thing.mount != "wall":
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
        _check_pointers(grammar, symbol, ())


def _check_pointers(grammar: Grammar, symbol: str, above: tuple[str, ...]) -> None:
    if symbol in above:
        raise FieldError(f"objects.{symbol}", "addresses without cycles", " -> ".join((*above[above.index(symbol) :], symbol)))
    thing = grammar.objects.get(symbol)
    if thing is not None:
        others = [tie.to for tie in thing.tied] + ([thing.same_place_as] if thing.same_place_as else [])
        for target in dict.fromkeys((*(thing.cores or ()), *(thing.supporters or ()), *others)):
            _check_pointers(grammar, target, (*above, symbol))
