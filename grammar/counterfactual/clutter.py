"""Clutter: how many small things stand on furniture."""

from dataclasses import replace

from grammar.counterfactual.addition import MOST, next_id
from grammar.counterfactual.change import ChangeError, InvalidChangeError, Outcome, Work, random_numbers
from grammar.counterfactual.gate import categories_of, checked, grammar_of
from grammar.counterfactual.rearrangement import taken_out
from grammar.counterfactual.surfaces import dressed
from grammar.counterfactual.values import number
from grammar.small_things.fill import Filling, Source
from grammar.small_things.strew import small_things
from grammar.spec.request import SceneRequest
from scene_description import SceneDescription, SceneObject
from scene_description.types import MAX_OBJECTS

_MOST_CLUTTER = 10.0
_MAX_SEED = 2**63 - 1


def clutter(work: Work) -> list[SceneObject]:
    """Return the small things of a scene that carry nothing: neither lamps nor screens that are watched."""
    scene, rules = work.scene, work.rules()
    carriers = {item.support.id for item in scene.objects}
    small = small_things(
        scene.objects, categories_of(rules, scene), tuple({item.category for item in scene.objects if item.id in _lit(scene)})
    )
    return [item for item in scene.objects if item.id in small - carriers]


def _lit(scene: SceneDescription) -> set[int]:
    return {light.object for light in scene.lights}


def scale_clutter(work: Work) -> Outcome:
    """Take small things away, or put more on what carries things, in an order that the seed draws."""
    factor, scene = number(work.change, 0.0, 10.0), work.scene
    things = clutter(work)
    if not things:
        raise ChangeError(f"{work.change}: expected small things on the furniture, got none; see the factor object_added")
    wanted = round(factor * len(things))
    if wanted <= len(things):
        order = random_numbers(scene, work.change).permutation(len(things))
        return taken_out(work, [things[k] for k in order[: len(things) - wanted]])
    if wanted - len(things) > MOST:
        raise ChangeError(f"{work.change}: value: expected at most {MOST} more than the {len(things)} things, got {wanted - len(things)}")
    return _more(work, len(things), wanted)


def _more(work: Work, there: int, wanted: int) -> Outcome:
    """Return the scene with more small things, by the counts of its supports, as growing clutter brings them."""
    rules, scene, rng = work.rules(), work.scene, random_numbers(work.scene, work.change)
    request = SceneRequest(clutter=_MOST_CLUTTER, max_objects=MAX_OBJECTS)
    grammar, categories = grammar_of(rules, scene), categories_of(rules, scene)
    source = Source(rules=rules.small_things, grammar=grammar, categories=categories, request=request, sizes_m={})
    filling = Filling(source, scene.room, scene.objects, int(rng.integers(_MAX_SEED)))
    new: list[int] = []
    ids = {item.id: item.id for item in scene.objects}  # of the filling -> of the scene
    for placed in filling.things(scene.objects, since=1.0):
        if len(new) == wanted - there:
            break
        if placed.item.support.kind == "object" and placed.item.support.id in ids:
            ids[placed.item.id] = next_id(scene)
            support = replace(placed.item.support, id=ids[placed.item.support.id])
            item = replace(placed.item, id=ids[placed.item.id], support=support)
            scene, item = dressed(random_numbers(work.scene, work.change, len(new)), rules, scene, item)
            scene = replace(scene, objects=(*scene.objects, item))
            new.append(item.id)
    if len(new) < wanted - there:
        raise InvalidChangeError(
            f"{work.change}: value {work.change.value}: expected places for {wanted} small things, got {there + len(new)}; ask for less", ()
        )
    return Outcome(checked(rules, work.scene, scene, work.change), objects=tuple(new))
