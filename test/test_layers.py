"""Imports point one way: scene_description <- grammar, renderer <- scene_synth_ros; some libraries have one door each."""

import ast
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
ALLOWED = {
    "scene_description": {"scene_description", "numpy"},
    "grammar": {"grammar", "scene_description", "numpy", "scipy", "numba", "yaml"},
    "renderer": {"renderer", "scene_description", "numpy", "numba", "llvmlite", "trimesh", "PIL", "pyoidn", "OpenEXR"},
}
ONLY_IN = {
    "yaml": {"grammar/grammar_file.py"},
    "trimesh": {"renderer/trimesh_files.py"},
    "llvmlite": {"renderer/embree.py", "renderer/packing.py"},
    "PIL": {"renderer/image_io.py"},
    "pyoidn": {"renderer/denoise.py"},
    "OpenEXR": {"renderer/exr_files.py"},
}


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
