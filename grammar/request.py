"""What a user may ask of a room."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, get_args

from scene_description import Limits

GrammarSet = Literal["learned", "by_hand"]
GRAMMAR_SETS: tuple[GrammarSet, ...] = get_args(GrammarSet)


class RequestError(ValueError):
    """A room that cannot be had: the line names the constraint that cannot be met and what to change."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneRequest:
    """Constraints on a room beyond its grammar."""

    room_type: Annotated[
        str, Limits(min_length=1, max_length=60, pattern=r"[a-z][a-z0-9_]*", description="kind of room, the name of a grammar")
    ] = "bedroom"
    grammar_set: Annotated[
        GrammarSet, Limits(description="learned: from real rooms, for the room types that have such a grammar; by_hand: none of these")
    ] = "learned"
    min_objects: Annotated[int, Limits(ge=0, le=500, description="least number of objects, doors and windows not counted")] = 0
    max_objects: Annotated[int, Limits(ge=1, le=500, description="greatest number of objects, doors and windows not counted")] = 40
    room_width_m: Annotated[float, Limits(ge=0.0, le=30.0, unit="m", description="room size along x; 0: drawn by the grammar")] = 0.0
    room_depth_m: Annotated[float, Limits(ge=0.0, le=30.0, unit="m", description="room size along y; 0: drawn by the grammar")] = 0.0
    room_polygon_m: Annotated[
        tuple[float, ...],
        Limits(max_length=128, unit="m", description="floor outline x0, y0, x1, y1, ...; empty: drawn by the grammar"),
    ] = ()
    must_have: Annotated[tuple[str, ...], Limits(max_length=64, description="categories of which there is at least one object")] = ()
    must_not: Annotated[tuple[str, ...], Limits(max_length=64, description="categories of which there is none")] = ()
    counts: Annotated[
        tuple[str, ...], Limits(max_length=64, description="least and greatest number by category, texts 'category:least:most'")
    ] = ()
    clutter: Annotated[float, Limits(ge=0.0, le=10.0, description="scales how many things stand on things; 1: as the grammar says")] = 1.0
    beta: Annotated[float, Limits(ge=0.0, le=1e6, description="tidiness of the layout; 0: as the grammar says")] = 0.0
