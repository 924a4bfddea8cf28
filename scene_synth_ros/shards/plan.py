"""The plan of a dataset, ``dataset.json``: which rooms with which parameters, and how they are cut into shards."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from itertools import pairwise
from typing import Annotated, Any

from scene_description import FieldError, Limits, SceneSynthError, from_mapping
from scene_synth_ros.bags.dataset_files import PLAN_SCHEMA
from scene_synth_ros.bags.run_info import MADE_BY, parameters_note
from scene_synth_ros.offline.settings import OfflineSettings, read_settings
from scene_synth_ros.shards.provenance import Provenance, provenance_of

MAX_ROOMS, MAX_FRAMES, MAX_SHARDS = 10**9, 100_000, 10**6
MAX_PLAN_BYTES = 16 * 2**20
_MAX_DEFAULT_ROOMS, _DEFAULT_SHARDS = 16, 32
_NOT_COMPARED = ("parameters", "provenance")

Rooms = Annotated[int, Limits(ge=1, le=MAX_ROOMS)]


class PlanError(SceneSynthError):
    """A plan that does not fit, or that is not the one of the folder; one line."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DatasetPlan:
    """Everything that decides the bytes of a dataset.

    Attributes:
        rooms: of the dataset; room i has index i.
        frames: of each room.
        seed: of the run.
        rooms_per_shard: of every shard but the last before each number of ``extended_from`` and at the end, which have what is left.
        shard_bytes: about how large shards shall be, where ``rooms_per_shard`` follows from it and the bytes of the first room; else 0.
        namespace: of nodes and topics, without a slash at its end.
        parameters: node name -> parameter name -> value, as given; what is not given has its default.
        extended_from: how many rooms the dataset had before it was extended, each time that this left a shard with fewer rooms.
        provenance: of what made the shards: the first began the dataset, others were accepted.
    """

    rooms: Rooms
    frames: Annotated[int, Limits(ge=1, le=MAX_FRAMES)]
    seed: Annotated[int, Limits(ge=0, le=2**63 - 1)]
    rooms_per_shard: Rooms
    shard_bytes: Annotated[int, Limits(ge=0)] = 0
    namespace: str = "/synth"
    parameters: Mapping[str, Mapping[str, Any]]
    extended_from: Annotated[tuple[Rooms, ...], Limits(max_length=1000)] = ()
    provenance: Annotated[tuple[Provenance, ...], Limits(max_length=1000)] = ()

    @property
    def shards(self) -> int:
        """How many shards there are."""
        return sum(-(-len(rooms) // self.rooms_per_shard) for rooms in self._runs())

    def _runs(self) -> list[range]:
        """Return the rooms that were asked for at once."""
        return [range(*ends) for ends in pairwise((0, *self.extended_from, self.rooms))]

    def rooms_of(self, shard: int) -> range:
        """Return the indices of a shard's rooms.

        Raises:
            PlanError: there is no such shard.
        """
        if not 0 <= shard < self.shards:
            raise PlanError(f"shard {shard}: expected 0 to {self.shards - 1}")
        for rooms in self._runs():
            first = rooms.start + shard * self.rooms_per_shard
            if first < rooms.stop:
                return range(first, min(rooms.stop, first + self.rooms_per_shard))
            shard -= -(-len(rooms) // self.rooms_per_shard)
        raise AssertionError("a shard lies in a run of rooms")

    def extended(self, rooms: int) -> "DatasetPlan":
        """Return the plan of a dataset with more rooms, which leaves the shards of this one as they are."""
        last = len(self._runs()[-1]) % self.rooms_per_shard
        return replace(self, rooms=rooms, extended_from=(*self.extended_from, self.rooms) if last else self.extended_from)

    def own_provenance(self) -> Provenance:
        """Return the provenance of shards that this process makes.

        Raises:
            OSError, SceneSynthError: a parameter does not fit, or a file of the user's cannot be read.
        """
        renders = [groups["render"] for groups in self.settings_of(0).renderers.values()]
        words = {name: getattr(self, name) for name in ("frames", "seed", "namespace", "parameters")}
        return provenance_of(
            words, portable=all(render.portable for render in renders), denoised=any(render.denoise != "none" for render in renders)
        )

    def settings_of(self, shard: int) -> OfflineSettings:
        """Return the parameters of a shard: those of a run of its rooms alone (``grammar_node.first_index``, ``rooms``).

        Raises:
            ParameterError: a parameter does not fit.
        """
        rooms = self.rooms_of(shard)
        parameters = {node: dict(values) for node, values in self.parameters.items()}
        of_run = {"rooms": len(rooms), "first_index": rooms.start, "frames_per_room": self.frames, "seed": self.seed}
        parameters["grammar_node"] |= of_run
        notes = parameters["recorder_node"].get("custom_data", [])
        noted = [parameters_note(parameters) if note == MADE_BY else note for note in notes]
        parameters["recorder_node"] |= {"custom_data": noted, "bag": "bag"}  # the name stands for that of the shard
        return read_settings(parameters, self.namespace)

    def to_json(self) -> bytes:
        """Return the file's bytes."""
        document = {"schema": PLAN_SCHEMA, **asdict(self), "shards": self.shards}
        return (json.dumps(document, indent=1, sort_keys=True) + "\n").encode()

    @property
    def sha256(self) -> str:
        """SHA-256 of the file, in hexadecimal."""
        return hashlib.sha256(self.to_json()).hexdigest()

    def difference(self, other: "DatasetPlan") -> str:
        """Return the first field in which another plan differs, with its values here and there; empty if none does."""
        for field in fields(self):
            if field.name not in _NOT_COMPARED and (own := getattr(self, field.name)) != (its := getattr(other, field.name)):
                return f"{field.name}: {own!r} here, {its!r} there"
        for node in sorted({*self.parameters, *other.parameters}):
            one, two = self.parameters.get(node, {}), other.parameters.get(node, {})
            for name in sorted({*one, *two}):
                if name not in one or name not in two or one[name] != two[name]:
                    said = (repr(values[name]) if name in values else "its default" for values in (one, two))
                    return "parameter {}.{}: {} here, {} there".format(node, name, *said)
        return ""


def make_plan(
    parameters: Mapping[str, Mapping[str, Any]], *, rooms_per_shard: int = 0, shard_bytes: int = 0, namespace: str = "/synth"
) -> DatasetPlan:
    """Return the plan of a dataset by the parameters of a run.

    Args:
        parameters: of all nodes, node name -> parameter -> value, with ``grammar_node.rooms``; those that tell where and when are left out.
        rooms_per_shard: 0 takes :func:`default_rooms_per_shard`.
        shard_bytes: that it follows from; 0 if it does not.
        namespace: of nodes and topics.

    Raises:
        ParameterError: a parameter does not fit.
        PlanError: the run has no end, does not begin with room 0, or its bags are split in another way.
    """
    settings = read_settings(parameters, namespace)
    run = settings.run
    if not run.rooms:
        raise PlanError(f"rooms: expected 1 to {MAX_ROOMS}, got 0")
    if run.first_index:
        raise PlanError(f"grammar_node.first_index: expected 0, got {run.first_index}: a dataset begins with room 0; take another --seed")
    split = settings.recorder["split"]
    if split.size_mb or split.duration_s or split.rooms:
        raise PlanError("recorder_node.split: expected none: a shard is one file, whose size --shard-rooms or --shard-size decides")
    left_out = {"grammar_node": {"rooms", "first_index", "frames_per_room", "seed"}, "recorder_node": {"bag", "custom_data"}}
    kept = {node: {k: v for k, v in values.items() if k not in left_out.get(node, ())} for node, values in parameters.items()}
    notes = parameters["recorder_node"].get("custom_data", [])
    kept["recorder_node"]["custom_data"] = [MADE_BY if str(note).startswith(MADE_BY) else note for note in notes]
    plan = DatasetPlan(
        rooms=run.rooms,
        frames=run.frames_per_room,
        seed=run.seed,
        rooms_per_shard=min(rooms_per_shard or default_rooms_per_shard(run.rooms), run.rooms),
        shard_bytes=shard_bytes,
        namespace=settings.namespace,
        parameters=json.loads(json.dumps(kept)),
    )
    plan = replace(plan, provenance=(plan.own_provenance(),))
    if plan.shards > MAX_SHARDS:
        raise PlanError(f"shards: expected at most {MAX_SHARDS}, got {plan.shards}; raise --shard-rooms")
    return plan


def default_rooms_per_shard(rooms: int) -> int:
    """Return how many rooms a shard has: few enough that workers end together and an interruption costs little, 16 in large datasets."""
    return max(1, min(_MAX_DEFAULT_ROOMS, rooms // _DEFAULT_SHARDS))


def read_plan(data: bytes, where: str) -> DatasetPlan:
    """Read ``dataset.json``.

    Raises:
        PlanError: it does not fit.
    """
    try:
        document = json.loads(data)
    except (ValueError, RecursionError):
        raise PlanError(f"{where}: expected JSON, got bytes that are none") from None
    if not isinstance(document, dict) or document.get("schema") != PLAN_SCHEMA:
        raise PlanError(f"{where}: expected a plan with schema {PLAN_SCHEMA}")
    try:
        plan = from_mapping(DatasetPlan, {name: value for name, value in document.items() if name not in ("schema", "shards")})
        if any(after <= before for before, after in pairwise((*plan.extended_from, plan.rooms))):
            raise FieldError("extended_from", "rising numbers of rooms below that of the plan", repr(plan.extended_from))
        if not plan.provenance:
            raise FieldError("provenance", "of what began the dataset", "none")
        if document.get("shards") != plan.shards:
            raise FieldError("shards", f"{plan.shards}, as rooms and rooms_per_shard have it", repr(document.get("shards")))
    except FieldError as error:
        raise PlanError(f"{where}: {error}; it is not what scene_synth generate has written") from None
    missing = {"grammar_node", "renderer_node", "recorder_node"} - plan.parameters.keys()
    if missing:
        raise PlanError(f"{where}: parameters: expected {', '.join(sorted(missing))}, too")
    return plan
