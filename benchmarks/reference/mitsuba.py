"""Mitsuba 3 as the other renderer: our scenes in its terms, rendered in a process of its own (extra ``bench-reference``).

Matt surfaces become ``diffuse``, clear glass ``roughdielectric`` at the roughness that we give smooth glass, panes ``thindielectric``, the
sky an ``envmap``.  For gloss, metal, coats and sheen no plugin of Mitsuba's has the same model, so :mod:`benchmarks.reference.bsdf` writes
ours in Mitsuba's terms.  Light, paths and their weights are Mitsuba's own throughout.
"""

import glob
import multiprocessing
import os
import tempfile
import time
from multiprocessing.connection import Connection
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from reference_scenes import View

from renderer import FlatScene, Sky
from renderer.bsdf.albedo import MIN_ALPHA
from renderer.core.color import linear_from_srgb
from renderer.core.kernel import from_python
from renderer.path import infinite_light
from renderer.scene.sky import sky_of
from scene_description.poses import world_from_optical

sky_le = from_python(infinite_light.sky_le)

VARIANT = "llvm_ad_rgb"
ROULETTE_FROM = 5
"""Mitsuba's default."""
_SKY_ROWS = 2048
_FINE = 8
_ZERO = np.float32(0.0)
_LIBRARIES = "/usr/lib/*/libLLVM*.so*"


class Rendered(NamedTuple):
    """An image (height, width, 3) float32 and what it took: seconds of processor and of clock."""

    image: NDArray[np.float32]
    cpu_s: float
    wall_s: float


