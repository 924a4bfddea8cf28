"""The replay node's parameters."""

from dataclasses import dataclass
from typing import Annotated

from scene_description import Limits

_BAG_FIXED = "a bag is opened once"
_START_FIXED = "it is used at the start only"


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplayConfig:
    """Settings of the replay node."""

    bag: Annotated[str, Limits(max_length=4096, description="Folder of the bag, or its .mcap file", fixed=_BAG_FIXED)] = ""
    rate: Annotated[float, Limits(ge=0.001, le=1000.0, description="Speed, 2 is twice as fast as recorded")] = 1.0
    loop: Annotated[bool, Limits(description="Begin again at the end")] = False
    start_offset_s: Annotated[float, Limits(ge=0.0, le=1e9, unit="s", description="Skip the beginning", fixed=_START_FIXED)] = 0.0
    topics: Annotated[
        tuple[str, ...], Limits(max_length=1000, description="Publish only these topics; empty: all", fixed="publishers are made once")
    ] = ()
    clock_hz: Annotated[
        float,
        Limits(
            ge=0.0,
            le=1000.0,
            unit="Hz",
            description="Publish /clock at this rate by the wall clock, instead of what was recorded; 0: as recorded",
            fixed=_START_FIXED,
        ),
    ] = 0.0
    start_paused: Annotated[bool, Limits(description="Wait for the service ~/resume before the first message", fixed=_START_FIXED)] = False
    wait_for_subscribers_s: Annotated[
        float,
        Limits(ge=0.0, le=3600.0, unit="s", description="Wait at most this long until every topic has a subscriber", fixed=_START_FIXED),
    ] = 2.0
