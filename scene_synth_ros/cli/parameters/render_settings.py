"""The settings of ``scene_synth render``: a preset, overlays as for ``scene_synth run``, then single values."""

import argparse
from collections.abc import Mapping
from typing import Any, NamedTuple

from renderer import CameraConfig, DepthSensorConfig, RenderConfig, SensorConfig
from renderer.lidar.config import ScanConfig
from scene_description import from_mapping
from scene_description.share import config_path
from scene_description.strict import whole_number
from scene_synth_ros.cli.options import UsageError, add_field
from scene_synth_ros.cli.parameters.run_parameters import add_overlay
from scene_synth_ros.cli.parameters.run_profile import ProfileError, apply_overrides, load_profile

PRESETS = ("realtime", "stream", "balanced", "photo")
"""Named settings of the renderer, ``config/presets/<name>.yaml``, quick ones first; also overlays of run profiles."""

NODE = "renderer_node"
GROUPS: dict[str, type] = {
    "camera": CameraConfig,
    "render": RenderConfig,
    "sensor": SensorConfig,
    "depth_sensor": DepthSensorConfig,
    "scan": ScanConfig,
}


class Settings(NamedTuple):
    """Camera, renderer, sensors and laser scanner."""

    camera: CameraConfig
    render: RenderConfig
    sensor: SensorConfig
    depth_sensor: DepthSensorConfig
    scan: ScanConfig


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options that say how pictures are made."""
    parser.add_argument("--preset", choices=PRESETS, default="balanced", help="how colour is computed (default: %(default)s)")
    add_overlay(parser)
    parser.add_argument(
        "-p",
        dest="parameters",
        action="append",
        default=[],
        metavar="NAME:=VALUE",
        help="one of camera., render., sensor., depth_sensor. or scan.; see docs/parameters.md",
    )
    preset = "(default: the preset's)"
    add_field(parser, "--spp", RenderConfig, "samples_per_pixel", help=f"colour samples per pixel {preset}")
    add_field(parser, "--threads", RenderConfig, "threads", default=0, help="threads; 0 takes all (default: %(default)s)")
    add_field(parser, "--exposure", RenderConfig, "exposure_ev100", metavar="EV100", help="exposure value (default: metered)")
    parser.add_argument("--white-balance", metavar="auto|none|KELVIN", help="light that looks white (default: auto)")
    add_field(parser, "--tone", RenderConfig, "tone_curve", help=f"display curve {preset}")
    add_field(parser, "--denoise", RenderConfig, "denoise", help=f"denoiser of the colour {preset}")
    parser.add_argument("--size", metavar="WxH", help="image size (default: 640x480)")


def read_settings(arguments: argparse.Namespace) -> Settings:
    """Return the settings that the options ask for.

    Raises:
        UsageError: an option does not fit; one line.
    """
    values: dict[str, Any] = {f"render.{name}": value for name, value in preset_settings(arguments.preset, arguments.spp).items()}
    values |= {"render.auto_exposure": True, "render.threads": arguments.threads}
    for overlay in arguments.overlay:
        values |= _of_groups(load_profile(overlay).get(NODE, {}), str(overlay), strict=False)
    values |= {f"render.{name}": value for name, value in _shortcuts(arguments).items()}
    if arguments.size is not None:
        width, height = (whole_number(side) for side in arguments.size.partition("x")[::2])
        if width is None or height is None:
            raise UsageError(f"--size: expected WIDTHxHEIGHT, got {arguments.size:.100}")
        values |= {"camera.width": width, "camera.height": height}
    own = apply_overrides({NODE: {}}, [f"{NODE}.{text}" for text in arguments.parameters])[NODE]
    values |= _of_groups(own, "-p", strict=True)
    groups: list[Any] = [
        from_mapping(cls, {name.partition(".")[2]: value for name, value in values.items() if name.startswith(f"{group}.")}, group)
        for group, cls in GROUPS.items()
    ]
    return Settings(*groups)


def preset_settings(name: str, samples_per_pixel: int | None = None) -> dict[str, Any]:
    """Return the fields of ``RenderConfig`` that a preset sets, with another number of samples if one is given."""
    fields = load_profile(config_path(f"presets/{name}.yaml"))[NODE]
    settings = {key.removeprefix("render."): value for key, value in fields.items()}
    return settings if samples_per_pixel is None else settings | {"samples_per_pixel": samples_per_pixel}


def white_settings(text: str) -> dict[str, Any]:
    """Return the fields of ``RenderConfig`` for ``--white-balance``: a name or a colour temperature.

    Raises:
        UsageError: it is neither.
    """
    if text in ("auto", "none"):
        return {"white_balance": text}
    try:
        return {"white_balance": "kelvin", "white_balance_k": float(text)}
    except ValueError:
        raise UsageError(f"--white-balance: expected auto, none or a colour temperature in kelvin, got '{text}'") from None


def _shortcuts(arguments: argparse.Namespace) -> dict[str, Any]:
    """Return the fields of ``RenderConfig`` that have options of their own."""
    fields: dict[str, Any] = {}
    if arguments.exposure is not None:
        fields |= {"exposure_ev100": arguments.exposure, "auto_exposure": False}
    if arguments.white_balance is not None:
        fields |= white_settings(arguments.white_balance)
    if arguments.tone is not None:
        fields["tone_curve"] = arguments.tone
    if arguments.denoise is not None:
        fields["denoise"] = arguments.denoise
    return fields


def _of_groups(parameters: Mapping[str, Any], where: str, *, strict: bool) -> dict[str, Any]:
    """Return the parameters of ``GROUPS``; others are for the node alone, and refused where ``strict``."""
    chosen = {name: value for name, value in parameters.items() if name.partition(".")[0] in GROUPS}
    others = sorted(set(parameters) - set(chosen))
    if strict and others:
        raise ProfileError(f"{where} {others[0]}: expected a parameter of {', '.join(f'{group}.' for group in GROUPS)}")
    return chosen
