"""``scene_synth export``: a scene description as a file for other programs."""

import argparse
import sys
from pathlib import Path

from renderer.camera.config import CameraConfig
from renderer.export.scene_glb import scene_to_glb
from renderer.export.sdf import scene_to_sdf
from renderer.scene.flatten import flatten
from scene_description import read_scene
from scene_description.whole import write_whole
from scene_synth_ros.cli.options import UsageError, add_catalog, refuse_missing_folder


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument("scene", type=Path, help="scene description, JSON")
    parser.add_argument("out", type=Path, help="file to write: OUT.glb, or OUT.sdf with the folder OUT_meshes beside it")
    add_catalog(parser)
    parser.add_argument("--force", action="store_true", help="replace files that exist")


def run(arguments: argparse.Namespace) -> int:
    """Export."""
    refuse_missing_folder("--catalog", arguments.catalog)
    out: Path = arguments.out
    kind = out.suffix.lower()
    if kind not in (".glb", ".sdf"):
        raise UsageError(f"{out}: expected a file name that ends in .glb or .sdf")
    meshes = out.with_name(f"{out.stem}_meshes")
    for path in (out, meshes) if kind == ".sdf" else (out,):
        if path.exists() and not arguments.force:
            raise UsageError(f"{path}: exists already; choose another name or say --force")
    scene = read_scene(arguments.scene)
    flat = flatten(scene, arguments.catalog)
    if kind == ".sdf":
        world = scene_to_sdf(scene, flat, meshes.name)
        meshes.mkdir(parents=True, exist_ok=True)
        for name, mesh in world.meshes.items():
            write_whole(meshes / name, mesh)
        data, size = world.xml, len(world.xml) + sum(map(len, world.meshes.values()))
    else:
        data = scene_to_glb(scene, flat, CameraConfig())
        size = len(data)
    write_whole(out, data)
    sys.stdout.write(f"{out}: {len(scene.objects)} objects, {len(flat.part_names)} parts, {len(flat.mesh.faces)} triangles, {size} bytes\n")
    return 0
