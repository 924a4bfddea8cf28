"""The nouns that the grammar and the renderer share: a furnished room, its JSON form, labels and poses.

Imports numpy only, but for ``yaml_text``, which reads YAML for all packages.
Metres, radians, right-handed, z up, floor at z = 0 (REP 103); yaw 0 means that an object's front looks along +x.
"""

from scene_description.errors import SceneSynthError, error_line, read_at_most
from scene_description.labels import NYU40, Label
from scene_description.scene_json import SCHEMA, read_scene, scene_from_json, scene_to_json
from scene_description.strict import FieldError, Limits, from_mapping, to_mapping
from scene_description.types import (
    CameraPose,
    Counterfactual,
    Daylight,
    Environment,
    EnvironmentMap,
    FileImages,
    FileReading,
    Light,
    Luminaire,
    Material,
    ModelReference,
    Opening,
    ParseGraph,
    ParseNode,
    Part,
    Room,
    SceneDescription,
    SceneObject,
    Slope,
    Support,
    Surroundings,
    Texture,
    ValidityCheck,
    ValidityReport,
    WearLayer,
)

__all__ = [
    "NYU40",
    "SCHEMA",
    "CameraPose",
    "Counterfactual",
    "Daylight",
    "Environment",
    "EnvironmentMap",
    "FieldError",
    "FileImages",
    "FileReading",
    "Label",
    "Light",
    "Limits",
    "Luminaire",
    "Material",
    "ModelReference",
    "Opening",
    "ParseGraph",
    "ParseNode",
    "Part",
    "Room",
    "SceneDescription",
    "SceneObject",
    "SceneSynthError",
    "Slope",
    "Support",
    "Surroundings",
    "Texture",
    "ValidityCheck",
    "ValidityReport",
    "WearLayer",
    "error_line",
    "from_mapping",
    "read_at_most",
    "read_scene",
    "scene_from_json",
    "scene_to_json",
    "to_mapping",
]
