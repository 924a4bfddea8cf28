"""What services of simulation_interfaces ask for, read as strictly as a scene: fields as in the package's requests, of 1.x and 2.x.

A field that one version calls otherwise, or lacks, has both names and a default.
"""

from dataclasses import dataclass
from typing import Annotated

from scene_description import Limits

Number = Annotated[float, Limits(ge=-1e9, le=1e9)]
Byte = Annotated[int, Limits(ge=0, le=255)]
EntityName = Annotated[str, Limits(max_length=120)]
Words = Annotated[tuple[Annotated[str, Limits(max_length=500)], ...], Limits(max_length=100)]
LongText = Annotated[str, Limits(max_length=20_000_000)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Vector:
    """geometry_msgs/Vector3 and Point."""

    x: Number = 0.0
    y: Number = 0.0
    z: Number = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Quaternion:
    """geometry_msgs/Quaternion."""

    x: Number = 0.0
    y: Number = 0.0
    z: Number = 0.0
    w: Number = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Stamp:
    """builtin_interfaces/Time; ignored in requests."""

    sec: Annotated[int, Limits(ge=-(2**31), le=2**31 - 1)] = 0
    nanosec: Annotated[int, Limits(ge=0, le=2**32 - 1)] = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Header:
    """std_msgs/Header."""

    stamp: Stamp = Stamp()
    frame_id: Annotated[str, Limits(max_length=200)] = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Pose:
    """geometry_msgs/Pose."""

    position: Vector = Vector()
    orientation: Quaternion = Quaternion()


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseStamped:
    """geometry_msgs/PoseStamped."""

    header: Header = Header()
    pose: Pose = Pose()


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """geometry_msgs/Twist and Accel."""

    linear: Vector = Vector()
    angular: Vector = Vector()


@dataclass(frozen=True, slots=True, kw_only=True)
class EntityState:
    """simulation_interfaces/EntityState."""

    header: Header = Header()
    pose: Pose = Pose()
    twist: Motion = Motion()
    acceleration: Motion = Motion()


@dataclass(frozen=True, slots=True, kw_only=True)
class Category:
    """simulation_interfaces/EntityCategory."""

    category: Byte = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class TagsFilter:
    """simulation_interfaces/TagsFilter; mode 0: any of the tags, 1: all."""

    tags: Words = ()
    filter_mode: Annotated[int, Limits(ge=0, le=1)] = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds:
    """simulation_interfaces/Bounds: 0 none, 1 a box (upper and lower corner), 2 a convex hull, 3 a sphere (centre, radius as x)."""

    type: Annotated[int, Limits(ge=0, le=3)] = 0
    points: Annotated[tuple[Vector, ...], Limits(max_length=1000)] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class EntityFilters:
    """simulation_interfaces/EntityFilters."""

    filter: Annotated[str, Limits(max_length=200)] = ""
    categories: Annotated[tuple[Category, ...], Limits(max_length=100)] = ()
    tags: TagsFilter = TagsFilter()
    bounds: Bounds = Bounds()


@dataclass(frozen=True, slots=True, kw_only=True)
class Resource:
    """simulation_interfaces/Resource."""

    uri: Annotated[str, Limits(max_length=1000)] = ""
    resource_string: LongText = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Nothing:
    """A request without fields."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OfEntities:
    """GetEntities, GetEntitiesStates."""

    filters: EntityFilters = EntityFilters()


@dataclass(frozen=True, slots=True, kw_only=True)
class OfEntity:
    """GetEntityState, GetEntityInfo, GetEntityBounds, DeleteEntity."""

    entity: EntityName


@dataclass(frozen=True, slots=True, kw_only=True)
class SetEntityState:
    """``set_pose`` and so on came with 2.1; before, everything was set."""

    entity: EntityName
    state: EntityState
    set_pose: bool = True
    set_twist: bool = True
    set_acceleration: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class SpawnEntity:
    """``entity_resource`` came with 2.1, in place of the other two."""

    name: EntityName = ""
    allow_renaming: bool = False
    entity_resource: Resource = Resource()
    uri: Annotated[str, Limits(max_length=1000)] = ""
    resource_string: LongText = ""
    entity_namespace: Annotated[str, Limits(max_length=200)] = ""
    initial_pose: PoseStamped = PoseStamped()

    @property
    def resource(self) -> Resource:
        """What to spawn."""
        return Resource(
            uri=self.entity_resource.uri or self.uri, resource_string=self.entity_resource.resource_string or self.resource_string
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class SpawnEntities:
    """Several of them, one after the other."""

    spawn_requests: Annotated[tuple[SpawnEntity, ...], Limits(max_length=1000)] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class State:
    """simulation_interfaces/SimulationState."""

    state: Byte = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class SetSimulationState:
    """The state to go to."""

    state: State


@dataclass(frozen=True, slots=True, kw_only=True)
class StepSimulation:
    """How many frames to show."""

    steps: Annotated[int, Limits(ge=0, le=2**64 - 1)] = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class ResetSimulation:
    """``scope``: bits of time 1, state 2, spawned 4; 0 stands for all."""

    scope: Byte = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadWorld:
    """``world_resource`` came with 2.1, in place of the other two, which one draft of it called ``level_resource``."""

    world_resource: Resource = Resource()
    level_resource: Resource = Resource()
    uri: Annotated[str, Limits(max_length=1000)] = ""
    resource_string: LongText = ""
    fail_on_unsupported_element: bool = False
    ignore_missing_or_unsupported_assets: bool = False

    @property
    def resource(self) -> Resource:
        """What to load."""
        given = (self.world_resource, self.level_resource, Resource(uri=self.uri, resource_string=self.resource_string))
        return next((one for one in given if one.uri or one.resource_string), Resource())


@dataclass(frozen=True, slots=True, kw_only=True)
class GetSpawnables:
    """``sources`` beyond the program's own are not known."""

    sources: Words = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class GetAvailableWorlds:
    """Which worlds to list."""

    additional_sources: Words = ()
    filter: TagsFilter = TagsFilter()
    offline_only: bool = False
    continue_on_error: bool = False
