"""Settings of camera paths."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, NamedTuple

from grammar.spec.rules import GrammarError
from scene_description import FieldError, Limits, from_mapping
from scene_description.yaml_text import read_yaml

Metres = Annotated[float, Limits(ge=0.0, le=100.0, unit="m")]
Weight = Annotated[float, Limits(ge=0.0, le=100.0)]
Pitch = Annotated[float, Limits(ge=-1.2, le=1.2, unit="rad")]
Height = Annotated[float, Limits(ge=0.1, le=3.0, unit="m")]
Trials = Annotated[int, Limits(ge=1, le=1000)]


class ViewWeights(NamedTuple):
    """How a view is judged, as :func:`grammar.camera.view_ring.view_values` has it: distances in metres, a share, and weights."""

    near_m: float
    far_m: float
    least_depth_m: float
    most_share: float
    depth: float
    objects: float
    shown: float
    near: float
    filled: float
    missing: float
    light: float
    line: float
    bare: float
    main: float
    slab: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Mount:
    """A carrier of the camera: its probability, the ranges of the lens's height above the floor and of its pitch, positive upwards."""

    probability: Annotated[float, Limits(ge=0.0, le=1.0)]
    height_m: tuple[Height, Height]
    pitch_rad: tuple[Pitch, Pitch]


@dataclass(frozen=True, slots=True, kw_only=True)
class Still:
    """What a path of one frame has of its own.

    mount: who carries the camera; reach_m: how far from where a body stands the lens may be; elevations_rad: of the rays of a view, above
    its pitch, which is one of ``pitches_rad``; distances to keep, what is near, at most and as a share of the
    edge of a square room as large, weights, and how many places are tried.
    """

    mount: str
    reach_m: Metres
    elevations_rad: Annotated[tuple[Pitch, ...], Limits(min_length=1, max_length=32)]
    pitches_rad: Annotated[tuple[Pitch, ...], Limits(min_length=1, max_length=16)]
    body_radius_m: Annotated[float, Limits(ge=0.05, le=2.0, unit="m")]
    clearance_m: Annotated[float, Limits(ge=0.02, le=1.0, unit="m")]
    near_m: Metres
    near_of_room: Annotated[float, Limits(ge=0.0, le=10.0)]
    shown_weight: Weight
    bare_weight: Weight
    main_weight: Weight
    slab_weight: Weight
    viewpoint_trials: Trials


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraPathConfig:
    """How the camera moves and looks; ``config/camera.yaml`` explains each number."""

    mounts: Annotated[Mapping[str, Mount], Limits(min_length=1, max_length=16)]
    body_radius_m: Annotated[float, Limits(ge=0.05, le=2.0, unit="m")]
    clearance_m: Annotated[float, Limits(ge=0.02, le=1.0, unit="m")]
    resolution_m: Annotated[float, Limits(ge=0.01, le=0.5, unit="m")]
    path_length_m: Metres
    speed_m_s: Annotated[float, Limits(ge=0.0, le=10.0, unit="m/s")]
    max_step_m: Annotated[float, Limits(ge=0.001, le=2.0, unit="m")]
    max_turn_rad: Annotated[float, Limits(ge=0.01, le=1.5, unit="rad")]
    sway_m: Annotated[float, Limits(ge=0.0, le=0.2, unit="m")]
    smoothing_m: Annotated[float, Limits(ge=0.0, le=1.0, unit="m")]
    field_of_view_rad: Annotated[float, Limits(ge=0.1, le=3.0, unit="rad")]
    elevations_rad: Annotated[tuple[Pitch, ...], Limits(min_length=1, max_length=32)]
    near_m: Metres
    far_m: Annotated[float, Limits(ge=0.1, le=100.0, unit="m")]
    depth_weight: Weight
    things_weight: Weight
    shown_weight: Weight
    near_weight: Weight
    most_share: Annotated[float, Limits(ge=0.0, le=1.0)]
    least_depth_m: Metres
    filled_weight: Weight
    missing_weight: Weight
    light_weight: Weight
    line_weight: Weight
    bare_weight: Weight
    main_weight: Weight
    slab_weight: Weight
    travel_weight: Weight
    sweep_weight: Weight
    first_weight: Annotated[float, Limits(ge=1.0, le=100.0)]
    sweep_rad_per_m: Annotated[float, Limits(ge=0.0, le=10.0, unit="rad/m")]
    viewpoints: Annotated[int, Limits(ge=2, le=100)]
    viewpoint_trials: Trials
    path_trials: Trials
    still: Still

    def for_still(self, floor_m2: float) -> "CameraPathConfig":
        """Return these settings with those of a single frame, in a room of a floor area, in place."""
        still = self.still
        return replace(
            self,
            mounts={still.mount: replace(self.mounts[still.mount], probability=1.0)},
            body_radius_m=still.body_radius_m,
            clearance_m=still.clearance_m,
            near_m=min(still.near_m, still.near_of_room * math.sqrt(floor_m2)),
            shown_weight=still.shown_weight,
            bare_weight=still.bare_weight,
            main_weight=still.main_weight,
            slab_weight=still.slab_weight,
            elevations_rad=still.elevations_rad,
            viewpoint_trials=still.viewpoint_trials,
        )

    @property
    def view_weights(self) -> ViewWeights:
        """How views are judged."""
        return ViewWeights(
            near_m=self.near_m,
            far_m=self.far_m,
            least_depth_m=self.least_depth_m,
            most_share=self.most_share,
            depth=self.depth_weight,
            objects=self.things_weight,
            shown=self.shown_weight,
            near=self.near_weight,
            filled=self.filled_weight,
            missing=self.missing_weight,
            light=self.light_weight,
            line=self.line_weight,
            bare=self.bare_weight,
            main=self.main_weight,
            slab=self.slab_weight,
        )


def read_camera_path_config(path: Path) -> CameraPathConfig:
    """Read and check the settings of camera paths, for example ``config_path("camera.yaml")``.

    Raises:
        GrammarError: the file does not parse or a field does not fit; one line with file and field.
    """
    try:
        config = from_mapping(CameraPathConfig, read_yaml(path, GrammarError))
        total = math.fsum(mount.probability for mount in config.mounts.values())
        if abs(total - 1.0) > 1e-6:
            raise FieldError("mounts", "probabilities that sum to 1", f"{total:.6g}")
        if config.still.mount not in config.mounts:
            raise FieldError("still.mount", f"one of {', '.join(config.mounts)}", config.still.mount)
        for name, mount in config.mounts.items():
            for field in ("height_m", "pitch_rad"):
                low, high = getattr(mount, field)
                if low > high:
                    raise FieldError(f"mounts.{name}.{field}", "low <= high", f"[{low}, {high}]")
    except FieldError as error:
        raise GrammarError(f"{path}: {error}") from None
    return config
