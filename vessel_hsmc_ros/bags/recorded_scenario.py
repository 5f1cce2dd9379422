"""The scenario and the parameters that a bag was recorded with."""

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import yaml

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ScenarioError
from vessel_hsmc_ros.scenario.parameters import NODES
from vessel_hsmc_ros.scenario.parameters_file import flat
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario, parse_scenario

Parameters = Mapping[str, Mapping[str, Any]]


def recorded_parameters(text: bytes) -> dict[str, dict[str, Any]]:
    """The parameters of every node by its full name, from a bag's attachment."""
    document = yaml.safe_load(text) or {}
    return {node: dict(flat(content["ros__parameters"])) for node, content in document.items()}


def recorded_scenario(
    bag: Path,
    name: str,
    text: str,
    parameters: Parameters,
    namespaces: Collection[str],
    changes: dict[str, object] | None,
) -> Scenario:
    """The scenario of a bag, from the first of three sources that it has.

    Args:
        bag: The bag's path; the last source is a params.yaml beside it.
        name: The scenario's name.
        text: The scenario attached to the bag; empty if there is none. The first source.
        parameters: The recorded parameters of every node, by its full name. The second source.
        namespaces: Those that hold a vessel.
        changes: Values by `node.parameter` that replace the recorded ones.

    Raises:
        ScenarioError: there is none, or it cannot be read.
        ParameterError: a parameter is unknown or out of range.
    """
    if text := text or _from_parameters(parameters, namespaces):
        return parse_scenario(text, name, changes)
    beside = bag.absolute().parent / "params.yaml"
    if not beside.is_file():
        raise ScenarioError(f"bag {bag} was recorded without its scenario, and {beside} does not exist")
    return load_scenario(beside, changes)


def _from_parameters(parameters: Parameters, namespaces: Collection[str]) -> str:
    """A scenario made of the nodes' own parameters; empty if the parameters of a node are missing."""
    found: dict[str, Any] = {}
    for name, values in parameters.items():
        node = name.rsplit("/", 1)[-1]
        if node in NODES and name.removesuffix(node) in (*namespaces, "/"):
            # ROS adds parameters of its own, such as use_sim_time, which a scenario does not have.
            known = schema.entries(NODES[node])
            found[node] = {"ros__parameters": {key: value for key, value in values.items() if key in known}}
    return yaml.safe_dump(found) if found.keys() == NODES.keys() else ""
