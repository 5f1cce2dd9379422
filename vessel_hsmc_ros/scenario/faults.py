"""Fault scripts: YAML text to faults that are checked against a scenario, and back."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.core.node_list import taking_part
from vessel_hsmc_ros.faults.fault import TOPICS, Fault, FaultScript, check_mode, check_settings, check_target
from vessel_hsmc_ros.messages.edits import check_field
from vessel_hsmc_ros.messages.topics import message_type
from vessel_hsmc_ros.scenario.parameters_file import in_one_line, read_yaml
from vessel_hsmc_ros.scenario.scenario import Scenario

MOST_FAULTS = 1000
"""Faults of a script at most."""


def load_script(path: Path, scenario: Scenario) -> FaultScript:
    """Read a fault script and check it against the scenario in which it is carried out.

    Raises:
        ScenarioError: the file cannot be read, or is not a fault script.
        ParameterError: a setting is unknown, missing or out of range, or does not fit the scenario.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ScenarioError(f"fault script {path} cannot be read: {in_one_line(error)}") from None
    script = parse_script(text, f"fault script {path}")
    check_script(script, scenario)
    return script


def parse_script(text: str, source: str) -> FaultScript:
    """Make a script from its text.

    Args:
        text: The content of the file.
        source: Where it comes from, for error messages.

    Raises:
        ScenarioError: the text is not a fault script.
        ParameterError: a setting is unknown, missing or out of range.
    """
    try:
        document = read_yaml(text)
    except yaml.YAMLError as error:
        raise ScenarioError(f"{source} cannot be read: {in_one_line(error)}") from None
    if not isinstance(document, dict) or not isinstance(document.get("faults"), list):
        raise ScenarioError(f"{source} is not a fault script: it takes seed and a list named faults")
    if unknown := document.keys() - {"seed", "faults"}:
        raise ScenarioError(f"{source}: {sorted(map(str, unknown))[0]} is unknown: it takes seed and faults")
    seed, listed = document.get("seed", 0), document["faults"]
    if type(seed) is not int or not 0 <= seed < 2**32:
        raise ScenarioError(f"{source}: seed = {seed!r} is not allowed: it takes an integer from 0 to {2**32 - 1}")
    if len(listed) > MOST_FAULTS:
        raise ScenarioError(f"{source} has {len(listed)} faults: it takes at most {MOST_FAULTS}")
    return FaultScript(tuple(_fault(entry, f"faults[{index}]", source) for index, entry in enumerate(listed)), seed)


def _fault(entry: object, owner: str, source: str) -> Fault:
    if not isinstance(entry, Mapping):
        raise ScenarioError(f"{source}: {owner} = {entry!r} is not allowed: it takes settings such as at, kind and topic")
    values = {str(name): value for name, value in entry.items()}
    fault = schema.build(Fault, values, owner)
    check_settings(fault, values, owner)
    return fault


def relayed_topics(scenario: Scenario) -> tuple[str, ...]:
    """The topics that pass through the relay in a scenario."""
    demands = tuple(topic for topic, *_ in scenario.vessel_sim.vessel.thrusters.topics() if scenario.vessel_sim.by_thrusters)
    return (*TOPICS, *demands)


def check_script(script: FaultScript, scenario: Scenario) -> None:
    """Check that every fault can be carried out in a scenario.

    Raises:
        ParameterError: a topic, a node or a field does not exist, or a kind does not fit the mode.
    """
    topics, nodes = relayed_topics(scenario), taking_part(scenario.vessel_sim.by_thrusters)
    duration = scenario.vessel_sim.duration
    for index, fault in enumerate(script.faults):
        owner = f"faults[{index}]"
        check_target(fault, topics, nodes, owner)
        check_mode(fault, scenario.controller.lockstep, owner)
        if fault.field:
            check_field(message_type(fault.topic), fault.field, f"{owner}.field")
        if duration and fault.at > duration:
            raise ParameterError(f"{owner}.at = {fault.at:g} is not allowed: the run ends after {duration:g} s")


def dump_script(script: FaultScript) -> str:
    """Write a script as YAML, with the settings that differ from their defaults."""
    default = schema.flatten(Fault())
    entries: list[dict[str, Any]] = []
    for fault in script.faults:
        values = schema.flatten(fault)
        entries.append({n: v for n, v in values.items() if n in ("at", "kind") or v != default[n]})
    return yaml.safe_dump({"seed": script.seed, "faults": entries}, sort_keys=False)
