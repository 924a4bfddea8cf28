"""A change of one attribute of a scene, and why one can be refused."""

import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from grammar.synthesize import SceneSynthesizer
from scene_description import SceneDescription, SceneSynthError, ValidityCheck

Target = Mapping[str, object]
"""What a change is of: keys of ``grammar.counterfactual.targets``; empty for everything that the factor can change."""

Attribute = Literal["illumination", "material", "objects", "camera"]
"""The four attributes of Jiang, Qi, Zhu et al. (IJCV 2018) that a scene is controlled by."""

Touches = Literal["light", "surface", "geometry", "view"]
"""What a factor may alter in frames.

light: the layers of light, those of lit lamps and of what the sensors read of light; surface: also what surfaces are made of; geometry:
everything, where something that changed is seen; view: everything.
"""


class ChangeError(SceneSynthError):
    """A change that cannot be made: an unknown factor or target, or a value that does not fit; one line that says what there is."""

    def __init__(self, text: str) -> None:
        super().__init__(" ".join(text.split()))


class InvalidChangeError(ChangeError):
    """A change that would make the room invalid; ``checks`` are those that it fails, with the objects at fault."""

    def __init__(self, text: str, checks: Sequence[ValidityCheck]) -> None:
        self.checks = tuple(checks)
        super().__init__(text)


@dataclass(frozen=True, slots=True)
class Change:
    """One attribute and its new value.

    ``factor`` is a name in ``FACTORS``, ``target`` what it is changed of, ``value`` what the factor's row says.  ``seed`` chooses among the
    ways in which a change can be made that leaves something open: where an object goes, which of several, which model.
    """

    factor: str
    target: Target = field(default_factory=dict)
    value: object = None
    seed: int = 0

    def __str__(self) -> str:
        """Return the change in a few words, for messages."""
        of = ", ".join(f"{key} {value}" for key, value in self.target.items())
        return f"{self.factor}{f' of {of}' if of else ''}"


def random_numbers(scene: SceneDescription, change: Change, *key: int) -> np.random.Generator:
    """Return the source of randomness of a change: of the scene, the factor, the target and the seed, but not of the value.

    So values of one factor draw the same numbers: what is changed at one value is changed at the next one alike.
    """
    text = repr((change.factor, sorted((key, str(value)) for key, value in change.target.items())))
    return np.random.default_rng([scene.seed, scene.index, change.seed, zlib.crc32(text.encode()), *key])


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
    the scene as it is.  It is None where a scene has no one value.  ``by_day``: the scene must have a sun.
    """

    name: str
    label: str
    unit: str | None
    value: str
    attribute: Attribute
    touches: Touches
    targets: tuple[str, ...] = ()
    by_day: bool = False
    make: Callable[[Work], Outcome] = field(repr=False)
    current: Callable[[Work], object] = field(default=lambda work: None, repr=False)
