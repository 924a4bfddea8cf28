"""Installs scene_synth_ros, with pip on any machine and with colcon (ament_python) in a ROS 2 workspace."""

from pathlib import Path

from setuptools import find_packages, setup

NAME = "scene_synth_ros"
SHARE = f"share/{NAME}"


def folder_tree(folder: str, pattern: str) -> list[tuple[str, list[str]]]:
    """Return the data_files entries that install the files of a folder, keeping its shape."""
    files: dict[str, list[str]] = {}
    for path in sorted(Path(folder).rglob(pattern)):
        if path.is_file():
            files.setdefault(f"{SHARE}/{path.parent.as_posix()}", []).append(path.as_posix())
    return list(files.items())


setup(
    name=NAME,
    version="0.1.0",
    description="Synthetic indoor camera streams for ROS 2, from a stochastic scene grammar, on any CPU",
    license="Apache-2.0",
    maintainer="scene_synth_ros maintainers",
    maintainer_email="maintainers@users.noreply.github.com",
    python_requires=">=3.10",
    packages=find_packages(include=["scene_description*", "grammar*", "renderer*", "scene_synth_ros*"]),
    package_data={"scene_description": ["*.csv"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (SHARE, ["package.xml"]),
        *folder_tree("config", "*"),
        *folder_tree("launch", "*.launch.py"),
    ],
    zip_safe=False,
    install_requires=[
        "numpy>=1.26",
        "numba>=0.62",
        "scipy>=1.11",
        "embreex>=4.4",
        "trimesh>=4.4",
        "mcap>=1.2",
        "lz4>=4.3",
        "zstandard>=0.22",
        "PyYAML>=6.0",
        "pillow>=10.1",
        "shapely>=2.0",
    ],
    extras_require={
        "denoise": ["pyoidn>=2.5"],
        "exr": ["OpenEXR>=3.3"],
        "ros": ["ros-jazzy-rclpy[fastrtps]", "ros-jazzy-common-interfaces"],
        "test": [
            "pytest>=8",
            "pytest-xdist>=3.6",
            "hypothesis>=6.100",
            "rosbags>=0.10",
            "mcap-ros2-support>=0.5",
            "cyclonedds>=11",
            "colcon-core",
            "colcon-ros",
            "colcon-python-setup-py",
            "ruff==0.17.5",
            "mypy==2.4.1",
            "types-PyYAML",
            "scipy-stubs",
        ],
        "bench": ["rosbags>=0.10", "flip-evaluator>=1.7"],
        "bench-reference": ["mitsuba>=3.9"],
    },
    entry_points={
        "console_scripts": [
            "scene_synth = scene_synth_ros.cli.command_line:main",
            "grammar_node = scene_synth_ros.generate.grammar_node:main",
            "renderer_node = scene_synth_ros.render.renderer_node:main",
            "recorder_node = scene_synth_ros.record.recorder_node:main",
            "replay_node = scene_synth_ros.replay.replay_node:main",
        ],
    },
)
