"""The table of factors: every attribute of a scene that can be changed alone, by name."""

import json
import math
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

from grammar.counterfactual import addition, cameras, clutter, light, placement, rearrangement, room_size, surfaces
from grammar.counterfactual.change import Attribute, Change, ChangeError, Factor, Outcome, Touches, Work
from grammar.counterfactual.targets import OBJECTS, check_keys, chosen_objects
from grammar.synthesize import SceneSynthesizer
from scene_description import Counterfactual, FieldError, SceneDescription
from scene_description.rounding import rounded
from scene_description.scene_json import check_scene

_LAMPS = (*OBJECTS, "luminaire")
_PARTS = (*OBJECTS, "part", "surface")

_Row = tuple[str, str, str | None, str, Callable[[Work], Outcome], Callable[[Work], object]]
"""Name, label, unit, meaning of the value, what makes the change, and what returns the value that leaves a scene as it is."""


def _factors(attribute: Attribute, touches: Touches, targets: tuple[str, ...], *rows: _Row, by_day: bool = False) -> dict[str, Factor]:
    """Return the rows that share an attribute, what they touch, what they are of, and whether they need a sun."""
    return {
        name: Factor(
            name=name,
            label=label,
            unit=unit,
            value=value,
            attribute=attribute,
            touches=touches,
            targets=targets,
            by_day=by_day,
            make=make,
            current=current,
        )
        for name, label, unit, value, make, current in rows
    }


def _always(value: object) -> Callable[[Work], object]:
    return lambda work: value


_NONE, _ONE, _ZERO = _always(None), _always(1.0), _always(0.0)

