"""Bounded numbers of grammar files and the truncated normal distribution."""

import math
from dataclasses import dataclass
from typing import Annotated, Literal

from scene_description import FieldError, Limits

Symbol = Annotated[str, Limits(min_length=1, max_length=60, pattern=r"[a-z][a-z0-9_]*")]
Probability = Annotated[float, Limits(ge=0.0, le=1.0)]
Metres = Annotated[float, Limits(ge=-50.0, le=50.0, unit="m")]
Extent = Annotated[float, Limits(ge=0.001, le=50.0, unit="m")]
Spread = Annotated[float, Limits(ge=1e-6, le=50.0, unit="m")]
Distance = Annotated[float, Limits(ge=0.0, le=50.0, unit="m")]
Radians = Annotated[float, Limits(ge=-math.pi, le=math.pi, unit="rad")]
SpreadAngle = Annotated[float, Limits(ge=1e-4, le=0.6, unit="rad")]
Weight = Annotated[float, Limits(ge=0.0, le=1e6)]
Count = Annotated[int, Limits(ge=0, le=10_000_000)]
Side = Literal["front", "back", "left", "right"]
Looseness = Annotated[float, Limits(ge=0.01, le=1000.0)]


@dataclass(frozen=True, slots=True, kw_only=True)
class TruncatedNormal:
    """A normal distribution with ``mean`` and ``sd`` before truncation to [low, high]; lengths in metres."""

    mean: Metres
    sd: Spread
    low: Distance
    high: Distance

    def times(self, factor: float) -> "TruncatedNormal":
        """Return the distribution of so many times the value."""
        return TruncatedNormal(mean=factor * self.mean, sd=factor * self.sd, low=factor * self.low, high=factor * self.high)


def range_error(path: str, low: float, high: float) -> FieldError:
    """Return the error for bounds that are the wrong way round."""
    return FieldError(path, f"a lower bound below the upper bound {high:g}", f"{low:g}")
