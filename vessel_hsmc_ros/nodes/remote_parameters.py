"""Parameters of a running node: their values and descriptions, and changes that are checked before any is made."""

import difflib
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from rcl_interfaces.msg import ParameterDescriptor
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters, SetParametersAtomically
from rclpy.parameter import Parameter, parameter_value_to_python

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.node_list import LOOP, WATCHERS
from vessel_hsmc_ros.laws import LAWS
from vessel_hsmc_ros.nodes.remote import Remote, Service

NODE_NAMES = (*LOOP, *WATCHERS)


class Change(NamedTuple):
    """A change of a parameter: `node.parameter`, the value before and the value after it."""

    name: str
    old: Any
    new: Any


def get_parameters(remote: Remote, node: str, names: Iterable[str]) -> dict[str, Any]:
    """Values of some parameters of a node; None for those that it does not have.

    Raises:
        RunError: the node is not found, or does not respond.
    """
    (getter,) = remote.connect([Service(node, "get_parameters", GetParameters)])
    wanted = list(names)
    values = remote.call(getter, GetParameters.Request(names=wanted)).values
    return {name: _plain(parameter_value_to_python(value)) for name, value in zip(wanted, values, strict=True)}


def change_parameters(remote: Remote, changes: Mapping[str, object]) -> list[Change]:
    """Change parameters of running nodes. All are checked first, and those of one node are changed together or not at all.

    Args:
        remote: The connection with the vessel.
        changes: New values by `node.parameter`.

    Returns:
        Old and new values.

    Raises:
        ParameterError: a parameter is unknown, is set at the start only, or a value is not allowed.
        RunError: a node is not found, or does not respond.
    """
    by_node: dict[str, dict[str, object]] = {}
    for key, value in changes.items():
        node, dot, name = key.partition(".")
        if not (node and dot and name):
            raise ParameterError(f"{key} is not a parameter: it takes node.parameter, such as controller.guided.position_gain")
        if node not in NODE_NAMES and (close := difflib.get_close_matches(node, NODE_NAMES, n=1)):
            raise ParameterError(f"{node} is not a node: did you mean {close[0]}?")
        by_node.setdefault(node, {})[name] = value
    remote.require(*by_node)
    checked = {node: _checked(remote, node, values) for node, values in by_node.items()}
    made: list[Change] = []
    for node, parameters in checked.items():
        names = [parameter.name for parameter in parameters]
        old = get_parameters(remote, node, names)
        (setter,) = remote.connect([Service(node, "set_parameters_atomically", SetParametersAtomically)])
        request = SetParametersAtomically.Request(parameters=[parameter.to_parameter_msg() for parameter in parameters])
        result = remote.call(setter, request).result
        if not result.successful:
            raise ParameterError(result.reason)
        made += [Change(f"{node}.{p.name}", old[p.name], _plain(p.value)) for p in parameters]
    return made


def without_effect(remote: Remote, changes: Iterable[Change]) -> list[str]:
    """Notes on changed parameters of a law that the controller does not run at present."""
    groups = {change.name.split(".")[1] for change in changes if change.name.startswith("controller.")}
    if not (laws := groups & set(LAWS)):
        return []
    law = get_parameters(remote, "controller", ["law"])["law"]
    return [f"controller.{other} has no effect on this run, whose law is {law}" for other in sorted(laws - {law})]


def _checked(remote: Remote, node: str, values: Mapping[str, object]) -> list[Parameter]:
    """The new parameters of a node, checked against its own descriptions."""
    lister, describer = remote.connect(
        [Service(node, "list_parameters", ListParameters), Service(node, "describe_parameters", DescribeParameters)]
    )
    known = set(remote.call(lister, ListParameters.Request()).result.names)
    for name in values:
        if name not in known:
            close = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
            hint = f"did you mean {node}.{close[0]}?" if close else "`vessel-hsmc parameters` lists all of them"
            raise ParameterError(f"{node}.{name} is not a parameter: {hint}")
    descriptors = remote.call(describer, DescribeParameters.Request(names=list(values))).descriptors
    return [_parameter(node, d, value) for d, value in zip(descriptors, values.values(), strict=True)]


def _parameter(node: str, descriptor: ParameterDescriptor, value: Any) -> Parameter:
    """A parameter with a new value.

    Raises:
        ParameterError: it is read-only, or the value has the wrong type or is out of range.
    """
    name = f"{node}.{descriptor.name}"
    if descriptor.read_only:
        raise ParameterError(f"{name} is set at the start and cannot be changed while the node runs: start it with --set {name}=")
    kind = Parameter.Type(descriptor.type)
    if kind is Parameter.Type.DOUBLE and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    elif kind is Parameter.Type.DOUBLE_ARRAY and isinstance(value, list):
        value = [float(item) if isinstance(item, int) else item for item in value]
    takes = descriptor.additional_constraints.rstrip(".") or f"It takes a value of type {kind.name.lower()}"
    refused = ParameterError(f"{name} = {value} is not allowed: {takes[0].lower()}{takes[1:]}")
    try:
        parameter = Parameter(descriptor.name, kind, value)
    except (TypeError, ValueError, AssertionError):
        raise refused from None
    ranges = [*descriptor.floating_point_range, *descriptor.integer_range]
    numbers = value if isinstance(value, list) else [value]
    if any(not r.from_value <= number <= r.to_value for r in ranges for number in numbers):
        raise refused
    return parameter


def _plain(value: Any) -> Any:
    """A value in Python's own types: rclpy returns lists of numbers as arrays."""
    return list(value) if hasattr(value, "__iter__") and not isinstance(value, str) else value
