"""Objects put into a room: of a category, at a place where the room stays valid."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from grammar.counterfactual.change import ChangeError, InvalidChangeError, random_numbers
from grammar.counterfactual.factor import Factor, Outcome, Work
from grammar.counterfactual.gate import categories_of, checked, grammar_of
from grammar.counterfactual.looks import dressed, lit
from grammar.counterfactual.places import free_places
from grammar.counterfactual.targets import all_things
from grammar.counterfactual.values import whole
from grammar.derivation.densities import draw_size
from grammar.spec.object_rules import ObjectRule
from grammar.spec.rules import Grammar
from grammar.synthesize import SceneSynthesizer
from scene_description import ModelReference, SceneDescription, SceneObject, Support

MOST = 50
"""Objects that one change can add."""

_CHECKED = 40
"""Places of one object that are checked exactly before it is given up."""


def rules_of_category(rules: SceneSynthesizer, scene: SceneDescription, category: str) -> tuple[ObjectRule, ...]:
    """Return the rules of a category in the scene's grammar, else in the first other one that has it."""
    for grammar in (grammar_of(rules, scene), *rules.grammars.values(), *rules.learned.values()):
        found = tuple(rule for rule in grammar.objects.values() if rule.category == category)
        if found:
            return found
    return ()


def addable(rules: SceneSynthesizer) -> list[str]:
    """Return the categories that an object can be added of."""
    grammars: Iterable[Grammar] = (*rules.grammars.values(), *rules.learned.values())
    return sorted({rule.category for grammar in grammars for rule in grammar.objects.values()} & set(rules.appearance.categories))


def next_id(scene: SceneDescription) -> int:
    """Return an id that no object of the scene has or had."""
    gone = (key for record in scene.counterfactuals or () for key in record.removed)
    return max((*(thing.id for thing in all_things(scene)), *gone), default=0) + 1


def added(rng: np.random.Generator, work: Work, scene: SceneDescription, rule: ObjectRule) -> SceneDescription:
    """Return the scene with one more object of a rule, the last of its objects.

    Raises:
        InvalidChangeError: no valid place was found; it says what the last one that was tried failed at.
    """
    rules = work.rules()
    categories, grammar = categories_of(rules, scene), grammar_of(rules, scene)
    label = categories[rule.category].label_id if rule.category in categories else 0
    item = SceneObject(
        id=next_id(scene),
        category=rule.category,
        label=label,
        size_m=draw_size(rng, rule),
        position_m=(0.0, 0.0, 0.0),
        yaw_rad=0.0,
        support=Support(kind="floor" if rule.mount == "object" else rule.mount),
        model=ModelReference(generator=rule.category),
        parts=(),
    )
    scene, item = dressed(rng, rules, scene, item)
    cores = addressed(scene, rule.cores)
    supporters = addressed(scene, rule.supporters)
    last = InvalidChangeError(f"{work.change}: expected a place that is free for a {rule.category}, got none", ())
    found = free_places(rng, scene, categories, rule, cores, supporters, item, grammar.validity.penetration_m)
    for _, placed in zip(range(_CHECKED), found, strict=False):
        changed = lit(rng, rules, replace(scene, objects=(*scene.objects, placed)), placed)
        try:
            return checked(rules, scene, changed, work.change)
        except InvalidChangeError as error:
            last = error
    raise last


def addressed(scene: SceneDescription, weights: Mapping[str, float] | None) -> list[SceneObject]:
    """Return the objects that an address can point to."""
    symbols = {node.object: node.symbol for node in scene.parse_graph.nodes if node.kind == "terminal"}
    wanted = {symbol for symbol, weight in (weights or {}).items() if weight > 0.0}
    return [item for item in scene.objects if symbols.get(item.id, item.category) in wanted or item.category in wanted]


def add(work: Work) -> Outcome:
    """Put so many objects of the target's category into the room, one after the other."""
    rules, change = work.rules(), work.change
    category = str(change.target.get("category", ""))
    known = addable(rules)
    if category not in known:
        raise ChangeError(f"{change.factor}: target: expected a category to add ({', '.join(known)}), got '{category}'")
    count, scene, new = whole(change, 0, MOST), work.scene, []
    for k in range(count):
        rng = random_numbers(work.scene, change, k)
        choices = rules_of_category(rules, scene, category)
        try:
            scene = added(rng, work, scene, choices[int(rng.integers(len(choices)))])
        except InvalidChangeError as error:
            raise InvalidChangeError(
                f"{change}: value {count}: expected a valid place for each {category}, got room for {k} ({_reason(error)}); "
                "add fewer or take another seed",
                error.checks,
            ) from None
        new.append(scene.objects[-1].id)
    return Outcome(scene, objects=tuple(new))


def _reason(error: InvalidChangeError) -> str:
    """Return the names of the checks that the last place failed."""
    return f"the last place failed {', '.join(check.name for check in error.checks)}" if error.checks else "nothing else is free"


FACTORS = (
    Factor(
        name="object_added",
        label="objects added",
        unit=None,
        value="how many objects of the target's category are put into the room, 0 to 50",
        attribute="objects",
        touches="geometry",
        targets=("category",),
        make=add,
        current=lambda work: 0,
    ),
)
