"""The parameters of a node: what it is given at its start, their declaration, and their changes while it runs."""

import array
import difflib
import math
import re
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import yaml
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.hull import inherited
from vessel_hsmc_ros.nodes.qos import OVERRIDES
from vessel_hsmc_ros.nodes.rclpy_parts import overrides
from vessel_hsmc_ros.scenario.parameters import ineffective, not_in_use, without_foreign_hull_data
from vessel_hsmc_ros.scenario.parameters_file import (
    PARAMETER,
    USE_SIM_TIME,
    VESSEL,
    Given,
    given_parameters,
    in_long_form,
    read_yaml,
)
from vessel_hsmc_ros.scenario.vessels import with_vessel

RESEMBLANCE = 0.8
"""From this similarity on, by difflib, an unknown name in a section for any node is a misspelt one of this node."""


def take_given(node: Node, command_line: Sequence[str]) -> dict[str, Given]:
    """The parameters that a node is given, and those among them that are rclpy's own set to them.

    `command_line`: that of its process; empty if the code that creates the node gives it all.
    """
    given = {name: Given(parameter.value, "") for name, parameter in overrides(node).items()}
    given |= given_parameters(command_line, node.get_fully_qualified_name())
    for name, rule in given.items():
        if name.startswith(OVERRIDES):
            overrides(node)[name] = Parameter(name, value=rule.value)
        elif node.has_parameter(name) and node.get_parameter(name).value != rule.value:
            result = node.set_parameters([Parameter(name, value=rule.value)])[0]
            if not result.successful:
                raise ParameterError(f"{name} cannot be {rule.value}: {result.reason}{_source(rule)}")
    return given


def declare(node: Any, cls: type) -> Any:
    """Declare a dataclass's parameters on a `VesselNode` and return the instance that it was started with."""
    # rclpy silently ignores overrides of parameters that are not declared; here a misspelt name is an error.
    given = {name: rule for name, rule in node.given.items() if not node.has_parameter(name) and not name.startswith(OVERRIDES)}
    entries = schema.entries(cls)
    others = _of_other_nodes(given, entries)
    if others:
        places = " and ".join(dict.fromkeys(given[name].place for name in others))
        node.get_logger().warning(f"{', '.join(others)} in {places}: not of this node, taken to be for others")
    values = {name: rule.value for name, rule in given.items() if name not in others}
    # A parameters file may describe the ship once for all nodes, in a section that each of them receives as a whole.
    try:
        own = without_foreign_hull_data(in_long_form(values), entries)
        instance: Any = schema.build(cls, with_vessel(own, entries), node.NAME)
    except ParameterError as error:
        raise ParameterError(f"{error}{_source_of(str(error), given)}") from None
    _declare(node, instance)
    if hasattr(instance, "vessel") and (remaining := inherited(instance.vessel)):
        node.get_logger().warning(f"only a part of the hull is given: {remaining}")
    commanded = [name for name in own if name in given and given[name].place.startswith(PARAMETER)]
    for line in ineffective(node.NAME, instance, own, commanded):
        node.get_logger().warning(in_ros_names(line, node.NAME))
    return instance


def _declare(node: Any, instance: Any, fixed: bool = True) -> None:
    """Declare the parameters of the mode or law that a node runs, and no longer those of another; the instance has them all."""
    values = schema.flatten(instance)
    others = not_in_use(node.NAME, values)
    for name, entry in schema.entries(type(instance)).items():
        if name in others and node.has_parameter(name):
            node.undeclare_parameter(name)
        elif name not in others and not node.has_parameter(name):
            value, described = values[name], descriptor(entry)
            described.read_only &= fixed
            # What was given has been applied and validated, so rclpy must not apply it again.
            node.declare_parameter(name, list(value) if isinstance(value, tuple) else value, described, ignore_override=True)


def _of_other_nodes(given: Mapping[str, Given], known: Collection[str]) -> list[str]:
    """The unknown names of sections for any node, such as `/**`, but those that are like a name of this node."""
    groups = {name.partition(".")[0] for name in known if "." in name}
    return [
        name
        for name, rule in given.items()
        if not rule.named
        and name not in known
        and name.partition(".")[0] not in groups | {VESSEL.rstrip(".")}
        and not difflib.get_close_matches(name[: schema.LONGEST_NAME], known, n=1, cutoff=RESEMBLANCE)
    ]


