"""``scene_synth render``: the frames of a scene description as files, by the same core as the renderer node."""

import argparse
import json
import math
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from tqdm import tqdm

from renderer import LAYERS, Renderer, RenderError
from renderer.annotations import Annotator
from renderer.annotations.coco import CocoImage, coco_instances
from renderer.camera.rig import mounted_path, rig_path
from renderer.exposure import exposed, meter, needs_meter, sensor_ev100
from renderer.files.exr_files import is_installed
from renderer.film.layers import check_names, layers_in
from renderer.lidar.scanner import Scanner
from renderer.scene.flatten import flatten
from renderer.scene.scene_key import scene_key
from renderer.scene.semantic_classes import with_classes
from renderer.standpoint import standpoint
from scene_description import EnvironmentMap, SceneDescription, read_scene
from scene_description.annotations import annotations_to_json
from scene_description.label_standards import STANDARDS, StandardName
from scene_description.tum_trajectory import read_tum_trajectory, trajectory_to_tum
from scene_synth_ros.cli.files.frame_files import write_frame, write_scans
from scene_synth_ros.cli.options import UsageError, refuse_missing_folder
from scene_synth_ros.cli.parameters.render_settings import PRESETS, preset_settings, read_settings
from scene_synth_ros.cli.parameters.render_settings import add_arguments as add_settings

__all__ = ["PRESETS", "add_arguments", "preset_settings", "run"]

_COCO = "instances.json"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument("scene", type=Path, help="scene description, JSON")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="new folder for the images")
    parser.add_argument("--frames", type=int, help="render only the first N poses of the camera path")
    parser.add_argument("--trajectory", type=Path, metavar="FILE", help="camera path in TUM's form, in place of the scene's")
    add_settings(parser)
    parser.add_argument("--layers", default="", metavar="NAMES", help="write these layers too: names with commas between, or all")
    for option, summaries in _layer_options().items():
        parser.add_argument(f"--{option}", action="store_true", help=f"write {' and '.join(summaries)} too")
    parser.add_argument("--annotations", action="store_true", help="write boxes, key points and relations of the objects in each frame too")
    parser.add_argument("--coco", action="store_true", help=f"write {_COCO} too, masks and boxes of all frames in COCO's form")
    parser.add_argument("--scan", action="store_true", help="write the laser scans of the path too: scans.npz, and the first as scan.png")
    parser.add_argument(
        "--exr", choices=("auto", "yes", "no"), default="auto", help="write EXR too, with linear colour; auto: where OpenEXR is installed"
    )
    parser.add_argument(
        "--semantic-classes",
        choices=STANDARDS,
        default="nyu40",
        help="standard of the class ids (default: %(default)s)",
    )
    parser.add_argument("--catalog", type=Path, metavar="DIR", help="folder of the user's models and environment maps")
    parser.add_argument("--environment", metavar="FILE", help="environment map .hdr or .exr below --catalog, in place of the scene's sky")
    parser.add_argument("--environment-yaw", type=float, default=0.0, metavar="DEG", help="turn of the map about z (default: %(default)s)")
    parser.add_argument(
        "--environment-scale", type=float, default=179.0, metavar="CD_M2", help="luminance of value 1 (default: %(default)s)"
    )


