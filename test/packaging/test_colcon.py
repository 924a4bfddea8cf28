"""The repository as an ament_python package: colcon builds it, and what it installed runs from there."""

import ast
import os
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).resolve().parents[2]
NODES = ("grammar_node", "renderer_node", "recorder_node", "evaluator_node", "replay_node")


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("colcon")
    words = [
        sys.executable,
        "-m",
        "colcon",
        "--log-base",
        "log",
        "build",
        "--base-paths",
        ROOT,
        "--build-base",
        "build",
        "--install-base",
        "install",
    ]
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    process = subprocess.run(list(map(str, words)), cwd=folder, env=environment, capture_output=True, text=True, timeout=300, check=False)
    assert process.returncode == 0, process.stdout + process.stderr
    return folder / "install" / "scene_synth_ros"


def run_in(installed: Path, *words: str) -> subprocess.CompletedProcess[str]:
    (site,) = installed.glob("lib/python3*/site-packages")
    environment = {**os.environ, "PYTHONPATH": str(site), "ROS_DOMAIN_ID": "99"}
    return subprocess.run([sys.executable, *words], cwd="/", env=environment, capture_output=True, text=True, timeout=300, check=False)


def test_nodes_share_files_and_index_are_where_ros_looks(installed: Path) -> None:
    for node in (*NODES, "scene_synth"):
        script = installed / "lib" / "scene_synth_ros" / node
        assert os.access(script, os.X_OK)
        assert script.read_text().startswith("#!/usr/bin/env python3\n"), "the Python of the virtual environment that is active"
    share = installed / "share"
    assert (share / "ament_index" / "resource_index" / "packages" / "scene_synth_ros").is_file()
    for name in (
        "package.xml",
        "launch/synth.launch.py",
        "config/runs/main.yaml",
        "config/grammars/bedroom.yaml",
        "config/views/synth.rviz",
    ):
        assert (share / "scene_synth_ros" / name).is_file()


def test_the_installed_copy_finds_its_own_configuration(installed: Path) -> None:
    code = "from scene_description.share import config_path; import grammar; print(config_path('categories.yaml'), grammar.__file__)"
    process = run_in(installed, "-c", code)
    assert process.returncode == 0, process.stderr
    config, module = process.stdout.split()
    assert Path(config) == installed / "share" / "scene_synth_ros" / "config" / "categories.yaml"
    assert Path(module).is_relative_to(installed)


def test_shipped_files_go_by_their_names_in_the_installed_copy(installed: Path, tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_text("extends: bedroom.yaml\n", encoding="utf-8")
    code = (
        "import sys; from pathlib import Path; from grammar import read_categories, read_grammar\n"
        "from scene_description.share import config_path; from scene_synth_ros.cli.parameters.run_profile import find_profile\n"
        "print(*(find_profile(Path(name)) for name in ('main', 'stream', 'kinect_v1', 'stereo')))\n"
        "print(read_grammar(Path(sys.argv[1]), read_categories(config_path('categories.yaml'))).room_type)"
    )
    process = run_in(installed, "-c", code, str(tmp_path / "own.yaml"))
    assert process.returncode == 0, process.stderr
    *files, room_type = process.stdout.split()
    config = installed / "share" / "scene_synth_ros" / "config"
    assert files == [str(config / file) for file in ("runs/main.yaml", "presets/stream.yaml", "cameras/kinect_v1.yaml", "rigs/stereo.yaml")]
    assert room_type == "bedroom"


def test_the_installed_copy_finds_the_files_of_its_web_pages(installed: Path) -> None:
    code = (
        "from scene_synth_ros.cli.page import page_file; from scene_synth_ros.pages.document import page_document\n"
        "from scene_synth_ros.report import report_file\n"
        "[page_document(module.FILES, {'title': ''}) for module in (page_file, report_file)]"
    )
    process = run_in(installed, "-c", code)
    assert process.returncode == 0, process.stderr


def test_an_installed_node_runs(installed: Path) -> None:
    process = run_in(installed, str(installed / "lib" / "scene_synth_ros" / "recorder_node"), "--ros-args", "-p", "bagg:=x")
    assert process.returncode == 2
    assert process.stderr.strip() == "recorder_node: unknown parameter 'bagg'; did you mean 'bag'?"


@pytest.mark.parametrize("file", sorted((ROOT / "launch").glob("*.launch.py")), ids=lambda path: path.name)
def test_launch_files_are_python(file: Path) -> None:
    compile(file.read_text(), file, "exec")


def test_every_library_that_is_imported_is_asked_for() -> None:
    """By requirements.txt, and what apt has new enough on Ubuntu 24.04 by package.xml too."""
    asked = {line.split(">=")[0].lower() for line in (ROOT / "requirements.txt").read_text().splitlines() if not line.startswith("#")}
    names = {"yaml": "pyyaml", "PIL": "pillow", "llvmlite": "numba"}
    own = {"kernel_cache", "scene_description", "grammar", "renderer", "evaluation", "scene_synth_ros"}
    optional = {"pytest", "pyoidn", "OpenEXR", "pycocotools", "fsspec", "h5py", "isal", "pyarrow", "tf2_msgs", "vision_msgs"}
    packages = ElementTree.parse(ROOT / "package.xml").getroot()
    ros = {element.text for element in packages.iter("exec_depend")}
    for package in own:
        for path in (ROOT / package).rglob("*.py"):
            for root in imported_roots(path) - own - optional - ros:
                assert names.get(root, root) in asked, f"{path.relative_to(ROOT)} imports {root}"
    from_apt = {f"python3-{name}" for name in ("numpy", "scipy", "yaml", "pil", "shapely", "tqdm")}
    assert from_apt == {name for name in ros if name.startswith("python3-")}


def imported_roots(path: Path) -> set[str]:
    roots = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            roots |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            roots.add(node.module.split(".")[0])
    return roots - sys.stdlib_module_names
