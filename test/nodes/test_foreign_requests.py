"""Requests that rclpy's own services cannot serve: refused, and the node goes on."""

from typing import Any

import pytest
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import SetParameters

from vessel_hsmc_ros.nodes.controller import ControllerNode
from vessel_hsmc_ros.nodes.reference_ship import ReferenceShipNode
from vessel_sim_node.node import VesselSimNode


@pytest.mark.parametrize("kind", [ControllerNode, ReferenceShipNode, VesselSimNode])
def test_a_parameter_of_an_unknown_type_is_refused_and_the_node_goes_on(bench: Any, kind: Any) -> None:
    node = bench.start(kind, lockstep=False)
    unknown = Parameter(name="lockstep", value=ParameterValue(type=99))
    answer = bench.call(SetParameters, f"/{kind.NAME}/set_parameters", SetParameters.Request(parameters=[unknown]))
    assert answer.results == []
    assert not node.parameters.lockstep
    assert not bench.set_parameters(kind.NAME, lockstep=True).successful