class Mitsuba:
    """A process that renders with Mitsuba; a context manager that ends it.

    Raises:
        RuntimeError: Mitsuba cannot be used; one line.
    """

    def __init__(self, threads: int) -> None:
        if "DRJIT_LIBLLVM_PATH" not in os.environ:
            newest = sorted(path for path in glob.glob(_LIBRARIES) if ".so.19" in path or ".so.2" in path)
            os.environ.update({"DRJIT_LIBLLVM_PATH": newest[0]} if newest else {})
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs, threads), daemon=True)
        self._process.start()
        theirs.close()
        self.version: str = self._answer()

    def load(self, view: View, width: int, height: int, max_depth: int) -> None:
        """Translate a view; images of it follow."""
        self._pipe.send(("load", (view, width, height, max_depth)))
        self._answer()

    def render(self, samples: int, seed: int) -> Rendered:
        """Return an image of the loaded view."""
        self._pipe.send(("render", (samples, seed)))
        return Rendered(*self._answer())

    def _answer(self) -> Any:
        try:
            kind, value = self._pipe.recv()
        except EOFError:
            raise RuntimeError("Mitsuba: its process ended; see its message above, and docs/reference.md for LLVM's version") from None
        if kind == "error":
            raise RuntimeError(f"Mitsuba: {value}")
        return value

    def __enter__(self) -> "Mitsuba":
        """Return the process itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """End the process."""
        self._pipe.close()
        self._process.join(10.0)
        self._process.terminate()


def _serve(pipe: Connection, threads: int) -> None:
    """Answer requests until the other end closes."""
    try:
        import drjit
        import mitsuba

        mitsuba.set_variant(VARIANT)
        drjit.set_thread_count(threads)
        from benchmarks.reference.bsdf import register

        register()
    except Exception as error:
        pipe.send(("error", f"{error}; install scene_synth_ros[bench-reference]"))
        return
    pipe.send(("ready", mitsuba.__version__))
    scene, integrator = None, None
    while True:
        try:
            kind, arguments = pipe.recv()
        except EOFError:
            return
        try:
            if kind == "load":
                view, width, height, depth = arguments
                with tempfile.TemporaryDirectory() as folder:
                    scene = mitsuba.load_dict(translate(view, width, height, Path(folder)))
                extra = 0 if panes_are_holes(view.flat) else 1
                integrator = mitsuba.load_dict({"type": "path", "max_depth": depth + extra, "rr_depth": ROULETTE_FROM})
                pipe.send(("loaded", None))
            else:
                samples, seed = arguments
                cpu, wall = time.process_time(), time.perf_counter()
                image = np.array(mitsuba.render(scene, integrator=integrator, spp=samples, seed=seed), np.float32)
                pipe.send(("image", (image[:, :, :3], time.process_time() - cpu, time.perf_counter() - wall)))
        except Exception as error:
            pipe.send(("error", " ".join(str(error).split())))


def translate(view: View, width: int, height: int, folder: Path) -> dict[str, Any]:
    """Return a view as Mitsuba's scene dictionary; meshes are written into ``folder``.

    Panes that let everything through become holes.  Through other panes, paths get one more segment: what we see in a pane, Mitsuba's
    paths see behind it.

    Raises:
        ValueError: a part has what cannot be translated.
    """
    import mitsuba as mi

    flat = view.flat
    pose = world_from_optical(view.pose.position_m, view.pose.orientation)
    eye, ahead, up = pose[:3, 3], pose[:3, 2], -pose[:3, 1]
    scene: dict[str, Any] = {
        "type": "scene",
        "camera": {
            "type": "perspective",
            "fov": float(np.degrees(view.horizontal_fov_rad)),
            "fov_axis": "x",
            "near_clip": 1e-3,
            "to_world": mi.ScalarTransform4f().look_at(list(map(float, eye)), list(map(float, eye + ahead)), list(map(float, up))),
            "film": {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}, "component_format": "float32"},
            "sampler": {"type": "independent"},
        },
    }
    for part in range(len(flat.part_names)):
        path = folder / f"part{part:04d}.ply"
        if flat.parts.portal[part] and panes_are_holes(flat):
            continue
        if not _write_mesh(flat, part, path):
            continue
        shape = {"type": "ply", "filename": str(path), "face_normals": True, "bsdf": bsdf_of(flat, part)}
        emission = [float(c) for c in flat.parts.emission[part]]
        if any(emission):
            shape["emitter"] = {"type": "area", "radiance": {"type": "rgb", "value": emission}}
        scene[path.stem] = shape
    sky = sky_of(flat)
    if any(item.any() for item in sky):
        upright = mi.ScalarTransform4f().rotate([1, 0, 0], 90)
        scene["sky"] = {"type": "envmap", "bitmap": mi.Bitmap(sky_image(sky)), "to_world": upright}
    return scene


def panes_are_holes(flat: FlatScene) -> bool:
    """Return whether all panes let everything through, unbent."""
    rows = flat.parts.material[flat.parts.portal]
    return bool((flat.materials.ior[rows] == 1.0).all() and (flat.materials.transmission[rows] == 1.0).all())


def _write_mesh(flat: FlatScene, part: int, path: Path) -> bool:
    """Write the triangles of a part; return whether there are any."""
    import mitsuba as mi

    faces = flat.mesh.faces[flat.face_part == part]
    used, index = np.unique(faces, return_inverse=True)
    texture = _texture_of(flat, part)
    mesh = mi.Mesh(path.stem, len(used), len(faces), has_vertex_texcoords=texture >= 0)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = flat.mesh.vertices[used].ravel()
    parameters["faces"] = index.reshape(-1).astype(np.uint32)
    if texture >= 0:
        applied = flat.textures[texture]
        u, v = flat.mesh.uvs[used].astype(np.float64).T
        turn, lean = np.cos(applied.rotation_rad), np.sin(applied.rotation_rad)
        placed = np.stack([(turn * u + lean * v) / applied.size[0], (turn * v - lean * u) / applied.size[1]], axis=1)
        parameters["vertex_texcoords"] = placed.astype(np.float32).ravel()
    parameters.update()
    mesh.write_ply(str(path))
    return len(faces) > 0


def _texture_of(flat: FlatScene, part: int) -> int:
    return int(flat.part_texture[part]) if len(flat.part_texture) else -1


def bsdf_of(flat: FlatScene, part: int) -> dict[str, Any]:
    """Return the plugin that scatters as a part does.

    Raises:
        ValueError: glass that is rough or coloured, cloth that lets light through, wear, or a texture that is no matt picture.
    """
    table, row, name = flat.materials, int(flat.parts.material[part]), flat.part_names[part]
    if table.diffuse_transmission[row] > 0.0 or (len(flat.wear.layers) and table.wear[row] > 0.0):
        raise ValueError(f"{name}: expected an opaque surface without wear, got thin cloth or wear; take another material")
    ior, base = float(table.ior[row]), [float(c) for c in table.base_color[row]]
    if len(flat.absorbs) and flat.absorbs[part]:
        return {"type": "diffuse", "reflectance": _rgb(0.0)}
    if flat.parts.portal[part]:
        through = _rgb(float(table.transmission[row]))
        return {"type": "thindielectric", "int_ior": ior, "ext_ior": 1.0, "specular_transmittance": through}
    if table.transmission[row] > 0.0:
        if table.transmission[row] < 1.0 or table.roughness[row] > 0.0 or base != [1.0, 1.0, 1.0]:
            raise ValueError(f"{name}: expected clear, smooth glass, got tinted or rough glass; take another material")
        return {"type": "roughdielectric", "distribution": "ggx", "alpha": MIN_ALPHA, "int_ior": ior, "ext_ior": 1.0}
    plain = ior == 1.0 and not (table.metallic[row] or table.clearcoat[row] or table.sheen[row])
    texture = _texture_of(flat, part)
    if texture >= 0:
        tile = flat.textures[texture].tile
        if not (plain and tile.picture and (tile.levels[0][..., 5:7] == tile.levels[0][0, 0, 5:7]).all()):
            raise ValueError(f"{name}: expected a flat picture on a matt surface, got gloss, relief or a pattern; take another texture")
        return _two_sided({"type": "diffuse", "reflectance": _bitmap(tile.levels[0][..., :3])})
    if plain:
        return _two_sided({"type": "diffuse", "reflectance": {"type": "rgb", "value": base}})
    names = ("roughness", "metallic", "clearcoat", "clearcoat_roughness", "sheen")
    numbers = {name: float(getattr(table, name)[row]) for name in names}
    return {"type": "layered", "red": base[0], "green": base[1], "blue": base[2], "ior": ior} | numbers


def _rgb(level: float) -> dict[str, Any]:
    return {"type": "rgb", "value": [level] * 3}


def _two_sided(bsdf: dict[str, Any]) -> dict[str, Any]:
    return {"type": "twosided", "bsdf": bsdf}


def _bitmap(texels: NDArray[np.uint8]) -> dict[str, Any]:
    """Return a repeating texture of sRGB texels whose first row lies at v = 0, as luminance."""
    import mitsuba as mi

    linear = linear_from_srgb(texels.astype(np.float64) / 255.0).astype(np.float32)
    return {"type": "bitmap", "bitmap": mi.Bitmap(np.ascontiguousarray(linear)), "raw": True, "wrap_mode": "repeat"}


def sky_image(sky: Sky) -> NDArray[np.float32]:
    """Return sky and sun as the panorama (rows, 2 * rows, 3) of ``envmap``, zenith uppermost; texels at the sun's edge hold their mean.

    Raises:
        ValueError: the environment has bright parts that are sampled by direction, other than the sun.
    """
    if sky.bright.size:
        raise ValueError("sky: expected a smooth sky and a sun, got bright parts of an environment map; take another sky")
    if sky.table.size:
        image = _resampled(sky.table)
    else:
        height = np.cos(np.pi * np.arange(_SKY_ROWS) / (_SKY_ROWS - 1)).astype(np.float32)
        rows = np.array([sky_le(sky, _ZERO, _ZERO, z) for z in height], np.float32)
        image = np.repeat(rows[:, None, :], 2 * _SKY_ROWS, axis=1)
    if len(sky.sun):
        _add_sun(sky, image)
    return image


def _resampled(table: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return our map of the sky, bilinear between the middles of its pixels, at the texels of Mitsuba's panorama.

    Its columns go the other way round from +y, ours from -x; its first and last rows are the poles.
    """
    height, width = table.shape[:2]
    down = np.clip(np.arange(_SKY_ROWS) / (_SKY_ROWS - 1) * height - 0.5, 0.0, height - 1.0)
    turn = (np.arange(2 * _SKY_ROWS) + 0.5) / (2 * _SKY_ROWS)
    across = ((0.25 + turn) % 1.0) * width - 0.5
    i, j = np.floor(down).astype(int), np.floor(across).astype(int)
    t, s = (down - i)[:, None, None].astype(np.float32), (across - j)[None, :, None].astype(np.float32)
    upper, lower = table[i], table[np.minimum(i + 1, height - 1)]
    rows = upper + t * (lower - upper)
    left, right = rows[:, j % width], rows[:, (j + 1) % width]
    return np.ascontiguousarray(left + s * (right - left), np.float32)


