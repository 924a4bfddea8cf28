"""Installs scene_synth_ros, with pip on any machine and with colcon (ament_python) in a ROS 2 workspace."""

from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

NAME = "scene_synth_ros"
SHARE = f"share/{NAME}"
PACKAGE = ElementTree.parse("package.xml").getroot()


def folder_tree(folder: str, pattern: str) -> list[tuple[str, list[str]]]:
    """Return the data_files entries that install the files of a folder, keeping its shape."""
    files: dict[str, list[str]] = {}
    for path in sorted(Path(folder).rglob(pattern)):
        if path.is_file():
            files.setdefault(f"{SHARE}/{path.parent.as_posix()}", []).append(path.as_posix())
    return list(files.items())


setup(
    name=NAME,
    version=PACKAGE.findtext("version"),
    description=PACKAGE.findtext("description"),
    license=PACKAGE.findtext("license"),
    maintainer=PACKAGE.findtext("maintainer"),
    maintainer_email=PACKAGE.find("maintainer").get("email"),
    python_requires=">=3.10",
    packages=find_packages(include=["kernel_cache*", "scene_description*", "grammar*", "renderer*", "evaluation*", "scene_synth_ros*"]),
    package_data={
        "scene_description": ["*.csv"],
        "scene_synth_ros.cli.page": ["web/*"],
        "scene_synth_ros.pages": ["web/*"],
        "scene_synth_ros.report": ["web/*"],
        "scene_synth_ros.messages": ["interfaces/*/msg/*.msg"],
    },
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (SHARE, ["package.xml"]),
        *folder_tree("config", "*"),
        *folder_tree("launch", "*.launch.py"),
        *folder_tree("docs/schemas", "*.json"),
    ],
    zip_safe=False,
    install_requires=[line for line in Path("requirements.txt").read_text().splitlines() if not line.startswith("#")],
    extras_require={
        "denoise": ["pyoidn>=2.5"],
        "fast": ["isal>=1.6"],
        "exr": ["OpenEXR>=3.3"],
        "examples": ["open3d==0.19.0", "opencv-python-headless>=4.8", "pycocotools>=2.0.8"],
        "evaluate": ["pycocotools>=2.0.8"],
        "hdf5": ["h5py>=3.12"],
        "lerobot": ["pyarrow>=18"],
        "train": ["jax>=0.4.35", "optax>=0.2.3"],
        "cloud": ["fsspec>=2024.6", "s3fs>=2024.6"],
        "ray": ["ray>=2.40"],
        "ros": ["ros-jazzy-rclpy[fastrtps]", "ros-jazzy-common-interfaces"],
        "test": [
            "pytest>=8",
            "pytest-cov>=5",
            "pytest-xdist>=3.6",
            "hypothesis>=6.100",
            "rosbags>=0.10",
            "mcap-ros2-support>=0.5",
            "pycocotools>=2.0.11",
            "h5py>=3.12",
            "isal>=1.6",
            "pyarrow>=18",
            "webdataset>=0.2.100",
            "pycolmap>=4",
            "evo>=1.30",
            "scikit-learn>=1.4",
            "jsonschema>=4.20",
            "opencv-python-headless>=4.8",
            "cyclonedds>=11",
            "ray>=2.40",
            "s3fs>=2024.6",
            "moto[s3]>=5.0",
            "flask",
            "flask-cors",
            "jinja2",
            "colcon-core",
            "colcon-ros",
            "colcon-python-setup-py",
            "ruff==0.17.5",
            "mypy==2.4.1",
            "types-PyYAML",
            "types-tqdm",
            "scipy-stubs",
        ],
        "bench": ["rosbags>=0.10", "flip-evaluator>=1.7"],
        "bench-physics": ["mujoco>=3.17,<5"],
        "bench-lidar": ["kiss-icp>=1.3", "rko_lio>=0.4", "small_gicp>=1.0", "rosbags>=0.10", "evo>=1.30"],
        "bench-visual": ["pyorbslam3>=0.1.1", "opencv-python-headless>=4.10", "evo>=1.30"],
        "bench-inertial": ["gtsam>=4.2", "allantools>=2024.6"],
        "bench-reference": ["mitsuba>=3.9"],
        "bench-perception": ["open3d==0.19.0", "opencv-python-headless>=4.10"],
        "bench-alignment": ["open3d==0.19.0", "rosbags>=0.10"],
    },
    entry_points={
        "console_scripts": [
            "scene_synth = scene_synth_ros.cli.command_line:main",
            "grammar_node = scene_synth_ros.synthesize.grammar_node:main",
            "renderer_node = scene_synth_ros.render.renderer_node:main",
            "recorder_node = scene_synth_ros.record.recorder_node:main",
            "evaluator_node = scene_synth_ros.evaluate.evaluator_node:main",
            "replay_node = scene_synth_ros.replay.replay_node:main",
        ],
        "pytest11": ["scene_synth_ros.testing.plugin = scene_synth_ros.testing.plugin"],
    },
)
