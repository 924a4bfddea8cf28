"""Parameters of other nodes: asked for until an answer comes."""

from types import SimpleNamespace

import pytest
from rcl_interfaces.msg import ParameterValue
from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.task import Future

from scene_synth_ros.suite import parameter_collector
from scene_synth_ros.suite.parameter_collector import ParameterCollector


class Service:
    """A client of a service whose first answers get lost."""

    def __init__(self, kind: type, lost: int) -> None:
        self.kind, self.lost, self.srv_name, self.calls = kind, lost, "", 0

    def service_is_ready(self) -> bool:
        return True

    def call_async(self, request: object) -> Future:
        self.calls += 1
        future: Future = Future()
        if self.calls > self.lost:
            response = self.kind.Response()
            if self.kind is ListParameters:
                response.result.names = ["seed"]
            else:
                response.values = [ParameterValue(type=2, integer_value=7)]
            future.set_result(response)
        return future


@pytest.mark.parametrize(("lists_lost", "values_lost"), [(0, 0), (2, 0), (0, 2), (1, 1)])
def test_a_node_is_asked_until_its_answer_comes(monkeypatch: pytest.MonkeyPatch, lists_lost: int, values_lost: int) -> None:
    clock = [100.0]
    monkeypatch.setattr(parameter_collector, "time", SimpleNamespace(monotonic=lambda: clock[0]))
    services = {ListParameters: Service(ListParameters, lists_lost), GetParameters: Service(GetParameters, values_lost)}
    node = SimpleNamespace(create_client=lambda kind, name: services[kind], count_services=lambda name: 1, warn=pytest.fail)
    told: list[dict] = []
    collector = ParameterCollector(node, lambda values: told.append(dict(values)))
    collector.ask("/synth/renderer_node")
    for step in range(80):
        assert collector.expects_answers == (not told and step < 50)
        collector.step()
        clock[0] += 0.1
    assert told == [{"/synth/renderer_node": {"seed": 7}}]
    assert services[ListParameters].calls == 1 + lists_lost + values_lost and services[GetParameters].calls == 1 + values_lost
