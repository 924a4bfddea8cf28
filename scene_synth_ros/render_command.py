"""``scene_synth render``: the frames of a scene description as files, by the same core as the renderer node."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np

from renderer import CameraConfig, Frame, RenderConfig, Renderer
from renderer.exposure import exposed, meter, needs_meter
from renderer.false_color import depth_to_color, ids_to_color, normals_to_color
from renderer.flatten import flatten
from renderer.frame import LAYERS
from renderer.image_io import write_png
from renderer.scene_key import scene_key
from renderer.tone import TONE_CURVES, encode_srgb
from scene_description import from_mapping, scene_from_json
from scene_description.labels import instance_palette, label_palette
from scene_description.share import config_path
from scene_synth_ros.run_profile import load_profile

FAR_M = 6.0
PRESETS = ("stream", "balanced", "photo")
"""Named settings of the renderer, ``config/presets/<name>.yaml``; also overlays of run profiles."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument("scene", type=Path, help="scene description, JSON")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="new folder for the images")
    parser.add_argument("--frames", type=int, help="render only the first N poses of the camera path")
    parser.add_argument("--preset", choices=PRESETS, default="balanced", help="how colour is computed (default: %(default)s)")
    parser.add_argument("--spp", type=int, help="colour samples per pixel (default: the preset's)")
    parser.add_argument("--threads", type=int, default=0, help="threads; 0 takes all (default: %(default)s)")
    parser.add_argument("--exposure", type=float, metavar="EV100", help="exposure value (default: metered)")
    parser.add_argument("--white-balance", metavar="auto|none|KELVIN", default="auto", help="light that looks white (default: %(default)s)")
    parser.add_argument("--tone", choices=TONE_CURVES, help="display curve (default: the preset's)")
    parser.add_argument("--denoise", choices=("none", "auto", "oidn"), help="denoiser of the colour (default: the preset's)")
    parser.add_argument("--noisy", action="store_true", help="write the colour before denoising too")
    parser.add_argument("--albedo", action="store_true", help="write the base colour of what is seen too")
    parser.add_argument("--size", default="640x480", metavar="WxH", help="image size (default: %(default)s)")
    parser.add_argument("--catalog", type=Path, metavar="DIR", help="folder of the user's models")


def run(arguments: argparse.Namespace) -> int:
    """Render; every frame becomes one NPZ with all layers and a PNG of each."""
    width, _, height = arguments.size.partition("x")
    if not (width.isdigit() and height.isdigit()):
        raise ValueError(f"--size: expected WIDTHxHEIGHT, got {arguments.size}")
    camera = from_mapping(CameraConfig, {"width": int(width), "height": int(height)}, "--size")
    settings = preset_settings(arguments.preset, arguments.spp) | {"threads": arguments.threads}
    if arguments.denoise is not None:
        settings["denoise"] = arguments.denoise
    settings["auto_exposure"] = arguments.exposure is None
    if arguments.exposure is not None:
        settings["exposure_ev100"] = arguments.exposure
    settings |= white_settings(arguments.white_balance)
    if arguments.tone is not None:
        settings["tone_curve"] = arguments.tone
    config = from_mapping(RenderConfig, settings, "options")
    left_out = {name for name, asked in (("color_noisy", arguments.noisy), ("albedo", arguments.albedo)) if not asked}
    scene = scene_from_json(arguments.scene.read_text(encoding="utf-8"))
    flat = flatten(scene, arguments.catalog)
    arguments.out.mkdir(parents=True)
    poses = scene.camera_path[: arguments.frames]
    exposure = exposed(config, meter(flat, camera, config, scene_key(scene), scene.camera_path) if needs_meter(config) else None)
    with Renderer(flat, camera, config, scene_key(scene)) as renderer:
        for index, pose in enumerate(poses):
            write_frame(
                arguments.out / f"frame_{index:04d}",
                renderer.render(pose, index, set(LAYERS) - left_out, exposure=exposure, path=scene.camera_path),
            )
            sys.stderr.write(f"\rframe {index + 1}/{len(poses)}")
    sys.stderr.write("\n")
    return 0


def preset_settings(name: str, samples_per_pixel: int | None = None) -> dict[str, Any]:
    """Return the fields of ``RenderConfig`` that a preset sets, with another number of samples if one is given."""
    fields = load_profile(config_path(f"presets/{name}.yaml"))["renderer_node"]
    settings = {key.removeprefix("render."): value for key, value in fields.items()}
    return settings if samples_per_pixel is None else settings | {"samples_per_pixel": samples_per_pixel}


def white_settings(text: str) -> dict[str, Any]:
    """Return the fields of ``RenderConfig`` for ``--white-balance``: a name or a colour temperature.

    Raises:
        ValueError: it is neither.
    """
    if text in ("auto", "none"):
        return {"white_balance": text}
    try:
        return {"white_balance": "kelvin", "white_balance_k": float(text)}
    except ValueError:
        raise ValueError(f"--white-balance: expected auto, none or a colour temperature in kelvin, got '{text}'") from None


def write_frame(base: Path, frame: Frame) -> None:
    """Write ``<base>.npz`` with every layer as it is, and ``<base>_<layer>.png`` for people."""
    np.savez_compressed(base.with_suffix(".npz"), **frame.layers)
    layers = frame.layers
    pictures = {
        "color": layers["color"],
        **{name: layers[name] for name in ("color_noisy",) if name in layers},
        **{name: encode_srgb(layers[name]) for name in ("albedo",) if name in layers},
        "depth": depth_to_color(layers["depth"], FAR_M),
        "range": depth_to_color(layers["range"], FAR_M),
        "normals": normals_to_color(layers["normals"]),
        "semantic": ids_to_color(layers["semantic"], label_palette()),
        "instance": ids_to_color(layers["instance"], instance_palette(int(layers["instance"].max()) + 1)),
    }
    for name, picture in pictures.items():
        write_png(base.with_name(f"{base.name}_{name}.png"), picture)
