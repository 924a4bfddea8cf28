"""Dataclasses as ROS parameters, on a real node without peers."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter
from scene_synth_ros_suite import claim_domain

from renderer import CameraConfig
from scene_description import Limits, SceneSynthError
from scene_synth_ros.suite.parameters import ParameterError, Parameters


@dataclass(frozen=True, slots=True, kw_only=True)
class Lens:
    width: Annotated[int, Limits(ge=1, le=100, unit="px", description="Image width", fixed="buffers are made once")] = 64
    exposure: Annotated[float, Limits(ge=-2.0, le=8.0, unit="EV", description="Exposure value")] = 1.0
    mode: Annotated[Literal["near", "far"], Limits(description="Focus")] = "near"
    tags: Annotated[tuple[str, ...], Limits(max_length=3)] = ()


@pytest.fixture
def context() -> Iterator[Context]:
    context = Context()
    rclpy.init(context=context, domain_id=claim_domain())
    yield context
    for node in MADE:
        node.destroy_node()
    MADE.clear()
    rclpy.try_shutdown(context=context)


MADE: list[Node] = []


def make_node(context: Context, **overrides: object) -> Node:
    values = [Parameter(name.replace("__", "."), value=value) for name, value in overrides.items()]
    MADE.append(Node("lens_node", context=context, parameter_overrides=values))
    return MADE[-1]


def test_defaults_overrides_and_whole_numbers_for_real_ones(context: Context) -> None:
    parameters = Parameters(make_node(context, lens__exposure=3, lens__tags=["a"]), {"lens": Lens})
    assert parameters["lens"] == Lens(exposure=3.0, tags=("a",))


@pytest.mark.parametrize(
    ("overrides", "text"),
    [
        ({"lens__exposur": 1.0}, "unknown parameter 'lens.exposur'; did you mean 'lens.exposure'"),
        ({"nonsense": 1.0}, "unknown parameter 'nonsense'; known: lens.exposure, lens.mode"),
        ({"lens__exposure": "bright"}, r"lens.exposure: expected a number in \[-2.0, 8.0\] EV, got 'bright'"),
        ({"lens__exposure": 99.0}, r"lens.exposure: expected a number in \[-2.0, 8.0\] EV, got 99.0"),
        ({"lens__width": 1.5}, r"lens.width: expected an integer in \[1, 100\] px, got 1.5"),
        ({"lens__mode": "macro"}, "lens.mode: expected one of 'near', 'far', got 'macro'"),
    ],
)
def test_bad_overrides_are_refused_by_name(context: Context, overrides: dict[str, object], text: str) -> None:
    with pytest.raises(ParameterError, match=text):
        Parameters(make_node(context, **overrides), {"lens": Lens})


def test_live_changes_are_taken_and_told(context: Context) -> None:
    told: list[set[str]] = []
    node = make_node(context)
    parameters = Parameters(node, {"lens": Lens}, told.append)
    (result,) = node.set_parameters([Parameter("lens.exposure", value=4.0)])
    assert result.successful
    assert parameters["lens"].exposure == 4.0
    assert told == [{"lens"}]


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [("lens.width", 32, "cannot change in a running node: buffers are made once"), ("lens.mode", "macro", "expected one of 'near', 'far'")],
)
def test_refused_changes_say_why_and_change_nothing(context: Context, name: str, value: object, reason: str) -> None:
    node = make_node(context)
    parameters = Parameters(node, {"lens": Lens})
    (result,) = node.set_parameters([Parameter(name, value=value)])
    assert not result.successful
    assert reason in result.reason
    assert parameters["lens"] == Lens()


def refuse_far(values: Mapping[str, object]) -> None:
    if values["lens"].mode == "far":
        raise SceneSynthError("tags[0]: expected 'near' beside it")
    if values["lens"].mode == "near" and values["lens"].tags:
        raise SceneSynthError("request: expected no tags")


def test_what_a_check_refuses_is_named_as_the_parameter_is_called(context: Context) -> None:
    with pytest.raises(ParameterError, match=r"^lens_node: lens\.tags\[0\]: expected 'near' beside it$"):
        Parameters(make_node(context, lens__mode="far"), {"lens": Lens}, check=refuse_far)
    with pytest.raises(ParameterError, match=r"^lens_node: request: expected no tags$"):
        Parameters(make_node(context, lens__tags=["a"]), {"lens": Lens}, check=refuse_far)
    node = make_node(context)
    Parameters(node, {"lens": Lens}, check=refuse_far)
    (result,) = node.set_parameters([Parameter("lens.mode", value="far")])
    assert result.reason == "lens.tags[0]: expected 'near' beside it"


def test_what_a_group_itself_refuses_is_named_as_the_parameter_is_called(context: Context) -> None:
    text = "camera.distortion: expected at most 0 coefficients for model 'pinhole', got 1"
    with pytest.raises(ParameterError, match=f"^lens_node: parameter {text}$"):
        Parameters(make_node(context, camera__distortion=[0.5]), {"camera": CameraConfig})


def test_a_list_that_begins_empty_takes_items_of_its_type_only(context: Context) -> None:
    node = make_node(context)
    parameters = Parameters(node, {"lens": Lens})
    assert node.set_parameters([Parameter("lens.tags", value=["a", "b"])])[0].successful
    assert parameters["lens"].tags == ("a", "b")
    (result,) = node.set_parameters([Parameter("lens.tags", value=[1, 2])])
    assert not result.successful
    assert result.reason == "lens.tags[0]: expected a string, got 1"


def test_out_of_range_is_refused_by_the_descriptor(context: Context) -> None:
    node = make_node(context)
    parameters = Parameters(node, {"lens": Lens})
    (result,) = node.set_parameters([Parameter("lens.exposure", value=50.0)])
    assert not result.successful
    assert parameters["lens"].exposure == 1.0


def test_descriptors_carry_range_unit_and_reason(context: Context) -> None:
    node = make_node(context)
    Parameters(node, {"lens": Lens})
    exposure, width = node.describe_parameter("lens.exposure"), node.describe_parameter("lens.width")
    assert exposure.description == "Exposure value [EV]"
    assert (exposure.floating_point_range[0].from_value, exposure.floating_point_range[0].to_value) == (-2.0, 8.0)
    assert width.additional_constraints == "fixed at start: buffers are made once"
