"""The semantic classes of a flat scene in another standard than NYU40: other numbers in one small table, nothing else."""

import numpy as np

from renderer.scene.flat_scene import FlatScene
from scene_description import Opening, SceneDescription, SceneObject
from scene_description.label_standards import StandardName, label_standard


def with_classes(flat: FlatScene, scene: SceneDescription, standard: StandardName) -> FlatScene:
    """Return a flat scene whose parts have the class ids of a standard.

    ``flat``: with NYU40 class ids, as ``flatten`` makes it; ``scene``: the description, which has the objects' categories; ``standard``:
    whose ids; ``nyu40`` leaves the scene as it is.
    """
    if standard == "nyu40":
        return flat
    target = label_standard(standard)
    things: list[Opening | SceneObject] = [*scene.room.openings, *scene.objects]
    categories = {thing.id: thing.category for thing in things}
    owners = zip(flat.parts.object_id.tolist(), flat.parts.label.tolist(), strict=True)
    classes = [target.class_of(categories.get(owner, ""), label) for owner, label in owners]
    return flat._replace(parts=flat.parts._replace(label=np.array(classes, np.uint8)))