# fmt: off
FACTORS: dict[str, Factor] = {
    **_factors(
        "illumination", "light", _LAMPS,
        ("light_intensity", "lamp intensity", None, "factor on the luminous flux of the lamps, 0 or more; 1: as it is",
         light.scale_intensity, lambda work: 1.0 if light.targeted_lamps(work) else None),
        ("color_temperature_k", "colour temperature of lamps", "K",
         "correlated colour temperature of the lamps, 1667 to 20000 K, at the same flux",
         light.set_temperature, light.shared_by_lamps(lambda lamp: lamp.color_temperature_k)),
        ("lamp_on", "lamps on", None, "true: the lamps are on; false: they are off",
         light.switch, light.shared_by_lamps(lambda lamp: lamp.on)),
    ),
    **_factors(
        "illumination", "light", (),
        ("sun_elevation_deg", "elevation of the sun", "deg", "height of the sun above the horizon, 0 to 90 degrees",
         light.set_elevation, lambda work: math.degrees(light.sun_of(light.daylight_of(work)).elevation_rad)),
        ("sun_azimuth_deg", "azimuth of the sun", "deg", "where the sun stands, from north by way of east, -360 to 360 degrees",
         light.set_azimuth, lambda work: math.degrees(light.sun_of(light.daylight_of(work)).azimuth_rad)),
        ("solar_hour", "true solar time", "h",
         "hour of the day, 12 when the sun is due south or north; the sun moves along its way over that day's sky",
         light.set_hour, lambda work: light.daylight_of(work).solar_hour),
        ("sun_intensity", "intensity of the sun", None, "factor on the light of the sun, 0 to 100; 0: no sun, 1: as it is",
         light.scale_sun, lambda work: 1.0 if light.daylight_of(work) else None),
        by_day=True,
    ),
    **_factors(
        "illumination", "light", (),
        ("sky_intensity", "intensity of the sky", None, "factor on the light of the sky, 0 to 100; 0: a black sky, 1: as it is",
         light.scale_sky, _ONE),
    ),
    **_factors(
        "illumination", "light", (),
        ("turbidity", "turbidity of the air", None, "haze, 1.7 (very clear) to 10",
         light.set_daylight("turbidity", 1.7, 10.0), lambda work: light.daylight_of(work).turbidity),
        ("cloud_cover", "cloud cover", None, "0 (clear) to 1 (overcast, no sun)",
         light.set_daylight("cloud_cover", 0.0, 1.0), lambda work: light.daylight_of(work).cloud_cover),
        by_day=True,
    ),
    **_factors(
        "material", "surface", _PARTS,
        ("material", "material", None, "name of a material of config/materials.yaml, of which one is drawn for all targeted parts",
         surfaces.set_material, _NONE),
        ("base_color", "base colour", None, "linear [r, g, b], 0 to 1, or sRGB '#rrggbb'",
         surfaces.set_color, surfaces.shared_by_materials(lambda material: material.base_color)),
        ("roughness", "roughness", None, "perceptual roughness, 0 (smooth) to 1",
         surfaces.set_number("roughness"), surfaces.shared_by_materials(lambda material: material.roughness)),
        ("metallic", "metalness", None, "0 (dielectric) to 1 (metal)",
         surfaces.set_number("metallic"), surfaces.shared_by_materials(lambda material: material.metallic)),
        ("texture", "texture", None, "name of a pattern that a material of config/materials.yaml has, or 'none'",
         surfaces.set_texture, _NONE),
        ("texture_scale", "scale of textures", None, "factor on the size of the pattern's unit, 0.01 to 100; 1: as it is",
         surfaces.scale_texture, lambda work: 1.0 if surfaces.patterned_parts(work) else None),
        ("texture_contrast", "contrast of textures", None, "how far a pattern departs from its plain colours, 0 to 1",
         surfaces.set_contrast,
         surfaces.shared_by_materials(lambda material: None if material.texture is None else material.texture.contrast)),
    ),
    **_factors(
        "material", "surface", (),
        *((f"{surface}_finish", f"finish of the {surface}", None, "name of a material of config/materials.yaml",
           surfaces.set_finish(surface), _NONE) for surface in ("wall", "floor", "ceiling")),
    ),
    **_factors(
        "objects", "geometry", (),
        ("clutter", "clutter", None,
         "factor on the number of small things that stand on furniture, lamps not counted, 0 to 10; 1: as it is",
         clutter.scale_clutter, _ONE),
    ),
    **_factors(
        "objects", "geometry", ("category",),
        ("object_added", "objects added", None, "how many objects of the target's category are put into the room, 0 to 50",
         addition.add, _always(0)),
        ("object_placed", "object put in place", None,
         "{at_m: [x, y, z], yaw_rad, style, seed}: one of the target's category is put there, on what carries it; seed is its model's",
         placement.place, _NONE),
    ),
    **_factors(
        "objects", "geometry", OBJECTS,
        ("object_removed", "objects removed", None,
         "true: the targeted objects are taken out, with what they carry; a number: so many of them; false or 0: none",
         rearrangement.remove, lambda work: 0 if chosen_objects(work.scene, work.change) else None),
        ("object_moved", "objects moved", None, "[dx in m, dy in m, turn in rad] in the world; what stands on the objects goes along",
         rearrangement.move, lambda work: [0.0, 0.0, 0.0]),
        ("object_replaced", "objects replaced", None,
         "a style of the objects' category, another category, or {category, style, seed}: seed alone is another specimen",
         rearrangement.exchange, _NONE),
    ),
    **_factors(
        "objects", "geometry", (),
        ("room_size", "size of the room", None, "factor on both sides of the floor, 0.3 to 3; 1: as it is", room_size.scale_room, _ONE),
    ),
    **_factors(
        "camera", "view", (),
        ("camera_height_m", "height of the camera", "m", "mean height of the lens above the floor; the path's own ups and downs stay",
         cameras.set_height, lambda work: float(cameras.lens_positions(work)[:, 2].mean())),
        ("camera_pitch_deg", "added pitch of the camera", "deg", "tilt added to every pose, positive upwards; 0: as it is",
         cameras.add_pitch, _ZERO),
        ("camera_roll_deg", "added roll of the camera", "deg",
         "turn about the optical axis added to every pose, positive clockwise as seen from behind; 0: as it is", cameras.add_roll, _ZERO),
        ("camera_speed", "speed of the camera", None,
         "factor on the speed along the same path, 0.05 to 20, frames at the same rate; 1: as it is", cameras.drive_faster, _ONE),
        ("camera_amplitude", "amplitude of the path", None,
         "factor on the path's extent about its middle pose, 0 (the camera only turns) to 10; 1: as it is", cameras.scale_path, _ONE),
        ("camera_offset_m", "sideways offset of the camera", "m",
         "distance by which every pose is moved to its own right; 0: as it is", cameras.shift_path, _ZERO),
        ("camera_path", "path", None, "seed of another walk through the same room, with the same frames at the same times",
         cameras.take_another_path, _NONE),
    ),
}
# fmt: on
"""Name -> factor, in the order of the four attributes: illumination, material, objects, camera."""

_LONGEST_TEXT = 500


def apply_change(scene: SceneDescription, change: Change, rules: SceneSynthesizer | None = None) -> SceneDescription:
    """Return the scene with one attribute changed and everything else as it is.

    Ids, model seeds and the parse graph of what stays are those of the scene; the change is appended to ``counterfactuals``.  The same
    scene and change give the same bytes.

    ``rules``: those that the scene was sampled with; None: those of ``config/``.

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
    if scene == rounded(scene):  # else what is not changed would be
        changed = rounded(changed)
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
