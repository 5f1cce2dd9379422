"""Fault scripts that are checked against the scenario in which they are carried out."""

import dataclasses
from pathlib import Path

from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.core.node_list import taking_part
from vessel_hsmc_ros.faults import TOPICS, FaultScript, check_mode, check_target
from vessel_hsmc_ros.messages.raw import check_field
from vessel_hsmc_ros.messages.topics import message_type
from vessel_hsmc_ros.scenario.bounded_text import read_text
from vessel_hsmc_ros.scenario.fault_script import parse_script
from vessel_hsmc_ros.scenario.parameters_file import in_one_line
from vessel_hsmc_ros.scenario.scenario import Scenario, check_late_odometry


def load_script(path: Path) -> FaultScript:
    """Read a fault script.

    Raises ScenarioError if the file cannot be read, or is not a fault script; ParameterError if a setting is unknown, missing
    or out of range.
    """
    try:
        text = read_text(path)
    except (OSError, UnicodeDecodeError) as error:
        raise ScenarioError(f"fault script {path} cannot be read: {in_one_line(error)}") from None
    return parse_script(text, f"fault script {path}")


def relayed_topics(scenario: Scenario) -> tuple[str, ...]:
    """The topics that pass through the relay in a scenario."""
    demands = tuple(topic for topic, *_ in scenario.vessel_sim.vessel.thrusters.topics() if scenario.vessel_sim.by_thrusters)
    return (*TOPICS, *demands)


def check_script(script: FaultScript, scenario: Scenario) -> None:
    """Check that every fault can be carried out in a scenario.

    Raises ParameterError if a topic, a node or a field does not exist, or a kind does not fit the mode; ScenarioError as
    `check_late_odometry`.
    """
    check_late_odometry(dataclasses.replace(scenario, faults=script))
    topics, nodes = relayed_topics(scenario), taking_part(scenario.vessel_sim.by_thrusters)
    duration = scenario.vessel_sim.duration
    for index, fault in enumerate(script.faults):
        owner = f"faults[{index}]"
        check_target(fault, topics, nodes, owner)
        check_mode(fault, scenario.controller.lockstep, owner)
        if fault.field:
            check_field(message_type(fault.topic), fault.field, f"{owner}.field")
        if duration and fault.at > duration:
            raise ParameterError(f"{owner}.at must be at most {duration:g} s, the end of the run (got {fault.at:g} s)")
