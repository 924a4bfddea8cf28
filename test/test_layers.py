"""Imports point one way, between packages and between the folders in them; some libraries have one door each."""

import ast
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
ALLOWED = {
    "kernel_cache": {"kernel_cache", "numba", "numpy"},
    "scene_description": {"scene_description", "numpy", "yaml"},
    "grammar": {"grammar", "kernel_cache", "scene_description", "numpy", "scipy", "numba", "shapely"},
    "renderer": {"renderer", "kernel_cache", "scene_description", "numpy", "numba", "llvmlite", "trimesh", "PIL", "pyoidn", "OpenEXR"},
    "evaluation": {"evaluation", "kernel_cache", "scene_description", "numpy", "scipy", "numba", "pycocotools"},
}
ONLY_IN = {
    "yaml": {"scene_description/yaml_text.py"},
    "trimesh": {"renderer/files/trimesh_files.py", "scene_synth_ros/prove/room_mesh.py"},
    "llvmlite": {"renderer/core/embree.py", "renderer/core/packing.py", "renderer/core/tiles.py"},
    "PIL": {"renderer/files/image_io.py"},
    "pyoidn": {"renderer/film/denoise.py"},
    "OpenEXR": {"renderer/files/exr_files.py"},
    "pycocotools": {"evaluation/metrics/coco_matching.py"},
}
FOLDERS = {
    "grammar": {
        "spec": set(),
        "drawing": set(),
        "geometry": {"spec"},
        "appearance": {"spec"},
        "derivation": {"geometry", "spec"},
        "camera": {"geometry", "spec"},
        "layout": {"derivation", "geometry", "spec"},
        "checks": {"derivation", "geometry", "layout", "spec"},
        "small_things": {"checks", "derivation", "geometry", "spec"},
    },
    "renderer": {
        "core": set(),
        "geometry": {"core"},
        "models": {"core", "geometry"},
        "textures": {"core", "geometry"},
        "bsdf": {"core"},
        "camera": {"core"},
        "film": {"core"},
        "annotations": {"camera", "core", "scene"},
        "files": {"core", "geometry", "models", "textures"},
        "surroundings": {"core"},
        "scene": {"core", "files", "geometry", "models", "surroundings", "textures"},
        "lidar": {"camera", "core", "scene"},
        "body": {"core", "geometry"},
        "path": {"bsdf", "camera", "core", "scene", "textures"},
        "sensors": {"camera", "core", "path"},
        "ground_truth": {"camera", "core", "path", "scene"},
        "irradiance_cache": {"bsdf", "core", "geometry", "ground_truth", "path", "scene"},
        "cached_frames": {"bsdf", "camera", "core", "ground_truth", "irradiance_cache", "path", "scene"},
        "export": {"camera", "core", "files", "geometry", "scene", "textures"},
    },
    "evaluation": {
        "core": set(),
        "metrics": {"core"},
    },
    "scene_synth_ros": {
        "mcap": set(),
        "messages": set(),
        "suite": {"messages"},
        "workers": {"suite"},
        "bags": {"mcap", "messages"},
        "dataset": {"bags", "mcap", "messages"},
        "simulation": {"messages", "suite"},
        "synthesize": {"messages", "simulation", "suite"},
        "render": {"messages", "suite"},
        "record": {"bags", "messages", "suite"},
        "replay": {"bags", "messages", "suite"},
        "evaluate": {"dataset", "bags", "messages", "suite", "sweep"},
        "pages": set(),
        "report": {"bags", "mcap", "messages", "pages", "sweep"},
        "verify": {"bags", "messages", "render"},
        "offline": {"bags", "synthesize", "messages", "record", "render", "suite"},
        "sweep": {"bags", "offline", "render", "suite", "workers"},
        "shards": {"bags", "mcap", "offline", "suite", "workers"},
        "cluster": {"bags", "shards", "suite", "workers"},
        "estimate": {"synthesize", "mcap", "messages", "offline", "workers"},
        "convert": {"dataset", "messages"},
        "prove": {"bags", "dataset", "messages"},
        "splits": {"bags", "dataset"},
        "testing": {"bags", "cli", "messages", "suite", "sweep"},
        "cli": {
            "bags",
            "cluster",
            "convert",
            "dataset",
            "estimate",
            "evaluate",
            "synthesize",
            "mcap",
            "messages",
            "offline",
            "pages",
            "prove",
            "render",
            "record",
            "replay",
            "report",
            "shards",
            "splits",
            "suite",
            "sweep",
            "verify",
            "workers",
        },
    },
}
"""Package -> folder -> folders of the package that it may import.  Modules beside the folders are the package's entry points."""
ABOVE_ENTRY_POINTS = {"grammar/counterfactual", "grammar/learning"}
"""Folders that build on their package's entry points."""


