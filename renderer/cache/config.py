"""How fine the irradiance cache is: settings that trade rate for error."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class CacheConfig:
    """How fine the cache is.

    spacing_m, coarse_spacing_m: metres between nodes at which frames look light up, and between those by which it is solved; gather_rays,
    coarse_rays: rays of a node, multiples of 16; light_samples, coarse_light_samples: about how many points on lights a node samples;
    sun_samples: points on the sun, a multiple of 16.
    """

    spacing_m: float = 0.03
    coarse_spacing_m: float = 0.1
    gather_rays: int = 64
    coarse_rays: int = 32
    light_samples: int = 128
    coarse_light_samples: int = 16
    sun_samples: int = 16
