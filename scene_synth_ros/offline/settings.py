"""The parameters of a run as its nodes would read them, where no node runs."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from renderer.exposure import sensor_ev100
from scene_description import SceneSynthError, error_line
from scene_synth_ros.record.recorder_config import RECORDER_GROUPS
from scene_synth_ros.render.renderer_config import RENDERER_GROUPS, refuse_contradictions
from scene_synth_ros.suite.parameters import ParameterError, parameter_values, read_groups
from scene_synth_ros.synthesize.run_config import GRAMMAR_GROUPS, RunConfig


@dataclass(frozen=True, slots=True, kw_only=True)
class OfflineSettings:
    """What a bag is written with.

    Attributes:
        namespace: of nodes and topics, without a slash at its end.
        grammar: parameters of the grammar node: ``GRAMMAR_GROUPS``.
        renderers: name of a renderer -> its parameters: ``RENDERER_GROUPS``.
        recorder: parameters of the recorder: ``RECORDER_GROUPS``.
    """

    namespace: str
    grammar: Mapping[str, Any]
    renderers: Mapping[str, Mapping[str, Any]]
    recorder: Mapping[str, Any]

    @property
    def run(self) -> RunConfig:
        """How many rooms and frames, and their times."""
        config: RunConfig = self.grammar[""]
        return config

    @property
    def nodes(self) -> dict[str, dict[str, Any]]:
        """The parameters of the nodes, by fully qualified name, as bags keep them."""
        nodes = {"grammar_node": self.grammar, **self.renderers}
        return {f"{self.namespace}/{name}": parameter_values(groups) for name, groups in nodes.items()}


def read_settings(parameters: Mapping[str, Mapping[str, Any]], namespace: str = "/synth") -> OfflineSettings:
    """Read the parameters of the nodes of a run, name -> parameter -> value.

    Raises:
        ParameterError: a parameter does not fit, or asks for the time of day, which nothing has that is not live.
    """
    grammar = read_groups("grammar_node", GRAMMAR_GROUPS, parameters["grammar_node"])
    run: RunConfig = grammar[""]
    if run.clock != "simulated":
        raise ParameterError(f"grammar_node: parameter clock: expected simulated where no node runs, got '{run.clock}'")
    renderers = {}
    for name, values in sorted(parameters.items()):
        if name.startswith("renderer_node"):
            groups = renderers[name] = read_groups(name, RENDERER_GROUPS, values)
            refuse_contradictions(name, groups)
            try:
                sensor_ev100(groups["camera"], groups["sensor"])
            except SceneSynthError as error:
                raise ParameterError(f"{name}: {error_line(error)}") from None
    recorder = read_groups("recorder_node", RECORDER_GROUPS, parameters["recorder_node"])
    return OfflineSettings(namespace=namespace.rstrip("/"), grammar=grammar, renderers=renderers, recorder=recorder)
