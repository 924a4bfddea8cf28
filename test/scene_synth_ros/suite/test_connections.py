"""A renderer may begin when every one of its topics reaches the recorder, and must wait anew when it starts again."""

from dataclasses import replace

from scene_synth_ros.suite.connections import PARTICIPANT_DIGITS, Connections, Endpoint
from scene_synth_ros.suite.status import NodeStatus

PROCESS_A, PROCESS_B = "a" * PARTICIPANT_DIGITS, "b" * PARTICIPANT_DIGITS
RECORDED = {"/image": 0, "/depth": 0, "/left_out": -1}


def status(start: str, node: str = "/r") -> NodeStatus:
    return NodeStatus(node=node, role="renderer", state="starting", counts=dict.fromkeys(RECORDED, 0), start=start)


class Graph(dict[str, list[Endpoint]]):
    """Publishers by topic."""

    def publish(self, process: str, *topics: str, node: str = "/r") -> None:
        for topic in topics:
            self.setdefault(topic, []).append(Endpoint(node, process + "00001303"))

    def connections(self) -> Connections:
        return Connections(lambda topic: self.get(topic, []))


def test_a_start_is_connected_when_every_topic_was_found_at_two_looks() -> None:
    graph = Graph()
    connections = graph.connections()
    connections.take_status(status(PROCESS_A + "00001303"))
    graph.publish(PROCESS_A, "/image")
    assert [connections.look(RECORDED) for _ in range(3)] == [(), (), ()]
    graph.publish(PROCESS_A, "/depth")
    assert connections.look(RECORDED) == ()
    assert connections.look(RECORDED) == (PROCESS_A + "00001303",)


def test_topics_that_the_recorder_has_not_considered_are_waited_for() -> None:
    graph = Graph()
    graph.publish(PROCESS_A, "/image", "/depth")
    connections = graph.connections()
    connections.take_status(status(PROCESS_A + "00001303"))
    assert [connections.look({"/image": 0, "/left_out": -1}) for _ in range(3)] == [(), (), ()]


def test_publishers_of_a_former_life_or_of_another_node_do_not_count() -> None:
    graph = Graph()
    graph.publish(PROCESS_A, "/image", "/depth")
    graph.publish(PROCESS_B, "/image", "/depth", node="/other")
    connections = graph.connections()
    connections.take_status(status(PROCESS_A + "00001303"))
    assert [connections.look(RECORDED) for _ in range(2)][-1] == (PROCESS_A + "00001303",)
    connections.take_status(status(PROCESS_B + "00001303"))
    assert [connections.look(RECORDED) for _ in range(3)] == [(), (), ()]
    graph.publish(PROCESS_B, "/image", "/depth")
    assert [connections.look(RECORDED) for _ in range(2)] == [(), (PROCESS_B + "00001303",)]


def test_two_renderers_are_told_apart() -> None:
    graph = Graph()
    graph.publish(PROCESS_A, "/image", "/depth")
    connections = graph.connections()
    connections.take_status(status(PROCESS_A + "00001303"))
    connections.take_status(status(PROCESS_B + "00001303", "/s"))
    assert [connections.look(RECORDED) for _ in range(2)][-1] == (PROCESS_A + "00001303",)
    graph.publish(PROCESS_B, "/image", "/depth", node="/s")
    assert [connections.look(RECORDED) for _ in range(2)][-1] == (PROCESS_A + "00001303", PROCESS_B + "00001303")


def test_a_start_that_publishes_more_is_connected_anew() -> None:
    graph = Graph()
    graph.publish(PROCESS_A, "/image", "/depth")
    connections = graph.connections()
    connections.take_status(status(PROCESS_A + "00001303"))
    known = {**RECORDED, "/clock": 0}
    assert [connections.look(known) for _ in range(2)][-1] == (PROCESS_A + "00001303",)
    connections.take_status(replace(status(PROCESS_A + "00001303"), counts=dict.fromkeys(known, 0)))
    assert connections.look(known) == ()
    graph.publish(PROCESS_A, "/clock")
    assert [connections.look(known) for _ in range(2)] == [(), (PROCESS_A + "00001303",)]
