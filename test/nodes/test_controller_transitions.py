"""Lifecycle transitions that the present state does not have, and their order."""

from typing import Any

import pytest
from driving import RealTimePlant
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from std_srvs.srv import Trigger
from vessel_hsmc_msgs.msg import ControlState

from vessel_hsmc_ros.nodes.controller import ControllerNode

CONFIGURE, CLEANUP = Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_CLEANUP
ACTIVATE, DEACTIVATE = Transition.TRANSITION_ACTIVATE, Transition.TRANSITION_DEACTIVATE
SHUTDOWN, UNKNOWN = Transition.TRANSITION_ACTIVE_SHUTDOWN, 99


@pytest.fixture
def sea(bench: Any, simulated_time: Any) -> RealTimePlant:
    return RealTimePlant(bench, simulated_time)


@pytest.fixture
def change(bench: Any) -> Any:
    """Request a transition; returns whether it took place."""

    def request(transition: int) -> bool:
        wanted = ChangeState.Request(transition=Transition(id=transition))
        return bool(bench.call(ChangeState, "/controller/change_state", wanted).success)

    return request


def test_a_transition_that_is_not_possible_is_refused_and_the_node_goes_on(sea: RealTimePlant, change: Any) -> None:
    node = sea.start(ControllerNode, law="guided")
    sea.run(0.3)
    assert [change(each) for each in (ACTIVATE, CONFIGURE, CLEANUP, UNKNOWN)] == [False] * 4
    assert node.lifecycle == "active"
    assert [change(each) for each in (DEACTIVATE, DEACTIVATE, CONFIGURE)] == [True, False, False]
    assert [change(each) for each in (CLEANUP, CLEANUP, ACTIVATE)] == [True, False, False]
    assert [change(each) for each in (CONFIGURE, ACTIVATE, SHUTDOWN)] == [True, True, True]
    assert [change(each) for each in (SHUTDOWN, CONFIGURE, ACTIVATE)] == [False] * 3
    assert node.lifecycle == "finalized"
    sea.run(0.05)
    assert sea.states[-1].operation == ControlState.STANDBY


def test_a_stop_stays_latched_through_every_transition(bench: Any, sea: RealTimePlant, change: Any) -> None:
    sea.start(ControllerNode, law="guided")
    sea.run(0.3)
    assert bench.call(Trigger, "/controller/stop", Trigger.Request()).success
    for transition in (DEACTIVATE, ACTIVATE, CLEANUP, CONFIGURE, ACTIVATE):
        change(transition)
        sea.run(0.05)
        assert (sea.states[-1].operation, sea.wrenches()[-1]) == (ControlState.STOPPED, (0.0, 0.0))
