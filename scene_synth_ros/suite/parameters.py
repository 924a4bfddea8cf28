"""Frozen dataclasses as ROS parameters: one definition gives name, type, default, range, unit, description and whether it may change.

A node declares groups: the fields of the dataclass under the prefix ``camera`` become ``camera.width`` and so on; an empty prefix gives
bare names.  Overrides that no group knows are refused by name; whole numbers are taken where a real number is asked for.
"""

import dataclasses
import difflib
import re
from array import array
from collections.abc import Callable, Iterable, Mapping
from typing import Any, get_args, get_origin

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from scene_description import SceneSynthError, error_line
from scene_description.strict import FieldError, Limits, field_types, read_value, split_annotation
from scene_synth_ros.suite.rclpy_internals import overrides_of

_FIRST_NAME = re.compile(r"[a-z][a-z0-9_]*(?=[:\[])")
ROS_OWN = ("use_sim_time", "qos_overrides.", "start_type_description_service")


class ParameterError(SceneSynthError):
    """A parameter that a node refuses at its start; one line: which, expected, got."""


def annotations_of(groups: Mapping[str, type]) -> dict[str, Any]:
    """Return the name of every parameter of some groups -> annotation of its field."""
    return {_join(prefix, name): annotation for prefix, cls in groups.items() for name, annotation in field_types(cls).items()}


def read_groups(owner: str, groups: Mapping[str, type], overrides: Mapping[str, Any]) -> dict[str, Any]:
    """Return prefix -> frozen dataclass, of values by parameter name over the defaults; no node here.

    Raises:
        ParameterError: a value is of no parameter, of the wrong type or out of range; the line begins with ``owner``.
    """
    annotations = annotations_of(groups)
    for name in overrides:
        if name not in annotations and not name.startswith(ROS_OWN):
            raise ParameterError(f"{owner}: unknown parameter '{name}'{suggestion(name, annotations)}")
    return {prefix: _read_group(owner, prefix, cls, overrides) for prefix, cls in groups.items()}


def _read_group(owner: str, prefix: str, cls: type, overrides: Mapping[str, Any]) -> Any:
    names = {name: _join(prefix, name) for name in field_types(cls) if _join(prefix, name) in overrides}
    try:
        values = {name: _read(field_types(cls)[name], overrides[full], full) for name, full in names.items()}
    except FieldError as error:
        raise ParameterError(f"{owner}: parameter {error}") from None
    try:
        return cls(**values)
    except FieldError as error:
        raise ParameterError(f"{owner}: parameter {_join(prefix, str(error))}") from None


def parameter_values(groups: Mapping[str, Any]) -> dict[str, Any]:
    """Return parameter name -> value, as ROS has it, of prefix -> dataclass."""
    return {
        _join(prefix, field.name): _to_ros(getattr(values, field.name))
        for prefix, values in groups.items()
        for field in dataclasses.fields(values)
    }


def _read(annotation: Any, value: object, name: str) -> Any:
    """Read a value; None is what ROS makes of an empty list in a parameter file.

    Raises:
        FieldError: it does not fit.
    """
    return read_value(annotation, () if value is None and _is_list(annotation) else value, name)


