"""How colour is computed: settings of the path tracer and of what is made of its light."""

from dataclasses import dataclass
from typing import Annotated, Literal

from scene_description.strict import Limits

IntegratorName = Literal["path", "cached"]


@dataclass(frozen=True, slots=True, kw_only=True)
class RenderConfig:
    """How colour is computed."""

    integrator: Annotated[
        IntegratorName,
        Limits(description="path: every sample traces its light; cached: light is computed once for a room's surfaces, and looked up"),
    ] = "path"
    samples_per_pixel: Annotated[int, Limits(ge=1, le=65536, description="Colour samples per pixel")] = 16
    max_depth: Annotated[int, Limits(ge=1, le=64, description="Most segments of a light path; 1 shows lights only, 2 direct light")] = 32
    clamp: Annotated[
        float,
        Limits(
            ge=0.0,
            le=1e6,
            description="Most that one stroke of indirect light brings to its pixel, in units of white; all share the rest; 0: no limit",
        ),
    ] = 0.0
    caustic_blur: Annotated[
        float, Limits(ge=0.0, le=1.0, description="Least roughness of gloss that scattered light meets; 0 is exact, more has less noise")
    ] = 0.0
    blur_textures: Annotated[
        bool, Limits(description="Scattered light sees textures filtered by how far it has spread; off: as sharply as the camera does")
    ] = True
    guiding: Annotated[
        bool, Limits(description="Paths look where a first look around each room has found light: same mean, less noise at equal time")
    ] = False
    final_gathering: Annotated[
        bool,
        Limits(description="What scattered light sees of matt surfaces is looked up as the cached integrator knows it, and not traced on"),
    ] = False
    noise_target: Annotated[
        float, Limits(ge=0.0, le=1.0, description="Relative noise of the colour at which sampling ends early; 0 takes all samples")
    ] = 0.0
    time_budget_s: Annotated[
        float, Limits(ge=0.0, le=86400.0, unit="s", description="Time after which sampling ends early; 0 is no limit and repeatable")
    ] = 0.0
    denoise: Annotated[
        Literal["none", "auto", "oidn"],
        Limits(description="Denoiser of the colour: none, Open Image Denoise, or auto: that where pyoidn is installed"),
    ] = "none"
    exposure_ev100: Annotated[float, Limits(ge=-6.0, le=21.0, unit="EV", description="Exposure value at ISO 100, if not metered")] = 6.0
    auto_exposure: Annotated[bool, Limits(description="Meter the exposure of each room")] = False
    exposure_compensation_ev: Annotated[
        float, Limits(ge=-10.0, le=10.0, unit="EV", description="Brightens a metered exposure; positive is brighter")
    ] = 1.3
    exposure_key: Annotated[
        float, Limits(ge=0.0, le=1.0, description="How far a metered exposure follows the room's key: dark rooms look darker")
    ] = 0.0
    exposure_scatter_ev: Annotated[
        float,
        Limits(ge=0.0, le=3.0, unit="EV", description="Deviation of a compensation drawn for each metered room, as photographers differ"),
    ] = 0.0
    black_share: Annotated[
        float, Limits(ge=0.0, le=1.0, description="How much of the metered black the curve camera takes away: 0 leaves shadows veiled")
    ] = 1.0
    white_balance: Annotated[
        Literal["none", "auto", "kelvin"],
        Limits(description="Which light looks white: that of the display (none), the room's as metered (auto), or that of white_balance_k"),
    ] = "auto"
    white_balance_k: Annotated[
        float, Limits(ge=1700.0, le=25000.0, unit="K", description="Colour temperature that looks white with white_balance kelvin")
    ] = 5500.0
    tone_curve: Annotated[
        Literal["camera", "filmic", "srgb"],
        Limits(description="Display curve: camera, an S with a black point; filmic keeps what is brighter than white apart; srgb clips it"),
    ] = "camera"
    local_tone_stops: Annotated[
        float,
        Limits(
            ge=0.0,
            le=20.0,
            description="Stops from the longest to the shortest exposure that local tone mapping merges, 3.5 for a telephone; 0: none",
        ),
    ] = 0.0
    grain: Annotated[float, Limits(ge=0.0, le=20.0, description="Deviation of the grain of the picture in codes, of 255; 0: none")] = 0.0
    cache_spacing_m: Annotated[
        float, Limits(ge=0.01, le=0.5, unit="m", description="Distance between the points at which the cached integrator knows the light")
    ] = 0.03
    cache_rays: Annotated[
        int, Limits(ge=16, le=4096, description="Rays by which such a point looks at what surrounds it, in steps of 16")
    ] = 64
    cache_light_samples: Annotated[int, Limits(ge=2, le=1024, description="About how many points on lights such a point looks at")] = 128
    threads: Annotated[int, Limits(ge=0, le=1024, description="Threads of the kernels; 0 takes all", fixed="kernels are set up once")] = 0
    portable: Annotated[
        bool,
        Limits(
            description="Trace rays without AVX-512 and place hits by exact divisions: the same images on all processors with AVX2",
            fixed="the ray tracing device is made once",
        ),
    ] = False