def run(arguments: argparse.Namespace) -> int:
    """Render; every frame becomes an NPZ with all layers, a PNG of each, and an EXR.

    ``trajectory.txt`` has the camera's poses, ``labels.json`` what ids mean.  Where they are asked for, every frame has its annotations as
    JSON, and all frames together one file in COCO's form.  With ``--scan``, or where an overlay enables the scanner, its scans along the
    whole path become ``scans.npz``.
    """
    refuse_missing_folder("--catalog", arguments.catalog)
    settings = read_settings(arguments)
    exr = arguments.exr == "yes" or (arguments.exr == "auto" and is_installed())
    if exr and not is_installed():
        raise RenderError("--exr yes: expected the library OpenEXR, got none installed; install scene_synth_ros[exr]")
    fixed_ev100 = sensor_ev100(settings.camera, settings.sensor)
    scene = _read_scene(arguments)
    poses = scene.camera_path[: arguments.frames]
    if not poses:
        raise UsageError(f"--frames: expected at least 1, got {arguments.frames}")
    standard: StandardName = arguments.semantic_classes
    flat, key = with_classes(flatten(scene, arguments.catalog), scene, standard), scene_key(scene)
    layers = _layers(arguments)
    path = mounted_path(settings.camera, scene.camera_path, scene.motion)
    told: list[CocoImage] = []
    with ExitStack() as room:
        renderer = room.enter_context(
            Renderer(flat, settings.camera, settings.render, key, sensor=settings.sensor, depth_sensor=settings.depth_sensor)
        )
        metered = None
        if needs_meter(settings.render):
            metered = meter(flat, settings.camera, settings.render, key, scene.camera_path, like=renderer)
        exposure = exposed(settings.render, metered, fixed_ev100)
        arguments.out.mkdir(parents=True)
        (arguments.out / "trajectory.txt").write_text(trajectory_to_tum(path[: len(poses)]), encoding="utf-8")
        (arguments.out / "labels.json").write_text(_labels(scene, layers, standard), encoding="utf-8")
        places = [standpoint(renderer.tree, flat, scene, pose.position_m) for pose in path[: len(poses)]]
        if any(places):
            sys.stderr.write(f"scene_synth render: warning: {_misplaced(places)}\n")
        annotator = None
        if arguments.annotations or arguments.coco:
            portable = settings.render.portable
            annotator = room.enter_context(
                Annotator(flat, scene, settings.camera, masks=arguments.coco, portable=portable, classes=standard)
            )
        if arguments.scan or settings.scan.enabled:
            write_scans(
                arguments.out,
                list(Scanner(renderer.tree, flat, settings.scan, key).along(rig_path(scene.camera_path, scene.motion))),
                settings.scan,
                scene,
            )
        for index, pose in enumerate(tqdm(path[: len(poses)], unit=" frames", disable=None, leave=False)):
            frame = renderer.render(pose, index, layers, exposure=exposure, path=path, annotator=annotator)
            base = arguments.out / f"frame_{index:04d}"
            write_frame(base, frame, exr=exr, standard=standard)
            if arguments.annotations and frame.annotations is not None:
                base.with_suffix(".json").write_text(annotations_to_json(frame.annotations), encoding="utf-8")
            if arguments.coco and frame.annotations is not None:
                told.append(CocoImage(f"{base.name}_color.png", frame.annotations))
    if arguments.coco:
        (arguments.out / _COCO).write_text(json.dumps(coco_instances(told, standard)), encoding="utf-8")
    return 0


def _layers(arguments: argparse.Namespace) -> list[str]:
    """Return the layers that are always written and those that the options ask for."""
    named = [name.strip() for name in arguments.layers.split(",") if name.strip()]
    named = list(LAYERS) if named == ["all"] else named
    check_names(named)
    asked = vars(arguments) | {"layers": False, "": True}
    return [name for name, row in LAYERS.items() if name in named or asked[row.option]]


def _labels(scene: SceneDescription, layers: Sequence[str], standard: StandardName) -> str:
    """Return what the ids of the layers mean, as JSON: layer -> id -> name, class and colour."""
    rows = layers_in(standard)
    tables = {name: rows[name].labels for name in layers}
    told = {name: table(scene) for name, table in tables.items() if table is not None}
    return json.dumps({"standard": standard, "labels": told}, indent=1) + "\n"


def _layer_options() -> dict[str, list[str]]:
    """Return option -> what the layers are that it asks for."""
    options: dict[str, list[str]] = {}
    for row in LAYERS.values():
        if row.option not in ("", "layers"):
            options.setdefault(row.option, []).append(row.summary)
    return options


def _read_scene(arguments: argparse.Namespace) -> SceneDescription:
    """Return the scene, with the path and the environment that the options ask for."""
    scene = read_scene(arguments.scene)
    if arguments.trajectory is not None:
        scene = replace(scene, camera_path=read_tum_trajectory(arguments.trajectory, UsageError), motion=None)
    if arguments.environment is not None:
        picture = EnvironmentMap(
            file=arguments.environment,
            yaw_rad=math.radians(arguments.environment_yaw),
            luminance_scale=arguments.environment_scale,
        )
        scene = replace(scene, environment=replace(scene.environment, map=picture))
    return scene


def _misplaced(places: Sequence[str]) -> str:
    """Return one line about the frames that are not seen from within the room; ``places``: where each camera is, empty if it is there."""
    odd = [index for index, place in enumerate(places) if place]
    more = f", and {len(odd) - 1} more of {len(places)} frames from outside the room or inside something" if len(odd) > 1 else ""
    return f"frame {odd[0]} is seen from {places[odd[0]]}{more}"
