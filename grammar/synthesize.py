"""Rooms complete with everything: layout, materials, lamps, daylight and the camera's path.

Room ``index`` of a run depends on the run's seed, the index, the request and the configuration, and on nothing else: every purpose draws
from a stream of its own, so that a change of one leaves the others as they are.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grammar.appearance.appearance import MaterialPool, sample_appearance_from
from grammar.appearance.appearance_rules import Appearance, load_appearance, sample_wear
from grammar.appearance.daylight import LEAST_TURBIDITY, DaylightRequest
from grammar.appearance.lighting import LightingConfig, read_lighting_config, sample_downlights, sample_lighting, sample_surroundings
from grammar.appearance.looks import apply_looks
from grammar.appearance.restrict import restricted
from grammar.camera.camera_path import CameraSpace
from grammar.camera.camera_path import CameraTimes as CameraTimes
from grammar.camera.motion_config import WALK, MotionConfig
from grammar.camera.motions import sample_motion
from grammar.camera.path_config import CameraPathConfig, read_camera_path_config
from grammar.camera.sights import find_sights
from grammar.catalog import RoomModels, assign_file_materials, choose_after, choose_before, entry_faults
from grammar.checks.metrics import SamplingCost
from grammar.derivation.plan import check_room_size, make_plan
from grammar.geometry.boxes import COS_YAW, HALF_DEPTH, HALF_WIDTH, SIN_YAW, Z_HIGH, Z_LOW, X, Y
from grammar.geometry.free_space import occupancy_grid, rasterize
from grammar.geometry.slopes import low_ceiling, roof_boxes
from grammar.geometry.solids import object_solids
from grammar.sampled_room import SampledRoom, sample_room_with_cost
from grammar.small_things.fill import Source
from grammar.small_things.rules import NO_SMALL_THINGS, SmallThings, read_small_things
from grammar.small_things.strew import FurnishedRoom, strew
from grammar.spec.categories import Categories, Category, read_categories
from grammar.spec.grammar_file import GrammarTable, learned_types, read_grammar, room_types
from grammar.spec.request import RequestError, SceneRequest
from grammar.spec.rules import Grammar, GrammarError, Thresholds
from scene_description import NYU40, SCHEMA, Environment, EnvironmentMap, Light, Luminaire, Room, SceneDescription, SceneObject
from scene_description.catalog import Catalog
from scene_description.kinematics import kinematics
from scene_description.rounding import rounded
from scene_description.share import config_path

PURPOSES = ("layout", "appearance", "lighting", "camera", "looks", "catalog", "downlights", "small_things", "surroundings", "wear")
"""Streams of random numbers of a room, in the order of their spawn keys."""


LENS_GAP_M = 0.2
"""Space that small things leave a camera on its path."""
DRIVEN_OVER_M = 0.025
"""Height of what a base drives over, as rugs."""
_FOOTPRINT_S, _FOOTPRINT_GAP_M = 0.1, 0.02
"""Time between the footprints of a base that small things keep clear of, and by how much."""


class FloorMap(NamedTuple):
    """The free floor: cells (h, w) int8 as nav_msgs/OccupancyGrid has them, row 0 at the lowest y, and where cell [0, 0] begins."""

    cells: NDArray[np.int8]
    resolution_m: float
    origin_m: tuple[float, float]


def daylight_request(request: SceneRequest) -> DaylightRequest:
    """Return what a request fixes of the daylight."""
    return DaylightRequest(
        condition=request.daylight or None,
        latitude_deg=request.latitude_deg if request.latitude_deg <= 90.0 else None,
        day_of_year=request.day_of_year or None,
        solar_hour=request.solar_hour if request.solar_hour >= 0.0 else None,
        turbidity=max(request.turbidity, LEAST_TURBIDITY) if request.turbidity else None,
        north_yaw_deg=request.north_yaw_deg if request.north_yaw_deg <= 360.0 else None,
        cloud_cover=request.cloud_cover if request.cloud_cover >= 0.0 else None,
    )


def _streams(seed: int, index: int) -> dict[str, np.random.Generator]:
    """Return the streams of random numbers of a room by purpose."""
    return {purpose: np.random.default_rng(np.random.SeedSequence([seed, index, i])) for i, purpose in enumerate(PURPOSES)}


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneSynthesizer:
    """The configuration that rooms are sampled from; each file is read once."""

    categories: Categories
    appearance: Appearance
    lighting: LightingConfig
    camera: CameraPathConfig
    grammars: Mapping[str, Grammar]
    """Room type -> grammar written by hand."""
    learned: Mapping[str, Grammar] = field(default_factory=dict)
    """Room type -> grammar learned from real rooms."""
    catalog: Catalog = field(default_factory=Catalog)
    """The user's own models."""
    small_things: SmallThings = NO_SMALL_THINGS
    """What stands and lies on furniture."""
    motion: MotionConfig = WALK
    """What carries the camera, and how it moves."""

    @classmethod
    def from_config(cls, grammar_files: Sequence[Path] = ()) -> "SceneSynthesizer":
        """Read the files of ``config/``, once in a process, and more grammars, which take the place of those of the same room types.

        The other grammars are read when a room asks for them.

        Raises:
            GrammarError: a file does not fit; one line with file and field.
        """
        shipped = _shipped()
        own = {grammar.room_type: grammar for grammar in (read_grammar(path, shipped.categories) for path in grammar_files)}
        if not own:
            return shipped
        by_hand = GrammarTable(room_types(), "by_hand", shipped.categories, own)
        learned = GrammarTable((name for name in learned_types() if name not in own), "learned", shipped.categories, {})
        return replace(shipped, grammars=by_hand, learned=learned)

    def with_catalog(self, catalog: Catalog) -> "SceneSynthesizer":
        """Return a synthesizer that also takes models of a catalogue.

        Raises:
            GrammarError: a model asks for what is not there: categories, families, parts; one line.
        """
        for model in catalog.models:
            faults = entry_faults(model.entry, self.appearance, tuple(model.parts))
            if faults:
                raise GrammarError(f"catalogue: {model.entry.file}: {faults[0]}")
        for category in catalog.procedural:
            if category not in self.appearance.categories:
                raise GrammarError(f"catalogue: procedural.{category}: expected a category that is known, got another")
        return replace(self, catalog=catalog)

    def check(self, request: SceneRequest) -> None:
        """Refuse a request that no room can meet, as far as that can be said without sampling.

        Raises:
            RequestError: the room type is unknown, or the constraints contradict each other.
        """
        for one in request.by_type():
            if one.room_type not in self.grammars:
                raise RequestError(f"room_type: expected one of {', '.join(self.grammars)}, got '{one.room_type}'")
            plan = make_plan(self.grammar_of(one), self.categories, one)
            if not self.catalog.models:  # a model may be smaller than what the grammar draws
                check_room_size(plan, self.categories)
            restricted(self.appearance, self._as_known(one), self._categories(one), self._file_parts())

    def grammar_of(self, request: SceneRequest) -> Grammar:
        """Return the grammar that the rooms of a request for one type are sampled from, by this and its grammar set."""
        learned = request.grammar_set == "learned" and request.room_type in self.learned
        return (self.learned if learned else self.grammars)[request.room_type]

    def _file_parts(self) -> dict[str, set[str]]:
        """Return category -> parts of the catalogue's models."""
        parts: dict[str, set[str]] = {}
        for model in self.catalog.models:
            parts.setdefault(model.entry.category, set()).update(model.parts)
        return parts

    def _categories(self, request: SceneRequest) -> list[str]:
        """Return the categories that a room of this request may hold."""
        grammar = self.grammar_of(request)
        return sorted({*grammar.openings, *(rule.category for rule in grammar.objects.values())} - set(request.must_not))

    def _as_known(self, request: SceneRequest) -> SceneRequest:
        """Return a request with the room type by which the tables of materials know its rooms."""
        return replace(request, room_type=self.grammar_of(request).looks_like)

    def synthesize(self, request: SceneRequest, seed: int, index: int, times: CameraTimes) -> SceneDescription:
        """Sample room number ``index`` of the run with a seed.

        Raises:
            RequestError: the constraints cannot be met.
            GrammarError: the grammar of the room type does not fit, or no valid room was found within its budget.
        """
        return self.synthesize_with_cost(request, seed, index, times)[0]

    def synthesize_with_cost(
        self, request: SceneRequest, seed: int, index: int, times: CameraTimes
    ) -> tuple[SceneDescription, SamplingCost]:
        """Do as :meth:`synthesize` and also return the cost of the layout."""
        request = request.of_room(index)
        self.check(request)
        rng = _streams(seed, index)
        # sample the layout, with the models that decide it, and small things
        appearance = restricted(self.appearance, self._as_known(request), (), self._file_parts())
        models = choose_before(rng["catalog"], self.catalog, appearance, self.grammar_of(request), self.categories)
        furnished, cost = sample_room_with_cost(models.grammar, models.categories, request, rng["layout"])
        sampled, gone, moved = self._strewn(request, models, furnished, rng["small_things"])
        # sample the appearance, of small things that are not there too, so that the rest looks the same at any clutter
        objects, taken = choose_after(rng["catalog"], self.catalog, appearance, models, sampled.objects)
        pool = MaterialPool(rng["appearance"], appearance)
        room, objects = sample_appearance_from(pool, rng["appearance"], appearance, sampled.room, objects, models.grammar.looks_like)
        objects = assign_file_materials(rng["catalog"], pool, appearance, taken, objects)
        room, objects = apply_looks(rng["looks"], pool, request, room, objects)
        # sample the light and the camera's path, which small things do not change
        lights, spots, environment = self._light(rng, request, room, objects)
        boxes, owners = object_solids(self.categories, (*furnished.objects, *moved))
        objects = tuple(item for item in objects if item.id not in gone)
        space = CameraSpace(room.polygon_m, room.height_m, boxes, roof_boxes(room), find_sights(room, owners, lights))
        path, motion = sample_motion(rng["camera"], self.motion, self.camera, space, times)
        first = max((item.id for item in furnished.objects), default=0) + 1
        objects = clear_of_path(self.categories, np.array([pose.position_m for pose in path]), objects, first)
        if motion is not None and motion.drive is not None:
            times_s = np.arange(0.0, motion.duration_s, _FOOTPRINT_S)
            wheels = kinematics(motion, times_s).position_m + np.array((0.0, 0.0, DRIVEN_OVER_M))
            objects = clear_of_path(self.categories, wheels, objects, first, self.motion.body_radius_m + _FOOTPRINT_GAP_M, 0.0)
        scene = SceneDescription(
            schema=SCHEMA,
            id=f"{request.room_type}-{seed}-{index}",
            index=index,
            seed=seed,
            category=request.room_type,
            room=room,
            objects=objects,
            materials=tuple(pool.materials),
            lights=lights,
            luminaires=spots,
            wear=sample_wear(rng["wear"], appearance.wear, models.grammar.looks_like, request.wear),
            environment=environment,
            camera_path=path,
            parse_graph=sampled.parse_graph,
            validity=sampled.validity,
            motion=motion,
        )
        return rounded(scene), cost

    def layout(self, request: SceneRequest, seed: int, index: int) -> SampledRoom:
        """Sample a room as :meth:`synthesize` does, without looks, light and camera."""
        request, rng = request.of_room(index), _streams(seed, index)
        appearance = restricted(self.appearance, self._as_known(request), (), self._file_parts())
        models = choose_before(rng["catalog"], self.catalog, appearance, self.grammar_of(request), self.categories)
        furnished, _ = sample_room_with_cost(models.grammar, models.categories, request, rng["layout"])
        sampled, gone, _ = self._strewn(request, models, furnished, rng["small_things"])
        return replace(sampled, objects=tuple(item for item in sampled.objects if item.id not in gone))

    def _strewn(
        self, request: SceneRequest, models: RoomModels, sampled: SampledRoom, rng: np.random.Generator
    ) -> tuple[SampledRoom, frozenset[int], tuple[SceneObject, ...]]:
        """Return a furnished room with small things, the ids of its objects that the clutter asked for leaves out, and what may move."""
        sizes = {rule.category: rule.high_m for rule in models.grammar.objects.values() if rule.category in models.chosen}
        source = Source(
            rules=self.small_things,
            grammar=models.grammar,
            categories=models.categories,
            request=request,
            sizes_m=sizes,
            held=frozenset(model.entry.category for model in self.catalog.models),
        )
        before = FurnishedRoom(sampled.room, sampled.objects, sampled.parse_graph, sampled.validity)
        (_, objects, graph, report), gone, moved = strew(source, tuple(self.lighting.lamps), before, rng)
        return replace(sampled, objects=objects, parse_graph=graph, validity=report), gone, moved

    def _light(
        self, rng: Mapping[str, np.random.Generator], request: SceneRequest, room: Room, objects: Sequence[SceneObject]
    ) -> tuple[tuple[Light, ...], tuple[Luminaire, ...], Environment]:
        """Sample lamps, spots in the ceiling and daylight, as far as the request leaves them open."""
        lights, environment = sample_lighting(
            rng["lighting"],
            self.lighting,
            objects,
            windows=any(opening.category == "window" for opening in room.openings),
            request=daylight_request(request),
        )
        spots = sample_downlights(
            rng["downlights"],
            self.lighting.downlights.get(self.grammar_of(request).looks_like),
            room,
            objects,
            dark=environment.daylight is None,
        )
        environment = replace(environment, surroundings=sample_surroundings(rng["surroundings"], self.lighting, request.surroundings))
        if request.environment_map:
            yaw_rad = math.radians(request.north_yaw_deg) if request.north_yaw_deg <= 360.0 else 0.0
            picture = EnvironmentMap(file=request.environment_map, yaw_rad=yaw_rad, luminance_scale=request.environment_scale)
            environment = replace(environment, map=picture)
        if request.lamps != "any":
            lights = tuple(replace(light, on=request.lamps == "lit") for light in lights)
            spots = tuple(replace(spot, on=request.lamps == "lit") for spot in spots)
        return lights, spots, environment

    def floor_map(self, scene: SceneDescription) -> FloorMap:
        """Return the free floor of a room, for navigation: what a robot as tall as the grammar's may stand on."""
        return floor_map(scene, self.categories, self.grammars[scene.category].validity)


