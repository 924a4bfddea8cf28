"""What a user may ask of a room."""

from dataclasses import dataclass, replace
from typing import Annotated, Literal, get_args

from scene_description import Limits, SceneSynthError
from scene_description.types import Setting

GrammarSet = Literal["learned", "by_hand"]
GRAMMAR_SETS: tuple[GrammarSet, ...] = get_args(GrammarSet)


class RequestError(SceneSynthError):
    """A room that cannot be had: the line names the constraint that cannot be met and what to change."""


Texts = tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneRequest:
    """Constraints on a room beyond its grammar; what is left at its default is drawn by the grammar.

    Every field is a ROS parameter, so tables are lists of short texts; their forms are given in the descriptions and, with examples, in
    ``docs/grammar.md``.
    """

    room_type: Annotated[
        str,
        Limits(
            min_length=1,
            max_length=600,
            pattern=r"[a-z][a-z0-9_]{0,59}(,[a-z][a-z0-9_]{0,59})*",
            description="kind of room, the name of a grammar; the rooms of a run take several, with commas between, in turn",
        ),
    ] = "bedroom"
    grammar_set: Annotated[
        GrammarSet, Limits(description="learned: from real rooms, for the room types that have such a grammar; by_hand: none of these")
    ] = "learned"
    min_objects: Annotated[int, Limits(ge=0, le=500, description="least number of objects, doors and windows not counted")] = 0
    max_objects: Annotated[int, Limits(ge=1, le=500, description="greatest number of objects, doors and windows not counted")] = 150
    room_shape: Annotated[
        Literal["any", "rectangle", "l_shape", "t_shape", "u_shape", "chimney_breast", "alcove", "bay"],
        Limits(description="shape of the floor; any: drawn by the grammar"),
    ] = "any"
    room_width_m: Annotated[float, Limits(ge=0.0, le=30.0, unit="m", description="room size along x; 0: drawn by the grammar")] = 0.0
    room_depth_m: Annotated[float, Limits(ge=0.0, le=30.0, unit="m", description="room size along y; 0: drawn by the grammar")] = 0.0
    room_height_m: Annotated[float, Limits(ge=0.0, le=20.0, unit="m", description="height of the ceiling; 0: drawn by the grammar")] = 0.0
    room_ceiling: Annotated[
        Literal["any", "flat", "one_slope", "two_slopes"],
        Limits(description="flat, or sloped as under a roof, towards one wall or towards two opposite ones; any: drawn by the grammar"),
    ] = "any"
    room_eaves_m: Annotated[
        float, Limits(ge=0.0, le=2.0, unit="m", description="height of a sloped ceiling where it is lowest; 0: drawn by the grammar")
    ] = 0.0
    room_pitch_deg: Annotated[
        float, Limits(ge=0.0, le=70.0, unit="deg", description="pitch of a sloped ceiling; 0: drawn by the grammar")
    ] = 0.0
    room_polygon_m: Annotated[
        tuple[float, ...],
        Limits(max_length=128, unit="m", description="floor outline x0, y0, x1, y1, ...; empty: drawn by the grammar"),
    ] = ()
    must_have: Annotated[Texts, Limits(max_length=64, description="categories of which there is at least one object")] = ()
    must_not: Annotated[Texts, Limits(max_length=64, description="categories of which there is none")] = ()
    counts: Annotated[
        Texts,
        Limits(max_length=64, description="least and greatest number by category (window too), texts 'category:least:most'"),
    ] = ()
    sizes: Annotated[
        Texts,
        Limits(
            max_length=64,
            unit="m",
            description="sizes by category or object of the grammar, texts 'name:depth x width x height', each a number, a range "
            "'low..high' or '*', for example 'desk:0.6..0.7 x 1.4 x *'",
        ),
    ] = ()
    fixed: Annotated[
        Texts,
        Limits(
            max_length=200,
            unit="m, rad",
            description="objects that stay where they are put, texts 'name:x:y:yaw' with ':size=DxWxH' for another size than a drawn one, "
            "':on=K' on the K-th of the list, ':middle=Z' the height of what hangs; the room is drawn about x = y = 0",
        ),
    ] = ()
    clutter: Annotated[
        float,
        Limits(
            ge=0.0,
            le=10.0,
            description="small things and untidiness: 0 none, 1 as the counts say, 3 a mess; what is not moved by hand stays as it is",
        ),
    ] = 1.0
    looks: Annotated[
        tuple[Annotated[str, Limits(min_length=1, max_length=500)], ...],
        Limits(
            max_length=64,
            description="appearance of parts, texts 'TARGET: {material: NAME, base_color: [r, g, b], roughness: [low, high], ...}'; a "
            "target is category/part, id/part, category, id, room/surface or */part: docs/looks.md",
        ),
    ] = ()
    wear: Annotated[
        float, Limits(ge=-1.0, le=1.0, description="traces of use, from 0, all new, to 1, worn; -1: drawn for the type of room")
    ] = -1.0
    exclude_materials: Annotated[tuple[str, ...], Limits(max_length=256, description="named materials or families not to be used")] = ()
    palette_hue_deg: Annotated[
        float, Limits(ge=-1.0, le=360.0, unit="deg", description="main hue of the room's palette in OKLCH; -1: drawn")
    ] = -1.0
    beta: Annotated[float, Limits(ge=0.0, le=1e6, description="tidiness of the layout; 0: as the grammar says")] = 0.0
    weights: Annotated[
        Texts, Limits(max_length=64, description="lambda of energy terms, texts 'term:value' with the names of the grammar's weights")
    ] = ()
    odds: Annotated[
        Texts,
        Limits(
            max_length=64,
            description="probabilities of branches, texts 'node/branch:p' for Or (the others share the rest as before) and "
            "'node/branch:p0:p1:...' of 0, 1, ... copies for Set",
        ),
    ] = ()
    validity: Annotated[
        Texts, Limits(max_length=16, description="thresholds of the exact checks, texts 'name:value', for example 'robot_radius_m:0.3'")
    ] = ()
    daylight: Annotated[
        str, Limits(max_length=60, description="condition outside, of config/lighting.yaml, for example clear or night; empty: drawn")
    ] = ""
    solar_hour: Annotated[float, Limits(ge=-1.0, le=24.0, unit="h", description="true solar time; -1: drawn")] = -1.0
    day_of_year: Annotated[int, Limits(ge=0, le=365, description="day of the year; 0: drawn")] = 0
    latitude_deg: Annotated[float, Limits(ge=-90.0, le=999.0, unit="deg", description="latitude; 999: drawn")] = 999.0
    north_yaw_deg: Annotated[float, Limits(ge=-360.0, le=999.0, unit="deg", description="yaw at which north lies; 999: drawn")] = 999.0
    turbidity: Annotated[float, Limits(ge=0.0, le=10.0, description="haze of the air, 2 very clear to 6 hazy; 0: drawn")] = 0.0
    cloud_cover: Annotated[float, Limits(ge=-1.0, le=1.0, description="0 clear to 1 overcast; -1: drawn")] = -1.0
    surroundings: Annotated[Literal["any", "none", Setting], Limits(description="what stands outside the windows; any: drawn")] = "any"
    environment_map: Annotated[
        str,
        Limits(max_length=240, description="picture outside, .hdr or .exr below the renderer's catalogue folder; empty: sky and sun"),
    ] = ""
    environment_scale: Annotated[
        float, Limits(ge=1e-6, le=1e9, unit="cd/m2", description="luminance of value 1 of the environment map")
    ] = 179.0
    lamps: Annotated[Literal["any", "lit", "unlit"], Limits(description="all lamps lit or none; any: drawn")] = "any"

    def by_type(self) -> "tuple[SceneRequest, ...]":
        """Return the request for each of its room types."""
        return tuple(replace(self, room_type=name) for name in self.room_type.split(","))

    def of_room(self, index: int) -> "SceneRequest":
        """Return the request for the room of an index, which has one of the types."""
        requests = self.by_type()
        return requests[index % len(requests)]