def _add_sun(sky: Sky, image: NDArray[np.float32]) -> None:
    """Add the sun's disc, each texel the mean over itself of a fine grid; the whole has exactly the sun's illuminance."""
    sun = sky.sun.astype(np.float64)
    radius = np.arccos(1.0 - sun[3])
    rows, columns = image.shape[:2]
    middle_row = np.arccos(sun[2]) / np.pi * (rows - 1)
    middle_column = (np.arctan2(sun[0], sun[1]) / (2.0 * np.pi) % 1.0) * columns - 0.5
    reach = 2.0 + radius / np.pi * rows
    wide = 2.0 + reach / np.hypot(sun[0], sun[1])
    i = np.arange(int(middle_row - reach), int(middle_row + reach) + 1)
    j = np.arange(int(middle_column - wide), int(middle_column + wide) + 1)
    fine = (np.arange(_FINE) + 0.5) / _FINE - 0.5
    tilt = np.pi * (i[:, None] + fine).ravel() / (rows - 1)
    turn = 2.0 * np.pi * ((j[:, None] + fine).ravel() + 0.5) / columns
    x, y = np.sin(tilt)[:, None] * np.sin(turn), np.sin(tilt)[:, None] * np.cos(turn)
    apart = ((x - sun[0]) ** 2 + (y - sun[1]) ** 2 + ((np.cos(tilt) - sun[2]) ** 2)[:, None]) / (2.0 * sun[3])
    limb = 1.0 - 0.6 * (1.0 - np.sqrt(np.maximum(1.0 - apart, 0.0)))
    disc = np.where(apart < 1.0, limb, 0.0).reshape(len(i), _FINE, len(j), _FINE).mean(axis=(1, 3))
    texel_sr = np.sin(np.pi * i / (rows - 1))[:, None] * (np.pi / (rows - 1)) * (2.0 * np.pi / columns)
    disc *= 2.0 * np.pi * sun[3] / (disc * texel_sr).sum()
    image[i[:, None], j % columns] += (disc[..., None] * sun[4:7]).astype(np.float32)
