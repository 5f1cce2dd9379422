"""ROS parameters files: YAML text to flat parameters by node, and back."""

import re
from collections.abc import Collection, Iterator, Mapping
from typing import Any

import yaml

from vessel_hsmc_ros.core.exceptions import ScenarioError
from vessel_hsmc_ros.scenario.bounded_text import read_ros_yaml
from vessel_hsmc_ros.scenario.parameters import in_long_form, without_foreign_hull_data

USE_SIM_TIME = "use_sim_time"
"""A parameter that every ROS node has; it is not one of a scenario."""

FAULTS = "faults"
"""The section of a scenario with scripted faults, which is not of a node."""


def read_parameters(
    text: str, nodes: Mapping[str, Collection[str]], source: str, namespace: str | None = None
) -> dict[str, dict[str, object]]:
    """Read the parameters of nodes from a ROS parameters file.

    As in ROS, sections further down override those above, and `/**` stands for all nodes. There the hull data below `vessel.`
    may be given once for all: each node takes those that it declares. `nodes`: the names of the nodes, in whatever namespace,
    with the names of their parameters. `namespace`: of the vessel, where sections for others are to be left out.

    Raises:
        ScenarioError: the text is not a ROS parameters file, or has a section for another node.
        ParameterError: no node has hull data of such a name.
    """
    try:
        document = read_ros_yaml(text)
    except yaml.YAMLError as error:
        raise ScenarioError(f"{source} cannot be read: {in_one_line(error)}") from None
    if not isinstance(document, dict):
        raise ScenarioError(f"{source} is not a ROS parameters file: it takes node names at its top level")
    values: dict[str, dict[str, object]] = {node: {} for node in nodes}
    for section, content in document.items():
        if section == FAULTS:
            continue
        nested = content.get("ros__parameters") if isinstance(content, dict) else None
        if not isinstance(nested, dict):
            raise ScenarioError(f"{source}: section {section} has no ros__parameters")
        parameters = in_long_form(dict(flat(nested)))
        parameters.pop(USE_SIM_TIME, None)
        addressed = _nodes_of_section(str(section), list(nodes), source) if _is_for(str(section), namespace) else ()
        for node in addressed:
            shared = len(addressed) > 1
            values[node].update(without_foreign_hull_data(parameters, nodes[node]) if shared else parameters)
    return values


def dump_parameters(values: Mapping[str, Mapping[str, object]], namespace: str = "/**") -> str:
    """Write the flat parameters of nodes as a ROS parameters file, valid in every namespace unless one is given."""
    # The wildcard matches the node in every namespace, so that the file can be used for a second vessel too.
    document = {f"{namespace}/{node}": {"ros__parameters": tree(parameters)} for node, parameters in values.items()}
    return yaml.safe_dump(document, sort_keys=False) if document else ""


def tree(values: Mapping[str, object]) -> dict[str, Any]:
    """Nest values by dotted names as a ROS parameters file does."""
    nested: dict[str, Any] = {}
    for name, value in values.items():
        *groups, leaf = name.split(".")
        branch = nested
        for part in groups:
            branch = branch.setdefault(part, {})
        branch[leaf] = list(value) if isinstance(value, tuple) else value
    return nested


def flat(nested: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted names and values of nested parameters."""
    for key, value in nested.items():
        if isinstance(value, Mapping):
            yield from flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def in_one_line(error: Exception) -> str:
    """The message of an error without its line breaks, its number and file, and PyYAML's name for a text in memory."""
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    return re.sub(r' in "<[a-z]+ string>",', ",", " ".join(str(error).split()))


def _is_for(section: str, namespace: str | None) -> bool:
    """Whether a section is for nodes of a namespace; True where either names none."""
    of = section.rpartition("/")[0].strip("/")
    return not namespace or not of or "*" in of or of == namespace.strip("/")


def _nodes_of_section(section: str, nodes: list[str], source: str) -> list[str]:
    # Only the last part of a fully qualified node name matters here: the file of one vessel has one namespace at most.
    node = section.rsplit("/", 1)[-1]
    if node in ("*", "**"):
        return nodes
    if node not in nodes:
        raise ScenarioError(f"{source}: section {section} names no node: it takes /** or one of {', '.join(nodes)}")
    return [node]