def clear_of_path(
    categories: Categories,
    places_m: NDArray[np.float64],
    objects: Sequence[SceneObject],
    first: int,
    aside_m: float = LENS_GAP_M,
    above_m: float = LENS_GAP_M,
) -> tuple[SceneObject, ...]:
    """Return the objects without those small things, whose ids begin at ``first``, that come too close to one of the places (n, 3).

    Too close is less than ``aside_m`` in plan and ``above_m`` in height.
    """
    loose = [item for item in objects if item.id >= first and item.support.kind != "object"]
    boxes, owners = object_solids(categories, loose)
    at = places_m.reshape(-1, 1, 3)
    dx, dy = at[..., 0] - boxes[:, X], at[..., 1] - boxes[:, Y]
    deep = np.abs(dx * boxes[:, COS_YAW] + dy * boxes[:, SIN_YAW]) < boxes[:, HALF_DEPTH] + aside_m
    wide = np.abs(dy * boxes[:, COS_YAW] - dx * boxes[:, SIN_YAW]) < boxes[:, HALF_WIDTH] + aside_m
    high = (at[..., 2] > boxes[:, Z_LOW] - above_m) & (at[..., 2] < boxes[:, Z_HIGH] + above_m)
    gone = set(owners[(deep & wide & high).any(axis=0)].tolist())
    for item in objects:  # what stands on others comes after them
        if item.support.id in gone:
            gone.add(item.id)
    return tuple(item for item in objects if item.id not in gone)


