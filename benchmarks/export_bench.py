"""A room as ``scene_synth export`` writes it, rendered by Mitsuba, beside ours: the light of its lamps, region by region.

python -m benchmarks.export_bench [--rooms TYPE:SEED ...] [--samples N] [--pictures DIR] [--json FILE]

Needs the extra ``bench-reference``.  Rooms are at night and matt: glTF has other materials than ours.  Mitsuba takes the file as a renderer
that traces rays to glowing surfaces should (docs/export.md): parts with a luminance shine and reflect nothing, and the punctual lights are
those of all other lamps.
"""

import argparse
import json
import math
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from benchmarks.table import Row, at_most, render_table
from grammar import SceneRequest
from grammar.synthesize import CameraTimes, SceneSynthesizer
from renderer import CameraConfig, RenderConfig, Renderer
from renderer.core.color import LUMINANCE
from renderer.export.materials import LUMINAIRE
from renderer.export.scene_glb import scene_to_glb
from renderer.files.image_io import write_png
from renderer.film.tone import Exposure, to_display
from renderer.scene.flatten import flatten
from scene_description import SceneDescription

VARIANT = "scalar_rgb"
"""The one that brings no LLVM into a process which has numba's."""
CAMERA = CameraConfig(width=160, height=120)
DEPTH = 6
LEAST_SHARE = 0.02
"""Of the picture that a region covers."""
_CONE_TEXELS = 512


def matt_at_night(scene: SceneDescription) -> SceneDescription:
    """Return a room with Lambert's materials, without daylight, all its lamps on."""
    plain = {"ior": 1.0, "roughness": 1.0} | dict.fromkeys(
        ("metallic", "transmission", "diffuse_transmission", "clearcoat", "sheen", "glow_cd_m2", "wear"), 0.0
    )
    dark = (0.0, 0.0, 0.0)
    return replace(
        scene,
        materials=tuple(replace(item, texture=None, images=None, **plain) for item in scene.materials),
        environment=replace(scene.environment, zenith=dark, horizon=dark, ground=dark, daylight=None, map=None),
        lights=tuple(replace(light, on=True) for light in scene.lights),
        luminaires=tuple(replace(light, on=True) for light in scene.luminaires),
    )


def mitsuba_scene(path: Path, folder: Path) -> dict[str, Any]:
    """Return a GLB file of ours as Mitsuba's scene dictionary; trimesh reads meshes and nodes, their files are written into ``folder``."""
    import mitsuba as mi

    data = path.read_bytes()
    tree = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    loaded = trimesh.load_scene(path)
    scene: dict[str, Any] = {"type": "scene"}
    places, glowing = _places(tree), set()
    for index, node in enumerate(tree["nodes"]):
        place = mi.ScalarTransform4f(places[index])
        if "mesh" in node:
            look = tree["materials"][tree["meshes"][node["mesh"]]["primitives"][0]["material"]]
            luminance = _luminance(look)
            if look["name"] == LUMINAIRE:
                continue
            file = folder / f"{index}.ply"
            loaded.geometry[loaded.graph[node["name"]][1]].export(file)
            black = any(luminance) or node["extras"]["part"] == "pane"
            color = [0.0] * 3 if black else look["pbrMetallicRoughness"]["baseColorFactor"][:3]
            matt = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": color}}}
            scene[f"part{index}"] = {"type": "ply", "filename": str(file), "face_normals": True, "to_world": place, "bsdf": matt}
            if any(luminance):
                scene[f"part{index}"]["emitter"] = {"type": "area", "radiance": {"type": "rgb", "value": luminance}}
                glowing.add(node["name"])
        elif "extensions" in node and node["name"].removesuffix("/light") not in glowing:
            light = tree["extensions"]["KHR_lights_punctual"]["lights"][node["extensions"]["KHR_lights_punctual"]["light"]]
            scene[f"light{index}"] = _emitter(light, places[index])
        elif "camera" in node:
            lens = tree["cameras"][node["camera"]]["perspective"]
            scene["camera"] = {
                "type": "perspective",
                "fov": math.degrees(lens["yfov"]),
                "fov_axis": "y",
                "near_clip": 1e-3,
                "to_world": place @ mi.ScalarTransform4f().rotate([0, 1, 0], 180),
                "film": {"type": "hdrfilm", "width": CAMERA.width, "height": CAMERA.height, "rfilter": {"type": "box"}},
            }
    return scene


def _luminance(look: dict[str, Any]) -> list[float]:
    """Return the luminance of a glTF material, cd/m2; 0 where it has no strength."""
    strength = look.get("extensions", {}).get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 0.0)
    return [strength * item for item in look.get("emissiveFactor", (0.0, 0.0, 0.0))]


