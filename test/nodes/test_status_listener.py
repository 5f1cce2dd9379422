"""What a run hears of its nodes: the diagnostics of every vessel of a fleet, and of none outside."""

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from vessel_hsmc_ros.nodes.runs.processes import StatusListener


def status(name: str, updates: int) -> DiagnosticArray:
    values = [KeyValue(key="updates", value=str(updates))]
    return DiagnosticArray(status=[DiagnosticStatus(name=name, message="running", values=values)])


@pytest.mark.parametrize("vessels", [("first", "second"), ("second", "first")])
def test_the_nodes_of_every_vessel_of_a_fleet_are_heard(vessels: tuple[str, ...]) -> None:
    with StatusListener("", vessels) as listener:
        for name in ("first/controller", "second/controller", "third/controller", "recorder", "first/controller"):
            listener._on_status(status(name, len(listener.status)))
        assert {name: values["updates"] for name, values in listener.status.items()} == {
            "first/controller": "3",
            "second/controller": "1",
            "recorder": "2",
        }
        assert listener.heard_at.keys() == listener.status.keys()
