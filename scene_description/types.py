"""The frozen types of a scene description, ``scene_synth/1``: one furnished room and everything that is known of it.

World frame: metres, right-handed, z up, floor at z = 0.  An object's own frame: origin at the centre of its box's bottom face, front
along +x, so ``size_m`` is (depth, width, height).  Colours are linear (scene-referred) RGB with Rec. 709 primaries; light is photometric:
radiance is given as RGB luminance in cd/m2, flux in lumen.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from scene_description.motion import Motion
from scene_description.strict import Limits

MAX_OBJECTS = 1000
MAX_POSES = 100_000

Name = Annotated[str, Limits(min_length=1, max_length=120, pattern=r"[A-Za-z0-9_.:\- ]+")]
Text = Annotated[str, Limits(max_length=500)]
ObjectId = Annotated[int, Limits(ge=1, le=65535)]
Seed = Annotated[int, Limits(ge=0, le=2**63 - 1)]
Coordinate = Annotated[float, Limits(ge=-1000.0, le=1000.0, unit="m")]
Length = Annotated[float, Limits(ge=0.0005, le=100.0, unit="m")]
Angle = Annotated[float, Limits(ge=-100.0, le=100.0, unit="rad")]
Unit = Annotated[float, Limits(ge=0.0, le=1.0)]
Luminance = Annotated[float, Limits(ge=0.0, le=1e6, unit="cd/m2")]
Point2 = tuple[Coordinate, Coordinate]
Point3 = tuple[Coordinate, Coordinate, Coordinate]
Color = tuple[Unit, Unit, Unit]
OpeningKind = Literal["door", "garage_door", "window"]
Axis = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
FilePath = Annotated[str, Limits(min_length=1, max_length=240)]
QuaternionItem = Annotated[float, Limits(ge=-1.0001, le=1.0001)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Texture:
    """A repeating pattern over a material, drawn by a generator of the renderer from ``seed``.

    ``scale_m`` is the size of the pattern's unit (a plank's width, a tile's side, the repeat of a print); ``colors`` go beside the
    material's base colour, in the order that the generator says; ``contrast`` is how far the pattern departs from the plain colours,
    ``relief_m`` its depth, ``rotation_rad`` its turn against the surface's own texture coordinates.
    """

    generator: Name
    scale_m: Length
    seed: Seed = 0
    colors: Annotated[tuple[Color, ...], Limits(max_length=4)] = ()
    contrast: Unit = 0.5
    relief_m: Annotated[float, Limits(ge=0.0, le=0.1, unit="m")] = 0.0
    rotation_rad: Angle = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class FileImages:
    """The images of one material of a model file: ``file`` as in ``ModelReference``, ``material`` its index there.

    Base colour, roughness and metalness of the images are multiplied with those of the material that has them.
    """

    file: FilePath
    material: Annotated[int, Limits(ge=0, le=100_000)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Material:
    """A metallic-roughness ("principled") material.

    Linear base colour, perceptual roughness (its square is the microfacet distribution's alpha), metalness, share of the light that enters
    that is let through (glass; of a thin sheet the share that is holes, as in nets), share of the light that a thin sheet scatters which
    leaves on its other side (cloth, leaves), index of refraction, weight and roughness of a clear coat of index 1.5, weight of a sheen
    (fabrics seen at grazing angles), and a pattern: drawn by a generator, or the images of a model file, not both.  ``glow_cd_m2``:
    luminance that white of its colour or pattern sends out on its front, as screens and figures of clocks do; the surface itself is nearly
    black then.  ``wear``: how much of the scene's wear it shows.
    """

    id: Name
    family: Name
    base_color: Color
    roughness: Unit = 0.8
    metallic: Unit = 0.0
    transmission: Unit = 0.0
    diffuse_transmission: Annotated[float, Limits(ge=0.0, le=0.95)] = 0.0
    ior: Annotated[float, Limits(ge=1.0, le=3.0)] = 1.5
    clearcoat: Unit = 0.0
    clearcoat_roughness: Unit = 0.05
    sheen: Unit = 0.0
    glow_cd_m2: Luminance = 0.0
    wear: Unit = 0.0
    texture: Texture | None = None
    images: FileImages | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class WearLayer:
    """Traces of use of one kind: a ``pattern`` of ``size_m`` per repeat, at heights from ``low_m`` to ``high_m``, and fading beyond.

    It lies on ``faces`` that look sideways, up, or anywhere, and on what is at most as rough as ``roughest``.  Where the pattern covers
    all, ``strength`` of the surface has the layer's colour, and its roughness grows by ``roughness``; a material's ``wear`` scales both.
    """

    pattern: Literal["cloud", "streaks", "smudges", "stains"]
    size_m: Annotated[float, Limits(ge=0.05, le=20.0, unit="m")]
    low_m: Annotated[float, Limits(ge=-10.0, le=100.0, unit="m")]
    high_m: Annotated[float, Limits(ge=-10.0, le=100.0, unit="m")]
    fade_m: Annotated[float, Limits(ge=0.001, le=10.0, unit="m")]
    faces: Literal["any", "side", "up"]
    roughest: Unit = 1.0
    color: Color
    strength: Unit
    roughness: Unit = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """A named part of an object and the id of its material."""

    name: Name
    material: Name


@dataclass(frozen=True, slots=True, kw_only=True)
class FileReading:
    """How a model file becomes parts in its object's frame; the parts together are stretched to the object's box.

    ``front`` and ``up`` are axes of the file; None stands for +z and +y in glTF files, +x and +z in others.  Parts are the file's nodes or
    materials, or all in one; ``rename`` maps names of the file (a ``*`` at the end stands for any rest) to names of parts, and what gets
    one name becomes one part.  ``own_materials``: triangles of one name but several materials of the file stay several parts.
    """

    front: Axis | None = None
    up: Axis | None = None
    split: Literal["nodes", "materials", "none"] = "nodes"
    rename: Annotated[Mapping[str, Name], Limits(max_length=256)] = field(default_factory=dict)
    own_materials: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelReference:
    """Where an object's geometry comes from: a generator of the renderer with style and seed, or a file of the user's catalogue.

    ``file`` is a relative POSIX path inside the catalogue's folder; absolute paths and ``..`` are refused.  ``ajar`` is how far a
    generator's movable parts are from shut or straight: the share of the object's depth that an open drawer or door takes, in front of the
    body; of curtains and pictures, which stay within their box, the share of the most.
    """

    generator: Name | None = None
    file: FilePath | None = None
    reading: FileReading | None = None
    style: Name = "default"
    seed: Seed = 0
    ajar: Annotated[float, Limits(ge=0.0, le=1.0)] = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Support:
    """What an object rests on or hangs from; ``id`` is the supporting object, ``wall`` the index of the polygon edge."""

    kind: Literal["floor", "wall", "ceiling", "object"]
    id: ObjectId | None = None
    wall: Annotated[int, Limits(ge=0, le=255)] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneObject:
    """One piece of furniture or clutter.

    ``position_m`` is the centre of the bottom face of its box in the world, ``size_m`` (depth along its own x, width along y, height).
    ``group`` is the id of the core object of its functional group (its address terminal), if any.
    """

    id: ObjectId
    category: Name
    label: Annotated[int, Limits(ge=0, le=40)]
    size_m: tuple[Length, Length, Length]
    position_m: Point3
    yaw_rad: Angle
    support: Support
    group: ObjectId | None = None
    model: ModelReference
    parts: Annotated[tuple[Part, ...], Limits(max_length=64)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Opening:
    """A door, an overhead door for vehicles or a window in a wall.

    ``wall`` is the index i of the polygon edge from vertex i to i + 1; ``offset_m`` runs along it to the opening's near end; ``sill_m`` is
    the height of its lower edge.  A door's hinge is at the near ("start") or far ("end") end; it opens into the room ("in") or out of it;
    neither says anything of windows and overhead doors.
    """

    id: ObjectId
    category: OpeningKind
    label: Annotated[int, Limits(ge=0, le=40)]
    wall: Annotated[int, Limits(ge=0, le=255)]
    offset_m: Annotated[float, Limits(ge=0.0, le=1000.0, unit="m")]
    sill_m: Annotated[float, Limits(ge=0.0, le=100.0, unit="m")]
    width_m: Length
    height_m: Length
    hinge: Literal["start", "end"] = "start"
    swing: Literal["in", "out"] = "in"
    model: ModelReference
    parts: Annotated[tuple[Part, ...], Limits(max_length=64)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Slope:
    """A plane of a sloped ceiling, as under a roof: it rises from the line of a wall into the room, all of which lies before that wall.

    ``wall`` is the index of the polygon edge, ``eaves_height_m`` the height of the ceiling at its inner face (that of a knee wall),
    ``pitch_rad`` the angle between the plane and the floor.
    """

    wall: Annotated[int, Limits(ge=0, le=255)]
    eaves_height_m: Annotated[float, Limits(ge=0.2, le=20.0, unit="m")]
    pitch_rad: Annotated[float, Limits(ge=0.02, le=1.5, unit="rad")]


SKIRTING_HEIGHT_M, SKIRTING_DEPTH_M = 0.07, 0.012
"""How high skirting boards are, and how far they stand out from walls."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Room:
    """The room's shell.  ``polygon_m`` is the inner floor outline, counter-clockwise; wall i runs from vertex i to vertex i + 1.

    The ceiling lies at ``height_m``, or lower where one of the ``slopes`` does; None stands for a flat one.
    """

    polygon_m: Annotated[tuple[Point2, ...], Limits(min_length=3, max_length=256)]
    height_m: Annotated[float, Limits(ge=1.5, le=20.0, unit="m")]
    wall_thickness_m: Annotated[float, Limits(ge=0.02, le=1.0, unit="m")]
    openings: Annotated[tuple[Opening, ...], Limits(max_length=64)]
    surfaces: Annotated[tuple[Part, ...], Limits(min_length=1, max_length=8)]
    """Materials of the parts ``floor``, ``wall``, ``ceiling``, and of ``skirting`` where there are such boards."""
    slopes: Annotated[tuple[Slope, ...], Limits(min_length=1, max_length=8)] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Light:
    """A lamp: the surface of one part of one object emits ``flux_lm``, evenly over its area and diffusely, in the linear colour given."""

    object: ObjectId
    part: Name
    flux_lm: Annotated[float, Limits(ge=0.0, le=1e6, unit="lm")]
    color_temperature_k: Annotated[float, Limits(ge=1000.0, le=20000.0, unit="K")]
    color: Color
    on: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class Luminaire:
    """A light that no object holds: a small ball of ``radius_m`` at ``position_m``.

    A ``point`` shines evenly all around; a ``spot`` along ``direction`` (a unit vector), in full up to ``beam_rad`` from it, then less and
    less up to ``field_rad``.  ``intensities``, if there are any, replace both: relative luminous intensity at even angles from the
    direction to its opposite, as in photometric files.
    """

    kind: Literal["point", "spot"]
    position_m: Point3
    direction: tuple[QuaternionItem, QuaternionItem, QuaternionItem] = (0.0, 0.0, -1.0)
    flux_lm: Annotated[float, Limits(ge=0.0, le=1e6, unit="lm")]
    color_temperature_k: Annotated[float, Limits(ge=1000.0, le=20000.0, unit="K")]
    color: Color
    on: bool = True
    beam_rad: Annotated[float, Limits(ge=0.0, le=3.1415927, unit="rad")] = 0.3
    field_rad: Annotated[float, Limits(ge=0.01, le=3.1415927, unit="rad")] = 0.6
    radius_m: Annotated[float, Limits(ge=0.002, le=0.5, unit="m")] = 0.03
    intensities: Annotated[tuple[Annotated[float, Limits(ge=0.0, le=1e9)], ...], Limits(max_length=361)] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Daylight:
    """Sun and sky at a moment: what a renderer needs to know of the day outside.

    ``sun_direction`` is the unit vector to the sun in the world, ``turbidity`` the haze of the air (2 very clear, 6 hazy), ``cloud_cover``
    the share of an overcast sky in the mixture, ``ground_color`` the linear base colour of the ground.  The moment that the sun's place
    follows from is told beside it: day of the year, true solar time in hours, latitude, and the yaw at which north lies.  ``sun_scale`` and
    ``sky_scale`` multiply the light of the sun and of the sky; None stands for 1.
    """

    sun_direction: tuple[QuaternionItem, QuaternionItem, QuaternionItem]
    turbidity: Annotated[float, Limits(ge=1.7, le=10.0)] = 3.0
    cloud_cover: Unit = 0.0
    ground_color: Color = (0.2, 0.2, 0.17)
    sun_distance_au: Annotated[float, Limits(ge=0.98, le=1.02)] = 1.0
    day_of_year: Annotated[int, Limits(ge=1, le=366)] = 172
    solar_hour: Annotated[float, Limits(ge=0.0, le=24.0, unit="h")] = 12.0
    latitude_rad: Annotated[float, Limits(ge=-1.5708, le=1.5708, unit="rad")] = 0.0
    north_yaw_rad: Angle = 1.5707963267948966
    sun_scale: Annotated[float, Limits(ge=0.0, le=1000.0)] | None = None
    sky_scale: Annotated[float, Limits(ge=0.0, le=1000.0)] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class EnvironmentMap:
    """An equirectangular picture of what is outside: ``file`` as in ``ModelReference``, Radiance ``.hdr`` or ``.exr``.

    The middle column looks along world +x, turned about z by ``yaw_rad``; ``luminance_scale`` is the luminance in cd/m2 of a pixel of value
    1 (179, where the picture is in watts, as Radiance has it).
    """

    file: FilePath
    yaw_rad: Angle = 0.0
    luminance_scale: Annotated[float, Limits(ge=1e-6, le=1e9, unit="cd/m2")] = 179.0


Setting = Literal["suburb", "town", "country"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Surroundings:
    """What stands outside the windows, under the sky of the environment: houses, trees and a street, drawn by ``seed``.

    ``floor_above_ground_m`` is the height of the room's floor; the street runs along world +x, turned about z by ``quarter_turns``, and
    lies to its left.  All of it is drawn as seen from the middle of the room, as if it were far: it shows no parallax.
    """

    setting: Setting
    seed: Annotated[int, Limits(ge=0, le=2**53)]
    floor_above_ground_m: Annotated[float, Limits(ge=0.0, le=100.0, unit="m")] = 0.3
    quarter_turns: Annotated[int, Limits(ge=0, le=3)] = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Environment:
    """Daylight outside the windows.  A ``map`` replaces everything else here.

    Luminance (RGB, cd/m2) of the sky at the zenith, at the horizon, and of the ground below it; or, where ``daylight`` is given, the sun
    and sky of a moment, in place of these three.
    """

    zenith: tuple[Luminance, Luminance, Luminance]
    horizon: tuple[Luminance, Luminance, Luminance]
    ground: tuple[Luminance, Luminance, Luminance]
    daylight: Daylight | None = None
    map: EnvironmentMap | None = None
    surroundings: Surroundings | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraPose:
    """One pose of the camera's optical frame (x right, y down, z forward) in the world, and its simulated time in nanoseconds."""

    stamp_ns: Annotated[int, Limits(ge=0, le=2**62, unit="ns")]
    position_m: Point3
    orientation: tuple[QuaternionItem, QuaternionItem, QuaternionItem, QuaternionItem]
    """Unit quaternion (x, y, z, w)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ParseNode:
    """One node of the parse graph: which rule was chosen, with which probability.

    ``kind`` is the node's kind in the And-Or graph; ``choice`` the branch taken, the multiplicity of a Set branch, the target of an address
    or the attribute's value; ``parent`` the index of the parent node, ``object`` the terminal's object.  ``log_probability`` is the natural
    logarithm of the branch's probability, or of a density for continuous attributes.
    """

    symbol: Name
    kind: Literal["and", "or", "set", "address", "terminal", "attribute"]
    parent: Annotated[int, Limits(ge=0, le=100_000)] | None = None
    choice: Text = ""
    log_probability: Annotated[float, Limits(ge=-1e9, le=1e9)] = 0.0
    object: ObjectId | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ParseGraph:
    """The derivation of the room: nodes in depth-first order, their summed log-probability, every layout energy term by name.

    ``energies`` are the unweighted clique losses, ``weights`` their lambda; ``energy`` is the weighted sum, E(E_pt) of the Gibbs prior.
    """

    nodes: Annotated[tuple[ParseNode, ...], Limits(max_length=20_000)]
    log_probability: Annotated[float, Limits(ge=-1e9, le=1e9)]
    energies: Annotated[Mapping[str, float], Limits(max_length=64)]
    weights: Annotated[Mapping[str, float], Limits(max_length=64)]
    energy: Annotated[float, Limits(ge=-1e12, le=1e12)]


@dataclass(frozen=True, slots=True, kw_only=True)
class ValidityCheck:
    """One check: the measured value, the limit that it is held to, whether it passed, and the objects at fault."""

    name: Name
    value: Annotated[float, Limits(ge=-1e12, le=1e12)]
    limit: Annotated[float, Limits(ge=-1e12, le=1e12)]
    passed: bool
    objects: Annotated[tuple[ObjectId, ...], Limits(max_length=MAX_OBJECTS)] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class ValidityReport:
    """The exact checks of the finished room; ``attempts`` counts the layouts that were sampled until it passed."""

    valid: bool
    attempts: Annotated[int, Limits(ge=1, le=1_000_000)]
    checks: Annotated[tuple[ValidityCheck, ...], Limits(max_length=64)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Counterfactual:
    """One change of one attribute that this scene differs by from the room that was sampled.

    ``factor`` is a row of the table of factors, ``target`` what was changed, ``value`` the new value as JSON.  ``objects`` are the objects,
    openings included, that were changed or added, and those ``removed`` are listed apart; ``note`` tells what the change took along.
    """

    factor: Name
    target: Annotated[Mapping[str, Text], Limits(max_length=8)]
    value: Text
    seed: Seed = 0
    objects: Annotated[tuple[ObjectId, ...], Limits(max_length=MAX_OBJECTS)] = ()
    removed: Annotated[tuple[ObjectId, ...], Limits(max_length=MAX_OBJECTS)] = ()
    note: Text = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneDescription:
    """A furnished room: everything that renderers, recorders and people need to know of it."""

    schema: Literal["scene_synth/1"]
    id: Name
    index: Annotated[int, Limits(ge=0, le=2**62)]
    seed: Seed
    category: Name
    room: Room
    objects: Annotated[tuple[SceneObject, ...], Limits(max_length=MAX_OBJECTS)]
    materials: Annotated[tuple[Material, ...], Limits(min_length=1, max_length=4096)]
    lights: Annotated[tuple[Light, ...], Limits(max_length=256)]
    environment: Environment
    camera_path: Annotated[tuple[CameraPose, ...], Limits(min_length=1, max_length=MAX_POSES)]
    parse_graph: ParseGraph
    validity: ValidityReport
    luminaires: Annotated[tuple[Luminaire, ...], Limits(max_length=256)] = ()
    wear: Annotated[tuple[WearLayer, ...], Limits(max_length=16)] = ()
    counterfactuals: Annotated[tuple[Counterfactual, ...], Limits(max_length=64)] | None = None
    """Changes made to the room after it was sampled, in their order; None for a room as it was sampled.

    Empty for a room that is compared with changed ones: like these it is rendered so that what is seen of an object does not depend, to the
    last bit, on objects that are not seen.
    """
    motion: Motion | None = None
    """Where the body that carries the camera is at all times; None where only the poses of the frames are known."""