def _places(tree: dict[str, Any]) -> list[NDArray[np.float64]]:
    """Return where every node of a glTF tree is, (4, 4) each; parents come before their children."""
    places = [np.eye(4) for _ in tree["nodes"]]
    for index, node in enumerate(tree["nodes"]):
        x, y, z, w = node.get("rotation", (0.0, 0.0, 0.0, 1.0))
        local = trimesh.transformations.quaternion_matrix([w, x, y, z])
        local[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
        places[index] = places[index] @ local
        for child in node.get("children", ()):
            places[child] = places[index]
    return places


def _emitter(light: dict[str, Any], place: NDArray[np.float64]) -> dict[str, Any]:
    """Return a light of KHR_lights_punctual as an emitter; the falloff of a spot is a texture that it projects."""
    import mitsuba as mi

    intensity = {"type": "rgb", "value": [light["intensity"] * item for item in light["color"]]}
    if light["type"] == "point":
        return {"type": "point", "position": place[:3, 3].tolist(), "intensity": intensity}
    inner, outer = (math.cos(light["spot"][name]) for name in ("innerConeAngle", "outerConeAngle"))
    edge = (2.0 * np.arange(_CONE_TEXELS) + 1.0) / _CONE_TEXELS - 1.0
    off_axis = math.tan(light["spot"]["outerConeAngle"]) * np.hypot(edge, edge[:, None])
    falloff = np.clip((1.0 / np.hypot(1.0, off_axis) - outer) / (inner - outer), 0.0, 1.0) ** 2
    bitmap = mi.Bitmap(np.repeat(falloff[:, :, None], 3, axis=2).astype(np.float32))
    cutoff = math.degrees(light["spot"]["outerConeAngle"])
    return {
        "type": "spot",
        "to_world": mi.ScalarTransform4f(place) @ mi.ScalarTransform4f().rotate([0, 1, 0], 180),
        "intensity": intensity,
        "cutoff_angle": cutoff,
        "beam_width": cutoff * (1.0 - 1e-4),
        "texture": {"type": "bitmap", "bitmap": bitmap, "raw": True},
    }


def compare(room_type: str, seed: int, samples: int, pictures: Path | None) -> list[Row]:
    """Export a room, render it by both, and return how much each region differs."""
    import mitsuba as mi

    times = CameraTimes(frames=2, start_ns=0, rate_hz=1.0)
    scene = matt_at_night(SceneSynthesizer.from_config().synthesize(SceneRequest(room_type=room_type), seed, 0, times))
    flat = flatten(scene)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "room.glb"
        path.write_bytes(scene_to_glb(scene, flat, CAMERA))
        loaded = mi.load_dict(mitsuba_scene(path, Path(folder)))
        theirs = np.array(mi.render(loaded, integrator=mi.load_dict({"type": "path", "max_depth": DEPTH}), spp=samples, seed=1))[..., :3]
    with Renderer(flat, CAMERA, RenderConfig(samples_per_pixel=samples, max_depth=DEPTH, threads=1), 1) as renderer:
        layers = renderer.render(scene.camera_path[0], 0, ("radiance", "part", "instance", "emission")).layers
    ours, unlit = layers["radiance"], ~layers["emission"].any(axis=2)
    if pictures is not None:
        pictures.mkdir(parents=True, exist_ok=True)
        shown = [to_display(np.ascontiguousarray(image, np.float32), Exposure(7.0)) for image in (ours, theirs)]
        write_png(pictures / f"export_{room_type}_{seed}.png", np.concatenate(shown, axis=1))
    region = layers["instance"].astype(np.int64) * 65_536 + np.where(layers["instance"] == 0, layers["part"], 0)
    worst, count = 0.0, 0
    for number in np.unique(region[unlit]):
        inside = unlit & (region == number)
        if inside.mean() >= LEAST_SHARE:
            ratio = float((theirs[inside].mean(axis=0) @ LUMINANCE) / (ours[inside].mean(axis=0) @ LUMINANCE))
            worst, count = max(worst, abs(ratio - 1.0)), count + 1
    lamps, spots = len(scene.lights), len(scene.luminaires)
    whole = float((theirs[unlit].mean(axis=0) @ LUMINANCE) / (ours[unlit].mean(axis=0) @ LUMINANCE))
    name = f"{room_type} {seed}: {spots} spots, {lamps} lamps"
    return [
        Row(f"{name}, mean radiance, Mitsuba's over ours", whole, ""),
        at_most(f"{name}, worst of {count} regions", 100.0 * worst, "%", 3.0),
    ]


def main() -> None:
    """Compare the rooms and print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.export_bench")
    parser.add_argument("--rooms", nargs="+", default=["kitchen:2", "hallway:2"], metavar="TYPE:SEED")
    parser.add_argument("--samples", type=int, default=512, help="a pixel (default: %(default)s)")
    parser.add_argument("--pictures", type=Path, metavar="DIR", help="write ours and Mitsuba's side by side")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    arguments = parser.parse_args()
    import mitsuba as mi

    mi.set_variant(VARIANT)
    rows = []
    for room in arguments.rooms:
        room_type, _, seed = room.partition(":")
        rows += compare(room_type, int(seed), arguments.samples, arguments.pictures)
    print(render_table("Exported rooms in Mitsuba", rows))
    if arguments.json:
        arguments.json.write_text(json.dumps([row._asdict() for row in rows], indent=1))


if __name__ == "__main__":
    main()
