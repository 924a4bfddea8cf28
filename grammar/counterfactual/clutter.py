"""Clutter: how many small things stand on furniture."""

from __future__ import annotations

from grammar.counterfactual.addition import MOST, added, addressed
from grammar.counterfactual.change import ChangeError, InvalidChangeError, random_numbers
from grammar.counterfactual.factor import Factor, Outcome, Work
from grammar.counterfactual.gate import grammar_of
from grammar.counterfactual.removal import taken_out
from grammar.counterfactual.values import number
from scene_description import SceneDescription, SceneObject

_TRIED = 8
"""Kinds of things that are tried before a place for one more is given up."""


def clutter(scene: SceneDescription) -> list[SceneObject]:
    """Return what stands on other objects, carries nothing and is no lamp."""
    carriers = {item.support.id for item in scene.objects}
    lamps = {light.object for light in scene.lights}
    return [item for item in scene.objects if item.support.kind == "object" and item.id not in carriers | lamps]


def scale_clutter(work: Work) -> Outcome:
    """Take small things away, or put more on what carries things, in an order that the seed draws."""
    factor, scene = number(work.change, 0.0, 10.0), work.scene
    things = clutter(scene)
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
    """Return the scene with more small things."""
    rules, new = work.rules(), []
    small = [
        rule
        for rule in grammar_of(rules, work.scene).objects.values()
        if rule.mount == "object" and rule.category not in rules.lighting.lamps and addressed(work.scene, rule.supporters)
    ]
    if not small:
        raise ChangeError(
            f"{work.change}: expected furniture that small things of a {work.scene.category} stand on, got none; see object_added"
        )
    scene, last = work.scene, InvalidChangeError("", ())
    for k in range(wanted - there):
        for trial in range(_TRIED):
            rng = random_numbers(work.scene, work.change, k, trial)
            try:
                scene = added(rng, work, scene, small[int(rng.integers(len(small)))])
            except InvalidChangeError as error:
                last = error
                continue
            new.append(scene.objects[-1].id)
            break
        else:
            raise InvalidChangeError(
                f"{work.change}: value {work.change.value}: expected places for {wanted} small things, got {there + k}; ask for less",
                last.checks,
            )
    return Outcome(scene, objects=tuple(new))


FACTORS = (
    Factor(
        name="clutter",
        label="clutter",
        unit=None,
        value="factor on the number of small things that stand on furniture, lamps not counted, 0 to 10; 1: as it is",
        attribute="objects",
        touches="geometry",
        make=scale_clutter,
        current=lambda work: 1.0,
    ),
)
