"""What ``ros2 param dump`` writes of a node starts the node again as it was."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import yaml
from parameter_dumps import dump, dumped
from rclpy.context import Context
from rclpy.parameter import Parameter
from scene_synth_ros_suite import Peer, claim_domain, dds_context, node_process, run_suite

from scene_description.share import config_path
from scene_synth_ros.cli.parameters.run_profile import EXTRA_RENDERER, SHIPPED, load_profile
from scene_synth_ros.record.recorder_node import RecorderNode
from scene_synth_ros.render.renderer_node import RendererNode
from scene_synth_ros.suite.suite_node import SuiteNode
from scene_synth_ros.synthesize.grammar_node import GrammarNode

FILES = [file for folder in SHIPPED for file in sorted(config_path(folder).glob("*.yaml"))]
SHIPPED_NODES = [(file, name) for file in FILES for name in load_profile(file) if load_profile(file)[name] and name != "recorder_node"]
OFF = ["-p", "autostart:=false"]


@pytest.fixture(scope="module")
def context() -> Iterator[Context]:
    with dds_context(claim_domain()) as context:
        yield context


@contextmanager
def node_of(context: Context, name: str, *words: str) -> Iterator[SuiteNode]:
    """Make a node in this process, without starting it."""
    kind: Callable[..., SuiteNode] = {"grammar_node": GrammarNode, "recorder_node": RecorderNode}.get(name, RendererNode)
    node = kind(context=context, cli_args=["--ros-args", "-r", f"__node:={name}", "-r", "__ns:=/synth", *OFF, *words])
    try:
        yield node
    finally:
        node.destroy_node()


def dump_of(node: SuiteNode) -> str:
    names = node.list_parameters([], 0).names
    return dumped(node.get_fully_qualified_name(), {name: node.get_parameter(name).get_parameter_value() for name in names})


def flat(text: str) -> dict[str, Any]:
    """Return the parameters of a dump by their names with dots."""
    (body,) = yaml.safe_load(text).values()

    def walk(values: dict[str, Any], prefix: str) -> Iterator[tuple[str, Any]]:
        for key, value in values.items():
            yield from walk(value, f"{prefix}{key}.") if isinstance(value, dict) else [(prefix + key, value)]

    return dict(walk(body["ros__parameters"], ""))


@pytest.mark.parametrize(("file", "name"), SHIPPED_NODES, ids=[f"{file.stem}-{name}" for file, name in SHIPPED_NODES])
def test_the_dump_of_every_node_at_every_shipped_file_starts_the_node_again_as_it_was(
    context: Context, tmp_path: Path, file: Path, name: str
) -> None:
    dump_file = tmp_path / "dump.yaml"
    body = ["--params-file", str(config_path("rigs/turtlebot.yaml"))] if file.parent.name == "lidars" else []  # what a lidar stands on
    with node_of(context, name, *body, "--params-file", str(file)) as node:
        dump_file.write_text(dump_of(node))
    with node_of(context, name, "--params-file", str(dump_file)) as node:
        again = dump_of(node)
    assert again == dump_file.read_text()
    said = flat(again)
    kept = load_profile(dump_file)[name]
    assert kept == said
    # what the shipped file says is what the node was started with
    words = load_profile(file)[name].items() if not EXTRA_RENDERER.fullmatch(name) else ()
    assert {key: said[key] for key, _ in words} == dict(words)


def test_the_dump_of_a_recorder_starts_it_again(context: Context, tmp_path: Path) -> None:
    dump_file = tmp_path / "dump.yaml"
    words = ["-p", f"bag:={tmp_path / 'bag'}", "-p", "exclude:=['/a', 'true', '1']", "-p", "snapshot_s:=1e-6"]
    with node_of(context, "recorder_node", *words) as node:
        dump_file.write_text(dump_of(node))
    with node_of(context, "recorder_node", "--params-file", str(dump_file)) as node:
        assert dump_of(node) == dump_file.read_text()
        assert node.get_parameter("exclude").value == ["/a", "true", "1"]


def test_the_dump_of_a_renderer_with_a_cache_starts_it_again(context: Context, tmp_path: Path) -> None:
    dump_file = tmp_path / "dump.yaml"
    settings = {"integrator": "cached", "cache_spacing_m": 0.08, "cache_rays": 128, "cache_light_samples": 16}
    words = [word for name, value in settings.items() for word in ("-p", f"render.{name}:={value}")]
    with node_of(context, "renderer_node", *words) as node:
        dump_file.write_text(dump_of(node))
    with node_of(context, "renderer_node", "--params-file", str(dump_file)) as node:
        assert dump_of(node) == dump_file.read_text()
        assert {name: node.get_parameter(f"render.{name}").value for name in settings} == settings
        refused = node.set_parameters([Parameter("render.integrator", value="cashed"), Parameter("render.cache_spacing_m", value=0.001)])
        assert [result.successful for result in refused] == [False, False]


def test_a_dump_can_be_set_on_a_node_that_runs_with_it(context: Context) -> None:
    with node_of(context, "renderer_node") as node:
        messages = [node.get_parameter(name).to_parameter_msg() for name in node.list_parameters(["camera", "streams"], 0).names]
        results = node.set_parameters([Parameter.from_parameter_msg(message) for message in messages])
        assert [result.reason for result in results if not result.successful] == []


@pytest.mark.slow
def test_dumps_of_real_processes_start_a_run(tmp_path: Path) -> None:
    dumps = {}
    starts = (
        ("first", "renderer_node", config_path("cameras/kinect_v1.yaml")),
        ("grammar_node", "grammar_node", config_path("runs/main.yaml")),
    )
    for kept, name, file in starts:
        with node_process(name, {}, files=[file]) as context:
            dumps[kept] = dump(Peer(context), f"/synth/{name}")
        (tmp_path / kept).write_text(dumps[kept])
    assert flat(dumps["first"])["camera.focal_x_px"] == 525.0
    dump_files = "--params", tmp_path / "first", "--overlay", tmp_path / "grammar_node"
    ended = run_suite(tmp_path / "bag", *dump_files, "--rooms", 1, "--frames", 1)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert "no faults" in ended.stdout