def _source_of(error: str, given: Mapping[str, Given]) -> str:
    """Where the first parameter was given that an error names, as its end."""
    named = (rule for name, rule in given.items() if re.search(rf"(?<!\w){re.escape(name)}(?![\w.])", error))
    return next(map(_source, named), "")


def _source(rule: Given) -> str:
    return f" ({rule.place})" if rule.place else ""


def in_ros_names(text: str, node: str) -> str:
    """A message of a node with its parameters as `ros2 param` takes them: `rate_hz` for a scenario's `controller.rate_hz`."""
    return re.sub(rf"(?<![\w./]){node}\.(?!ya?ml\b|py\b)(?=[a-z])", "", text)


def descriptor(entry: schema.Entry) -> ParameterDescriptor:
    """The descriptor of a declared parameter, as `ros2 param describe` shows it."""
    described = ParameterDescriptor(
        description=entry.description + (f" [{entry.unit}]" if entry.unit else ""),
        additional_constraints=f"Must be {entry.allowed}.",
        read_only=not entry.tunable,
    )
    if entry.type is float and entry.low is not None and entry.high is not None:
        described.floating_point_range = [FloatingPointRange(from_value=entry.low, to_value=entry.high)]
    if entry.type is int and entry.low is not None and entry.high is not None:
        described.integer_range = [IntegerRange(from_value=math.ceil(entry.low), to_value=math.floor(entry.high), step=1)]
    return described


def requested_changes(node: Any, requested: Sequence[Parameter]) -> list[Parameter]:
    """The changes of a request in the types of their parameters, without read-only ones that have their value already.

    `ros2 param` sends 5 for 5.0, and of a file that it has written itself `.inf` as a text, and all that is read-only.
    """
    entries, others = schema.entries(node.PARAMETERS), not_in_use(node.NAME, schema.flatten(node.parameters))
    for change in requested:
        if change.name in others:
            raise ParameterError(f"{change.name} is not in use: {others[change.name]}")
        if change.name == USE_SIM_TIME and change.value != node.get_parameter(USE_SIM_TIME).value:
            raise ParameterError(f"{USE_SIM_TIME} must be given at the start of the node: its clock stays (got {change.value})")
    changes = [_in_declared_type(node, change) if change.name in entries else change for change in requested]
    return [change for change in changes if not (node.has_parameter(change.name) and _is_kept(node, change))]


def _is_kept(node: Node, change: Parameter) -> bool:
    """Whether a change is none, of a parameter that may not be changed."""
    present = node.get_parameter(change.name).value
    return node.describe_parameter(change.name).read_only and bool(plain(change.value) == plain(present))


def plain(value: Any) -> Any:
    """A parameter's value in Python's own types: rclpy returns lists of numbers as arrays."""
    if isinstance(value, array.array | bytes | list | tuple):
        return [plain(item) for item in value]
    return value


def _in_declared_type(node: Node, change: Parameter) -> Parameter:
    """A change in the type of its parameter, or as it is where it has no such value."""
    kind = node.get_parameter(change.name).type_
    value = change.value
    try:
        if kind is not Parameter.Type.STRING:
            value = read_yaml(value) if isinstance(value, str) else value
        if kind is Parameter.Type.DOUBLE:
            value = _number(value)
        if kind is Parameter.Type.DOUBLE_ARRAY:
            value = [_number(read_yaml(item) if isinstance(item, str) else item) for item in value]
        return Parameter(change.name, kind, value)
    except (TypeError, ValueError, yaml.YAMLError):
        return change


def _number(value: Any) -> float:
    """An integer or a float as a float. Raises TypeError if it is neither."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError
    return float(value)


def take_changes(node: Any, changes: list[Parameter]) -> SetParametersResult:
    """Apply the changed parameters of a request to a node, all of them or none."""
    present = schema.flatten(node.parameters)
    # One that is only just being declared has the value that the node knows.
    values = {p.name: p.value for p in changes if p.name in present and node.has_parameter(p.name)}
    if not values:
        return SetParametersResult(successful=True)
    try:  # all changes of a request together: a limit may depend on another parameter
        parameters: Any = schema.build(node.PARAMETERS, present | values, node.NAME)
        node.retune(parameters)
    except ParameterError as error:
        return SetParametersResult(successful=False, reason=in_ros_names(str(error), node.NAME))
    node.reporter.changes(node.parameters, parameters)
    node.parameters = parameters
    _declare(node, parameters, fixed=False)  # another law, which only a node takes whose parameters are not fixed
    node.given |= {name: Given(value, "") for name, value in values.items()}
    return SetParametersResult(successful=True)