def floor_map(scene: SceneDescription, categories: Categories, thresholds: Thresholds) -> FloorMap:
    """Return the free floor of a room; objects of a category that is not in the table count with their whole box.

    Raises:
        GrammarError: the map would have too many cells.
    """
    known = {item.category: Category(label=NYU40[item.label].name) for item in scene.objects} | dict(categories)
    boxes = np.concatenate([object_solids(known, scene.objects)[0], low_ceiling(scene.room, thresholds.robot_height_m)])
    free = rasterize(scene.room.polygon_m, boxes, thresholds.grid_resolution_m, thresholds.robot_height_m)
    return FloorMap(occupancy_grid(free), free.resolution_m, free.origin_m)


@cache
def _shipped() -> SceneSynthesizer:
    """Return the synthesizer of the configuration that comes with the program."""
    categories = read_categories(config_path("categories.yaml"))
    return SceneSynthesizer(
        categories=categories,
        grammars=GrammarTable(room_types(), "by_hand", categories, {}),
        learned=GrammarTable(learned_types(), "learned", categories, {}),
        appearance=load_appearance(config_path("appearance.yaml"), config_path("materials.yaml")),
        lighting=read_lighting_config(config_path("lighting.yaml")),
        camera=read_camera_path_config(config_path("camera.yaml")),
        small_things=read_small_things(config_path("small_things.yaml"), categories),
    )
