"""Changes to a scenario: values by `node.parameter`, sorted by node."""

from collections.abc import Mapping

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.scenario.parameters import NODES, in_long_form, without_foreign_hull_data
from vessel_hsmc_ros.scenario.vessels import with_vessel


def by_node(changes: Mapping[str, object]) -> dict[str, dict[str, object]]:
    """Sort values by `node.parameter`, or `vessel.parameter` for every node that declares it, by node and parameter.

    The values of a vessel by name come with it.

    Raises:
        ParameterError: there is no such node, or no node has hull data of such a name.
        ScenarioError: a vessel by name cannot be read.
    """
    values: dict[str, dict[str, object]] = {node: {} for node in NODES}
    for key, value in in_long_form(changes).items():
        node, _, parameter = key.partition(".")
        if parameter and node == "vessel":
            declaring = [each for each, cls in NODES.items() if key in schema.entries(cls)]
            if not declaring:
                without_foreign_hull_data({key: value}, ())  # raises the error that suggests a name
            for each in declaring:
                values[each][key] = value
        elif parameter and node in NODES:
            values[node][parameter] = value
        else:
            nodes = f"{', '.join(NODES)}, or vessel.parameter for all nodes"
            raise ParameterError(f"{key} is not a parameter: it takes node.parameter with a node of {nodes}")
    return {node: with_vessel(changed, schema.entries(NODES[node])) for node, changed in values.items()}


def full_names(values: Mapping[str, Mapping[str, object]]) -> frozenset[str]:
    """The names `node.parameter` of values by node and parameter."""
    return frozenset(f"{node}.{parameter}" for node in values for parameter in values[node])
