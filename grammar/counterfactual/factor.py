"""What a factor is: an attribute of scenes that can be changed alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

from grammar.counterfactual.change import Change
from grammar.synthesize import SceneSynthesizer
from scene_description import SceneDescription

Attribute = Literal["illumination", "material", "objects", "camera"]
"""The four attributes of Jiang, Qi, Zhu et al. (IJCV 2018) that a scene is controlled by."""

Touches = Literal["light", "surface", "geometry", "view"]
"""What a factor may alter in frames.

light: the layers of light, those of lit lamps and of what the sensors read of light; surface: also what surfaces are made of; geometry:
everything, where something that changed is seen; view: everything.
"""


class Outcome(NamedTuple):
    """A changed scene, and for its record: objects and openings changed or added, objects removed, and what else there is to say."""

    scene: SceneDescription
    objects: tuple[int, ...] = ()
    removed: tuple[int, ...] = ()
    note: str = ""


class Work(NamedTuple):
    """What a change is made with: the scene, the change, and where the rules of rooms come from, read when they are needed."""

    scene: SceneDescription
    change: Change
    rules: Callable[[], SceneSynthesizer]


@dataclass(frozen=True, slots=True, kw_only=True)
class Factor:
    """One row of the table of factors.

    ``label`` and ``unit`` are for axes of plots; ``value`` says what a value means; ``targets`` are the keys that a target may have, none
    where the factor is the whole scene's.  ``make`` applies a change, ``current`` returns the value that a scene has: applied, it leaves
    the scene as it is.  It is None where a scene has no one value.
    """

    name: str
    label: str
    unit: str | None
    value: str
    attribute: Attribute
    touches: Touches
    targets: tuple[str, ...] = ()
    make: Callable[[Work], Outcome] = field(repr=False)
    current: Callable[[Work], object] = field(default=lambda work: None, repr=False)