class Parameters:
    """Declares groups of dataclass fields on a node and keeps their current values as frozen dataclasses.

    Args:
        node: nothing of the groups is declared on it yet.
        groups: prefix -> dataclass type.
        on_change: called with the prefixes whose values changed, after ROS has taken them.
        check: called with prefix -> values before a change is taken; a SceneSynthError refuses it with its text.

    Raises:
        ParameterError: an override is unknown, of the wrong type or out of range, or ``check`` refuses the values at the start.
    """

    def __init__(
        self,
        node: Node,
        groups: Mapping[str, type],
        on_change: Callable[[set[str]], None] | None = None,
        check: Callable[[Mapping[str, Any]], object] | None = None,
    ) -> None:
        self._node = node
        self._on_change = on_change
        self._check_values = check
        self._groups = dict(groups)
        self._annotations = annotations_of(groups)
        self._values = read_groups(node.get_name(), groups, overrides_of(node))
        for name, value in parameter_values(self._values).items():
            node.declare_parameter(name, value, describe(self._annotations[name]), ignore_override=True)
        try:
            if check is not None:
                check(self._values)
        except SceneSynthError as error:
            raise ParameterError(f"{node.get_name()}: {self._told(error)}") from None
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._take)

    def __getitem__(self, prefix: str) -> Any:
        """Return the current values of a group, a frozen dataclass."""
        return self._values[prefix]

    def _check(self, parameters: list[Parameter]) -> SetParametersResult:
        try:
            candidate = self._changed(parameters)
            for parameter in parameters:
                fixed = self._fixed(parameter.name)
                if fixed and self._value(candidate, parameter.name) != self._value(self._values, parameter.name):
                    reason = f"{parameter.name} cannot change in a running node: {fixed}; restart it"
                    return SetParametersResult(successful=False, reason=reason)
            if self._check_values is not None:
                self._check_values(candidate)
        except SceneSynthError as error:
            return SetParametersResult(successful=False, reason=self._told(error))
        return SetParametersResult(successful=True)

    def _told(self, error: SceneSynthError) -> str:
        """Return an error in one line, with the group's prefix where it begins with the bare name of a field of one group."""
        text = error_line(error)
        name = _FIRST_NAME.match(text)
        prefixes = [prefix for prefix, cls in self._groups.items() if name and name[0] in field_types(cls)]
        return _join(prefixes[0], text) if len(prefixes) == 1 else text

    def _fixed(self, name: str) -> str:
        """Return why a parameter cannot change in a running node; empty if it can, or is not of these groups."""
        return split_annotation(self._annotations[name])[1].fixed if name in self._annotations else ""

    @staticmethod
    def _value(values: Mapping[str, Any], name: str) -> Any:
        prefix, _, field = name.rpartition(".")
        return getattr(values[prefix], field)

    def _changed(self, parameters: list[Parameter]) -> dict[str, Any]:
        """Return all groups as they are after a change."""
        changes: dict[str, dict[str, Any]] = {}
        for parameter in parameters:
            if parameter.name in self._annotations:
                prefix, _, field = parameter.name.rpartition(".")
                value = read_value(self._annotations[parameter.name], _from_ros(parameter.value), parameter.name)
                changes.setdefault(prefix, {})[field] = value
        return {prefix: self._replaced(prefix, changes.get(prefix, {})) for prefix in self._values}

    def _replaced(self, prefix: str, changes: Mapping[str, Any]) -> Any:
        try:
            return dataclasses.replace(self._values[prefix], **changes)
        except FieldError as error:
            raise FieldError(_join(prefix, error.path), error.expected, error.got) from None

    def _take(self, parameters: list[Parameter]) -> None:
        before, self._values = self._values, self._changed(parameters)
        changed = {prefix for prefix in before if before[prefix] != self._values[prefix]}
        if changed and self._on_change is not None:
            self._on_change(changed)


Groups = Mapping[str, Any] | Parameters
"""Prefix -> frozen dataclass, of a node or where none runs."""


def describe(annotation: Any) -> ParameterDescriptor:
    """Return the ROS descriptor of an annotated field: description with unit, range, read-only reason."""
    bare, limits = split_annotation(annotation)
    descriptor = ParameterDescriptor(description=limits.description + (f" [{limits.unit}]" if limits.unit else ""))
    descriptor.dynamic_typing = _is_list(annotation)  # an empty list has no item type in ROS; the check knows it
    descriptor.additional_constraints = f"fixed at start: {limits.fixed}" if limits.fixed else _constraints(bare, limits)
    if limits.ge is not None and limits.le is not None:
        if bare is float:
            descriptor.floating_point_range = [FloatingPointRange(from_value=float(limits.ge), to_value=float(limits.le), step=0.0)]
        elif bare is int:
            descriptor.integer_range = [IntegerRange(from_value=int(limits.ge), to_value=min(int(limits.le), 2**63 - 1), step=0)]
    return descriptor


def _constraints(bare: Any, limits: Limits) -> str:
    if get_origin(bare) is not None and get_origin(bare) is not tuple:
        return "one of " + ", ".join(map(str, get_args(bare)))
    return f"matches {limits.pattern}" if limits.pattern else ""


def _is_list(annotation: Any) -> bool:
    return get_origin(split_annotation(annotation)[0]) is tuple


def _from_ros(value: Any) -> Any:
    return list(value) if isinstance(value, array) else value  # numbers come in arrays where they come in messages


def _to_ros(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


def _join(prefix: str, name: str) -> str:
    return f"{prefix}.{name}" if prefix else name


def suggestion(name: str, known: Iterable[str]) -> str:
    """Return what to append to a line about an unknown name: the known one that it is like, or all of them."""
    close = difflib.get_close_matches(name, list(known), n=1)
    return f"; did you mean '{close[0]}'?" if close else f"; known: {', '.join(sorted(known))}"
