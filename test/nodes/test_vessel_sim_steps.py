"""The plant's node step by step: demands of thrusters of two publishers or that fall silent, and pauses, again and again."""

from dataclasses import replace
from typing import Any

import pytest
from geometry_msgs.msg import WrenchStamped
from std_msgs.msg import Float64
from stepped_node import SteppedNode
from thruster_layouts import layout

from vessel_hsmc_ros.core.exceptions import SimulationError
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import commands
from vessel_sim_node import drives, node
from vessel_sim_node.node import VesselSimNode

PERIOD, TIMEOUT = 0.05, 0.3
MODULES = (node, drives, commands)


class Plant(SteppedNode):
    """A plant in real time, which is driven by two propellers or by a wrench."""

    def __init__(self, bench: Any, monkeypatch: pytest.MonkeyPatch, by_thrusters: bool, **parameters: Any) -> None:
        more = {"actuators__kind": "thrusters", **layout("twin")} if by_thrusters else {}
        given = {"rate_hz": 1.0 / PERIOD, "command_timeout": TIMEOUT, **more, **parameters}
        super().__init__(bench, monkeypatch, VesselSimNode, MODULES, **given)
        self.node.on_connected()

    def run(self, steps: int, **demands: float) -> list[float]:
        """Some periods with demands by the name of the thruster, or with a force; returns the applied surge forces."""
        count = len(self.sent)
        for _ in range(steps):
            self.wait(PERIOD)
            for name, value in demands.items():
                if name == "force":
                    self.node._drive._on_command(self.wrench(value, 0.0))
                else:
                    self.node._drive._on_demand(f"thrusters/{name}/thrust", Float64(data=value))
            self.node._on_timer()
        messages = [message for topic, message in self.sent[count:] if topic == "applied_wrench"]
        return [conv.read_wrench(message)[0] for message in messages if isinstance(message, WrenchStamped)]


def test_while_two_nodes_demand_the_thrust_of_one_thruster_none_is_given_and_then_again(
    bench: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = Plant(bench, monkeypatch, by_thrusters=True)
    shared = [""]
    monkeypatch.setattr(made.node.connections, "shared", lambda *_: shared[0])
    for _ in range(2):
        assert made.run(3, left=10.0, right=20.0)[-1] == pytest.approx(30.0)
        shared[0] = "/thrusters/left/thrust has 2 publishers"
        assert made.run(3, left=10.0, right=20.0) == [0.0] * 3
        assert "2 publishers: the thrust is zero" in made.node.status()[1]
        shared[0] = ""


def test_each_thruster_whose_demands_cease_stops_for_itself_and_goes_on(bench: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    made = Plant(bench, monkeypatch, by_thrusters=True)
    for _ in range(2):
        made.run(3, left=10.0, right=20.0)
        assert made.run(12, right=20.0) == [30.0] * 6 + [20.0] * 6
        assert made.run(12, left=10.0) == [30.0] * 6 + [10.0] * 6


@pytest.mark.parametrize("by_thrusters", [False, True])
def test_after_each_step_of_the_clock_nothing_of_before_is_applied(
    bench: Any, monkeypatch: pytest.MonkeyPatch, by_thrusters: bool
) -> None:
    made = Plant(bench, monkeypatch, by_thrusters)
    demands = {"left": 10.0, "right": 20.0} if by_thrusters else {"force": 30.0}
    for leap in (-0.2, -100.0, 50.0):
        assert made.run(3, **demands)[-1] == pytest.approx(30.0)
        made.wait(leap)
        assert made.run(2)[-1] == 0.0
        assert "goes on" not in made.node.status()[1]
    assert made.run(3, **demands)[-1] == pytest.approx(30.0)


def test_each_pause_lets_no_time_pass_and_what_is_old_after_it_does_not_hold(bench: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    made = Plant(bench, monkeypatch, by_thrusters=False)
    steps = 0
    for _ in range(2):
        made.run(4, force=30.0)
        made.node._pause(True)
        made.run(40)
        made.node._pause(False)
        steps += 4
        assert made.node.status()[2]["steps"] == steps
        assert made.run(3) == [0.0] * 3
        steps += 3
    assert made.node.status()[2]["moves"] == 0


def test_each_change_of_a_frequency_leaves_the_disturbance_where_it_is(bench: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    made = Plant(bench, monkeypatch, by_thrusters=False, disturbance__periodic__frequency=0.5)
    for frequency in (0.0, 0.3, 0.0):
        made.run(40)
        p = made.node.parameters
        periodic = replace(p.disturbance.periodic, frequency=frequency)
        made.node.retune(replace(p, disturbance=replace(p.disturbance, periodic=periodic)))
        monkeypatch.setattr(made.node, "parameters", replace(p, disturbance=replace(p.disturbance, periodic=periodic)))
        made.run(2)
        forces = [conv.read_wrench(message)[0] for topic, message in made.sent if topic == "disturbance"]
        assert abs(forces[-1] - forces[-3]) < 0.05 * max(forces)


def test_in_lockstep_the_time_out_of_a_command_begins_anew_after_each_pause(bench: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    made = SteppedNode(bench, monkeypatch, VesselSimNode, MODULES, lockstep=True, command_timeout=10.0)
    made.node.on_connected()
    for _ in range(2):
        made.wait(6.0)
        made.node._check_lockstep()
        made.node._pause(True)
        made.wait(3600.0)
        made.node._check_lockstep()
        made.node._pause(False)
        made.node._check_lockstep()
        made.wait(9.9)
        made.node._check_lockstep()
        made.node._on_answer()  # of a command that is still missing: only its time counts
    made.wait(10.1)
    with pytest.raises(SimulationError, match="within 10 s"):
        made.node._check_lockstep()
