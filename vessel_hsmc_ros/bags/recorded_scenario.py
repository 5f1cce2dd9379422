"""The scenario and the parameters that a bag was recorded with."""

from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import yaml

from vessel_hsmc_ros.control.laws import LAWS
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ScenarioError
from vessel_hsmc_ros.core.node_list import ALLOCATION
from vessel_hsmc_ros.scenario.bounded_text import read_yaml
from vessel_hsmc_ros.scenario.parameters import NODES, declared
from vessel_hsmc_ros.scenario.parameters_file import dump_parameters, flat, read_parameters
from vessel_hsmc_ros.scenario.scenario import Scenario, parse_scenario, scenario_text

Parameters = Mapping[str, Mapping[str, Any]]


def recorded_parameters(text: bytes) -> dict[str, dict[str, Any]]:
    """The parameters of every node by its full name, from a bag's attachment.

    Raises ScenarioError if the attachment is not a ROS parameters file.
    """
    try:
        document = read_yaml(text.decode()) or {}
        return {str(node): dict(flat(content["ros__parameters"])) for node, content in document.items()}
    except (yaml.YAMLError, UnicodeDecodeError, AttributeError, KeyError, TypeError) as error:
        raise ScenarioError(f"the parameters in the bag cannot be read: {error}") from None


def recorded_scenario(
    bag: Path,
    name: str,
    text: str,
    parameters: Parameters,
    namespaces: Collection[str],
    changes: dict[str, object] | None,
    any_law: bool = False,
    namespace: str | None = None,
) -> Scenario:
    """The scenario of a bag, from the first of three sources that it has.

    Args:
        bag: The bag's path; the last source is a params.yaml beside it.
        text: The scenario attached to the bag; empty if there is none. The first source.
        parameters: The recorded parameters of every node, by its full name. The second source.
        changes: Values by `node.parameter` that replace the recorded ones.
        any_law: Accept a law whose code is not known here, without its parameters.

    Raises:
        ScenarioError: there is none, or it cannot be read.
        ParameterError: a parameter is unknown or out of range.
    """
    if text := text or _from_parameters(parameters, [namespace] if namespace else namespaces):
        return _with_any_law(text, name, namespace) if any_law else parse_scenario(text, name, changes, namespace=namespace)
    beside = bag.absolute().parent / "params.yaml"
    if not beside.is_file():
        raise ScenarioError(
            f"bag {bag} was recorded without its scenario, and {beside} does not exist: recorder.scenario_file stores it"
        )
    text = scenario_text(beside)
    return parse_scenario(text, beside.stem, changes, f"scenario file {beside}", beside.parent, namespace)


def _with_any_law(text: str, name: str, namespace: str | None) -> Scenario:
    """A scenario for the evaluation of a run, which needs the name of its law but not its code."""
    values = read_parameters(text, declared(), "the bag's scenario", namespace)
    controller = values["controller"]
    law = controller.get("law")
    if not isinstance(law, str) or law in LAWS:
        return parse_scenario(text, name, namespace=namespace)
    # A stand-in that is valid at every rate takes the place of the law, while the other parameters are checked.
    values["controller"] = {key: value for key, value in controller.items() if not key.startswith(f"{law}.")} | {"law": "pd"}
    scenario = parse_scenario(dump_parameters(values), name)
    return replace(scenario, controller=replace(scenario.controller, law=law))


def _from_parameters(parameters: Parameters, namespaces: Collection[str]) -> str:
    """A scenario made of the nodes' own parameters; empty if the parameters of a node are missing."""
    found: dict[str, Any] = {}
    for name, values in parameters.items():
        node = name.rsplit("/", 1)[-1]
        if node in NODES and name.removesuffix(node) in (*namespaces, "/"):
            # ROS adds parameters of its own, such as use_sim_time, which a scenario does not have.
            known = schema.entries(NODES[node])
            found[node] = {"ros__parameters": {key: value for key, value in values.items() if key in known}}
    return yaml.safe_dump(found) if found.keys() >= NODES.keys() - {ALLOCATION} else ""
