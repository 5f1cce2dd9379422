"""The controller in lockstep with inputs that are missing or refused: every step is answered, and two runs are alike."""

import math
from typing import Any

import numpy as np
import pytest
from driving import STATE, STEP, Plant
from rosgraph_msgs.msg import Clock
from vessel_hsmc_msgs.msg import ControlState

from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.controller import ControllerNode

NOTHING = np.full(6, math.nan)


class Steps:
    """Steps of a plant whose messages a relay alters."""

    def __init__(self, bench: Any, plant: Plant) -> None:
        self.bench, self.plant, self.step = bench, plant, 0
        self.clock = bench.probe.create_publisher(Clock, "/clock", qos.CLOCK)
        settings = {"law": "guided", "ride_through": True, "input_timeout": 0.05, "safety__ramp_time": 0.1}
        plant.connect(bench.start(ControllerNode, **settings))

    def nothing(self, topic: str) -> None:
        stamp = conv.time_message(self.step * STEP)
        if topic == "odom":
            odometry = conv.new_odometry()
            conv.write_odometry(odometry, stamp, NOTHING)
            odometry.header.frame_id = ""
            self.plant.odometry.publish(odometry)
        else:
            reference = conv.new_reference()
            conv.write_reference(reference, stamp, NOTHING, NOTHING[:3])
            reference.header.frame_id = ""
            self.plant.reference.publish(reference)

    def take(self, *missing: str) -> ControlState:
        """One step, in which topics are missing; the controller answers it."""
        if "odom" in missing:
            self.nothing("odom")
        else:
            self.plant.send_odometry(self.step * STEP)
        if "reference" in missing:
            self.nothing("reference")
        else:
            self.plant.send_reference(self.step * STEP)
        self.clock.publish(Clock(clock=conv.time_message(self.step * STEP)))
        self.step += 1
        self.bench.until(lambda: len(self.plant.states) == len(self.plant.commands) == self.step)
        return self.plant.states[-1]


@pytest.fixture
def steps(bench: Any, plant: Plant) -> Steps:
    return Steps(bench, plant)


@pytest.mark.parametrize("topic", ["odom", "reference"])
def test_a_missing_input_leads_to_the_safe_action_after_its_timeout_and_back(steps: Steps, topic: str) -> None:
    for _ in range(5):
        assert (steps.take().operation, steps.plant.states[-1].reason) == (ControlState.ACTIVE, ControlState.NONE)
    operations = [steps.take(topic).operation for _ in range(10)]
    assert operations == [ControlState.ACTIVE] * 5 + [ControlState.SAFE] * 5, "the last sample counts for 0.05 s"
    for _ in range(20):
        steps.take()
    assert (steps.plant.states[-1].operation, steps.plant.states[-1].reason) == (ControlState.ACTIVE, ControlState.NONE)
    safe = np.array(steps.plant.wrenches())[9:30]
    assert (np.abs(np.diff(safe, axis=0)) <= np.array([2e5, 3e6]) / 0.1 * 0.01 * (1.0 + 1e-9)).all()


def test_messages_that_a_relay_delays_count_by_their_stamps(steps: Steps) -> None:
    steps.take()
    steps.plant.send_odometry(0, STATE + 0.01)  # a duplicate of step 0, which arrives during step 1
    steps.take("odom")
    steps.plant.send_odometry(1 * STEP, STATE + 0.02)  # step 1's own, one step late
    state = steps.take("odom")
    assert state.operation == ControlState.ACTIVE
    steps.plant.send_odometry(3000 * STEP)  # a stamp 30 s ahead
    assert steps.take("odom").operation == ControlState.ACTIVE
    assert steps.plant.stamps() == [k * STEP for k in range(4)]


def test_inputs_that_are_ahead_of_their_step_wait_for_it(steps: Steps) -> None:
    """The reference ship is one period ahead of the plant."""
    steps.plant.send_reference(0)
    for step in range(6):
        steps.plant.send_reference((step + 1) * STEP)
        steps.plant.send_odometry(step * STEP)
        steps.clock.publish(Clock(clock=conv.time_message(step * STEP)))
        steps.bench.until(lambda step=step: len(steps.plant.states) == step + 1)
    assert steps.plant.stamps() == [k * STEP for k in range(6)]
    assert {state.operation for state in steps.plant.states} == {ControlState.ACTIVE}
