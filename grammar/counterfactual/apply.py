"""One change applied to one scene, and the record of it."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

from grammar.counterfactual.change import Change, ChangeError
from grammar.counterfactual.factor import Factor, Work
from grammar.counterfactual.factors import FACTORS
from grammar.counterfactual.targets import check_keys
from grammar.synthesize import SceneSynthesizer
from scene_description import Counterfactual, FieldError, SceneDescription
from scene_description.scene_json import check_scene

_LONGEST_TEXT = 500


def apply_change(scene: SceneDescription, change: Change, rules: SceneSynthesizer | None = None) -> SceneDescription:
    """Return the scene with one attribute changed and everything else as it is.

    Ids, model seeds and the parse graph of what stays are those of the scene; the change is appended to ``counterfactuals``.  The same
    scene and change give the same bytes.

    Args:
        scene: stays as it is.
        change: what is changed.
        rules: grammars, categories, materials and camera settings that the scene was sampled with; None: those of ``config/``.

    Raises:
        ChangeError: the factor, the target or the value is unknown or does not fit.
        InvalidChangeError: the changed room would not be valid; it says which check fails and where.
    """
    factor, work = _prepared(scene, change, rules)
    outcome = factor.make(work)
    record = Counterfactual(
        factor=change.factor,
        target={key: str(value) for key, value in change.target.items()},
        value=json.dumps(change.value, separators=(",", ":"))[:_LONGEST_TEXT],
        seed=change.seed,
        objects=outcome.objects,
        removed=outcome.removed,
        note=outcome.note[:_LONGEST_TEXT],
    )
    changed = replace(outcome.scene, counterfactuals=(*(scene.counterfactuals or ()), record))
    try:
        check_scene(changed)
    except FieldError as error:
        raise ChangeError(f"{change}: value {json.dumps(change.value)}: the scene would not be one any more: {error}") from None
    return changed


def as_base(scene: SceneDescription) -> SceneDescription:
    """Return a scene marked as one that others are compared with: ``counterfactuals`` is there, if empty.

    Where surfaces touch, which of them a ray meets depends on what else is in the scene; frames of scenes with this mark, and of changed
    ones, do not.
    """
    return scene if scene.counterfactuals is not None else replace(scene, counterfactuals=())


def current_value(scene: SceneDescription, change: Change, rules: SceneSynthesizer | None = None) -> object:
    """Return the value that leaves a scene as it is, or None where the targets have no one value; the change's own does not matter.

    Raises:
        ChangeError: the factor or the target is unknown.
    """
    factor, work = _prepared(scene, change, rules)
    return factor.current(work)


def _prepared(scene: SceneDescription, change: Change, rules: SceneSynthesizer | None) -> tuple[Factor, Work]:
    if change.factor not in FACTORS:
        raise ChangeError(f"factor: expected one of {', '.join(FACTORS)}, got '{change.factor}'")
    factor = FACTORS[change.factor]
    check_keys(change, factor.targets)
    read: Callable[[], SceneSynthesizer] = (lambda: rules) if rules is not None else _default_rules
    return factor, Work(scene, change, read)


@lru_cache(maxsize=1)
def _default_rules() -> SceneSynthesizer:
    """Return the rules of ``config/``."""
    return SceneSynthesizer.from_config()
