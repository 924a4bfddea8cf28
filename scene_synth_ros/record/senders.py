"""Whose messages a topic has: only those of the suite are known to be stamped with the simulated time of the frames."""

from collections import Counter
from collections.abc import Callable, Collection, Iterable
from enum import Enum

from scene_synth_ros.suite.connections import NAME_NOT_YET_KNOWN, Endpoint
from scene_synth_ros.suite.status import NodeStatus

PATIENCE = 10
"""So many looks may a new publisher in the suite's namespace remain unknown before it counts as another's."""
SPEAKERS_PATIENCE = 6 * PATIENCE
"""So many may one that publishes ``status``, too, whose own has not been heard: what it says there may be none."""


class Origin(Enum):
    """Who publishes a topic: nodes of the suite only; perhaps, which is not known yet; or others too."""

    SUITE = "suite"
    UNKNOWN = "unknown"
    OTHERS = "others"


class Senders:
    """Judges topics by the nodes that publish them; a node is of the suite once its status has been heard.

    Threads: the thread of the node's executor only.

    Where no grammar node and no renderer has been heard, as with a replay, what is in the namespace is taken for the suite's, unless the
    recorder awaits a suite: then nobody's is known to be.

    Args:
        namespace: of the suite, ending with a slash.
        strangers: renderers that speak like the suite's and are not, which publish nothing where the suite does; it may grow.
        awaits_suite: a grammar node will be heard, as in a run.
    """

    def __init__(
        self,
        publishers_of: Callable[[str], Iterable[Endpoint]],
        namespace: str,
        strangers: Collection[str] = frozenset(),
        *,
        awaits_suite: bool = False,
    ) -> None:
        self._publishers_of, self._namespace, self._known_strangers = publishers_of, namespace, strangers
        self._before_suite = Origin.UNKNOWN if awaits_suite else Origin.SUITE
        self._suite: set[str] = set()
        self._origins: dict[str, Origin] = {}
        self._looks: Counter[str] = Counter()
        self.suite_is_present = False
        """Whether a grammar node or a renderer has been heard."""

    def take_status(self, status: NodeStatus) -> bool:
        """Take a node's status; return whether it is new, so that topics are to be judged again."""
        new = status.node not in self._suite
        self._suite.add(status.node)
        self.suite_is_present = self.suite_is_present or status.role != "recorder"
        return new

    def judge(self, topic: str) -> Origin:
        """Return whose messages a topic has; as before while it has no publisher."""
        nodes = {endpoint.node for endpoint in self._publishers_of(topic)}
        if nodes or topic not in self._origins:
            self._origins[topic] = self._judge(topic, nodes)
        return self._origins[topic]

    def _judge(self, topic: str, nodes: set[str]) -> Origin:
        own_name = topic == "/clock" or topic.startswith(self._namespace)
        if not self.suite_is_present:
            return self._before_suite if own_name else Origin.OTHERS
        strangers = nodes - self._suite
        if nodes & self._suite:
            strangers -= set(self._known_strangers)
        if not strangers:
            self._looks.pop(topic, None)
            return Origin.SUITE
        if not own_name:
            return Origin.OTHERS
        self._looks[topic] += 1
        speaking = {endpoint.node for endpoint in self._publishers_of(f"{self._namespace}status")}
        speaking -= set(self._known_strangers)
        named = {node for node in strangers if not node.endswith(NAME_NOT_YET_KNOWN)}
        waited = PATIENCE if named - speaking else SPEAKERS_PATIENCE
        return Origin.OTHERS if named and self._looks[topic] > waited else Origin.UNKNOWN
