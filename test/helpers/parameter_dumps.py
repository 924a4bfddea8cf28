"""What ``ros2 param dump`` prints of a node: the tool is not among the wheels, so tests ask the same services and write the same YAML."""

from __future__ import annotations

from typing import Any

import yaml
from rcl_interfaces.msg import ParameterType, ParameterValue
from rcl_interfaces.srv import GetParameters, ListParameters
from scene_synth_ros_suite import Peer

_FIELDS = {
    ParameterType.PARAMETER_BOOL: "bool_value",
    ParameterType.PARAMETER_INTEGER: "integer_value",
    ParameterType.PARAMETER_DOUBLE: "double_value",
    ParameterType.PARAMETER_STRING: "string_value",
    ParameterType.PARAMETER_BYTE_ARRAY: "byte_array_value",
    ParameterType.PARAMETER_BOOL_ARRAY: "bool_array_value",
    ParameterType.PARAMETER_INTEGER_ARRAY: "integer_array_value",
    ParameterType.PARAMETER_DOUBLE_ARRAY: "double_array_value",
    ParameterType.PARAMETER_STRING_ARRAY: "string_array_value",
}


def dumped(node: str, values: dict[str, ParameterValue]) -> str:
    """Return the YAML text of parameters as ros2param prints it: names nested at their dots, below the node's full name."""
    nested: dict[str, Any] = {}
    for name, value in sorted(values.items()):
        *groups, last = name.split(".")
        at = nested
        for group in groups:
            at = at.setdefault(group, {})
        item = getattr(value, _FIELDS[value.type]) if value.type in _FIELDS else None
        at[last] = list(item) if value.type >= ParameterType.PARAMETER_BYTE_ARRAY else item
    return yaml.dump({node: {"ros__parameters": nested}}, default_flow_style=False)


def dump(peer: Peer, node: str) -> str:
    """Return what ``ros2 param dump`` prints of a running node, given by its full name."""
    names = peer.call(ListParameters, f"{node}/list_parameters", ListParameters.Request()).result.names
    values = peer.call(GetParameters, f"{node}/get_parameters", GetParameters.Request(names=names)).values
    return dumped(node, dict(zip(names, values, strict=True)))
