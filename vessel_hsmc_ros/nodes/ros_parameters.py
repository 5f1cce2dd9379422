"""Declaration of a parameter dataclass on a ROS node, with descriptors and validation, and its changes while the node runs."""

import math
import warnings
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.hull import inherited
from vessel_hsmc_ros.scenario.parameters import in_long_form, without_foreign_hull_data
from vessel_hsmc_ros.scenario.vessels import with_vessel


def declare(node: Node, cls: type) -> Any:
    """Declare a dataclass's parameters on a node and return the instance that the node was started with.

    Raises:
        ParameterError: the node was given a parameter that is unknown, or a value that is not allowed.
        ScenarioError: a vessel by name cannot be read.
    """
    # rclpy silently ignores overrides of parameters that are not declared; here a misspelt name is an error.
    given = {
        name: value.value
        for name, value in node._parameter_overrides.items()
        if not node.has_parameter(name) and not name.startswith("qos_overrides.")
    }
    entries = schema.entries(cls)
    # A parameters file may describe the ship once for all nodes, in a section that each of them receives as a whole.
    with warnings.catch_warnings(record=True) as former:
        warnings.simplefilter("always", FutureWarning)
        own = without_foreign_hull_data(in_long_form(given), entries)
        instance: Any = schema.build(cls, with_vessel(own, entries), node.get_name())
    for warning in former:
        node.get_logger().warning(str(warning.message))
    values = schema.flatten(instance)
    for name, entry in entries.items():
        value = values[name]  # the override has been applied and validated above, so rclpy must not apply it again
        node.declare_parameter(name, list(value) if isinstance(value, tuple) else value, descriptor(entry), ignore_override=True)
    if hasattr(instance, "vessel") and (remaining := inherited(instance.vessel)):
        node.get_logger().warning(f"only a part of the hull is given: {remaining}")
    return instance


def descriptor(entry: schema.Entry) -> ParameterDescriptor:
    """The descriptor of a declared parameter, as `ros2 param describe` shows it."""
    described = ParameterDescriptor(
        description=entry.description + (f" [{entry.unit}]" if entry.unit else ""),
        additional_constraints=f"It takes {entry.allowed}.",
        read_only=not entry.tunable,
    )
    if entry.type is float and entry.low is not None and entry.high is not None:
        described.floating_point_range = [FloatingPointRange(from_value=entry.low, to_value=entry.high)]
    if entry.type is int and entry.low is not None and entry.high is not None:
        described.integer_range = [IntegerRange(from_value=math.ceil(entry.low), to_value=math.floor(entry.high), step=1)]
    return described


def take_changes(node: Any, changes: list[Parameter]) -> SetParametersResult:
    """Apply the changed parameters of a request to a node, all of them or none.

    Args:
        node: A `VesselNode`.
        changes: Of parameters of any kind; rclpy also passes those of its own, such as use_sim_time.
    """
    known = schema.entries(node.PARAMETERS)
    values = {p.name: p.value for p in changes if p.name in known}
    if not values:
        return SetParametersResult(successful=True)
    try:  # all changes of a request together: a limit may depend on another parameter
        parameters: Any = schema.build(node.PARAMETERS, schema.flatten(node.parameters) | values, node.get_name())
        node.retune(parameters)
    except ParameterError as error:
        return SetParametersResult(successful=False, reason=str(error))
    node.reporter.changes(node.parameters, parameters)
    node.parameters = parameters
    return SetParametersResult(successful=True)
