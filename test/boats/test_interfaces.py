"""The table of the stacks' interfaces, the files written from it, and the page."""

import pytest
import yaml

from vessel_hsmc_ros.boats.parameters import commands, interface, interface_text, interfaces, parameters_of
from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.node_list import LOOP, WATCHERS
from vessel_hsmc_ros.scenario.parameters import NODES
from vessel_hsmc_ros.scenario.parameters import WATCHERS as PARAMETERS_OF_WATCHERS

SHIP = KnownVessel(surge_force_limit=300.0, yaw_moment_limit=250.0, surge_inertia=546.0, yaw_inertia=1220.0)
REPEATED = ("rate_hz", "input_timeout", "form")
"""What a file states for its reader although it may be the default."""

DECLARED = {**{name: NODES[name] for name in NODES}, **PARAMETERS_OF_WATCHERS}


@pytest.mark.parametrize("name", interfaces())
def test_every_value_is_one_that_its_node_takes_and_differs_from_the_default(name: str) -> None:
    for node, values in parameters_of(interface(name), SHIP).items():
        built = schema.flatten(schema.build(DECLARED[node], values, node))
        defaults = schema.flatten(DECLARED[node]())
        assert all(built[key] != defaults[key] for key in values if key not in REPEATED)


@pytest.mark.parametrize("name", interfaces())
def test_every_node_is_one_of_the_package_and_is_started_by_a_command(name: str) -> None:
    stack = interface(name)
    assert {*stack.nodes, *stack.parameters} <= {
        "reference_ship",
        "controller",
        "thruster_allocation",
        "drive",
        "mavlink",
        "px4",
        "navsat_odom",
    }
    started = [line.split()[0] for line in commands(stack, "boat")]
    assert {"reference_ship_node", "controller_node"} <= set(started)
    assert {(LOOP | WATCHERS)[node].executable for node in {*stack.nodes, *stack.parameters}} <= set(started)
    assert stack.before
    assert stack.stop


def test_the_file_has_the_commands_and_the_limits_of_the_ship() -> None:
    text = interface_text(interface("otter"), "boat", SHIP)
    sections = yaml.safe_load(text)
    assert sections["/**/drive"]["ros__parameters"]["surge_force_limit"] == 300.0
    assert sections["/**/navsat_odom"]["ros__parameters"]["heading"] == "imu_euler"
    assert "# drive_node --ros-args --params-file boat.yaml --params-file boat_otter.yaml -r normalised_wrench:=" in text


def test_the_noise_of_a_receiver_that_is_known_is_not_replaced_by_that_of_the_stack() -> None:
    sections = [yaml.safe_load(interface_text(interface("otter"), "boat", SHIP, known)) for known in (False, True)]
    observers = [section["/**/controller"]["ros__parameters"]["observer"] for section in sections]
    assert observers == [{"enabled": True, "position_noise": 0.05}, {"enabled": True}]


def test_an_unknown_interface_is_an_error_with_the_nearest_name() -> None:
    with pytest.raises(ParameterError, match="did you mean mavros"):
        interface("mavos")