def imported_roots(path: Path) -> set[str]:
    roots = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            roots |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            roots.add(node.module.split(".")[0])
    return roots - sys.stdlib_module_names


@pytest.mark.parametrize("package", ALLOWED)
def test_imports_point_one_way(package: str) -> None:
    files = sorted((ROOT / package).rglob("*.py"))
    assert files
    for path in files:
        name = path.relative_to(ROOT).as_posix()
        roots = imported_roots(path)
        assert roots <= ALLOWED[package], f"{name} imports {sorted(roots - ALLOWED[package])}"
        for library, doors in ONLY_IN.items():
            assert library not in roots or name in doors, f"{name} imports {library}, which only {sorted(doors)} may"


def test_what_makes_shards_does_not_judge_so_their_provenance_need_not_count_evaluation() -> None:
    folders, makers = FOLDERS["scene_synth_ros"], {"shards"}
    while above := {name for maker in makers for name in folders[maker]} - makers:
        makers |= above
    files = [path for maker in makers for path in (ROOT / "scene_synth_ros" / maker).rglob("*.py")]
    assert "offline" in makers and not [path for path in files if "evaluation" in imported_roots(path)]


def test_one_module_knows_yaml() -> None:
    for path in sorted((ROOT / "scene_synth_ros").rglob("*.py")):
        assert "yaml" not in imported_roots(path), f"{path.relative_to(ROOT)} imports yaml, which only {sorted(ONLY_IN['yaml'])} may"


@pytest.mark.parametrize(
    ("module", "without"),
    [
        ("scene_description", {"numba", "yaml"}),
        ("scene_synth_ros.cli.command_line", {"numpy"}),
        ("scene_synth_ros.cli.commands.run_command", {"numba", "rclpy", "scipy"}),
        ("scene_synth_ros.record.recorder_node", {"numba", "scipy"}),
        ("scene_synth_ros.replay.replay_node", {"numba", "scipy"}),
        ("scene_synth_ros.render.renderer_node", {"scipy.ndimage"}),
        ("scene_synth_ros.synthesize.grammar_node", {"PIL"}),
        ("scene_synth_ros.cli.commands.inspect_command", {"numba", "scipy"}),
        ("scene_synth_ros.messages.streams", {"numba", "rclpy", "numpy", "renderer"}),
    ],
)
def test_what_needs_no_kernels_starts_without_their_compiler(module: str, without: set[str]) -> None:
    """A run of the suite starts four processes, a command line one: what they load is most of what a short one takes."""
    say = f"import sys, {module}; print(*{without} & sys.modules.keys())"
    assert subprocess.run([sys.executable, "-c", say], cwd=ROOT, check=True, capture_output=True, text=True).stdout == "\n"


@pytest.mark.parametrize("package", ["grammar", "renderer"])
def test_packages_hand_out_every_name_that_they_list(package: str) -> None:
    module = import_module(package)
    for name in module.__all__:
        assert hasattr(module, name), f"{package}/__init__.py does not say where {name} is"
        assert not (ROOT / package / f"{name}.py").exists(), f"{package}/{name}.py, once imported, stands for the name"
    assert not hasattr(module, "nothing")


def imported_modules(path: Path, package: str) -> set[str]:
    """Return the parts after the package's name of what a file imports from its own package, modules and names alike."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == package:
            found |= {f"{node.module}.{alias.name}".split(".", 1)[1] for alias in node.names}
        elif isinstance(node, ast.Import):
            found |= {alias.name.split(".", 1)[1] for alias in node.names if alias.name.startswith(f"{package}.")}
    return found


@pytest.mark.parametrize(("package", "folder"), [(package, folder) for package, folders in FOLDERS.items() for folder in folders])
def test_folders_import_what_lies_below_them(package: str, folder: str) -> None:
    files = sorted((ROOT / package / folder).rglob("*.py"))
    assert files
    allowed = FOLDERS[package][folder] | {folder}
    for path in files:
        used = {module.split(".")[0] for module in imported_modules(path, package)}
        assert used <= allowed, f"{path.relative_to(ROOT)} imports {sorted(used - allowed)} of {package}"


@pytest.mark.parametrize("package", FOLDERS)
def test_arrows_between_folders_make_no_circle(package: str) -> None:
    left = dict(FOLDERS[package])
    while left:
        done = [folder for folder, below in left.items() if not below & left.keys()]
        assert done, f"{package}: a circle among {sorted(left)}"
        for folder in done:
            del left[folder]


@pytest.mark.parametrize("package", FOLDERS)
def test_every_folder_is_in_the_table(package: str) -> None:
    folders = {path.parent.name for path in (ROOT / package).glob("*/__init__.py")}
    above = {name.split("/")[1] for name in ABOVE_ENTRY_POINTS if name.startswith(f"{package}/")}
    assert folders == FOLDERS[package].keys() | above
