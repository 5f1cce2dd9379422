"""Goals of actions: each has one result, with its reason."""

from typing import Any

import pytest
from drawn_tasks import Sequence

from vessel_hsmc_ros.core.exceptions import RefusalError
from vessel_hsmc_ros.guidance.tasks import Code, Done, Goal, Limits, Order, Report, Sail, Sight, Tasks

pytestmark = pytest.mark.pure
ONE, OTHER = Goal(1), Goal(2)


def sailing(**limits: Any) -> Tasks:
    """Tasks that sail ONE."""
    tasks = Tasks(Limits(1.0, 10.0, 3.0)._replace(**limits))
    assert tasks.offer(ONE) == [Sail(ONE)]
    assert tasks.sailed(ONE) == []
    return tasks


def test_drawn_sequences_give_each_goal_one_result_and_each_fault_its_reason() -> None:
    codes = set()
    for seed in range(400):
        drawn = Sequence(seed)
        drawn.run(40)
        codes |= set(drawn.results)
    assert codes == set(Code)


def test_the_vessel_has_to_come_to_the_end_not_the_reference() -> None:
    tasks = sailing()
    assert tasks.tick(Sight(0.0, 0.5, arrived=False)) == [Report(ONE)]  # a path that passes its end before it is sailed
    assert tasks.tick(Sight(1.0, 5.0, arrived=True)) == [Report(ONE)]
    (done,) = tasks.tick(Sight(2.0, 0.9, arrived=True))
    assert isinstance(done, Done)
    assert (done.code, done.text) == (Code.REACHED, "reached: the vessel is 0.90 m from the end, within 1.00 m")


def test_a_vessel_that_comes_no_nearer_has_not_reached_its_goal() -> None:
    tasks = sailing()
    for second in range(40):  # it comes nearer for 20 s
        (output, *orders) = tasks.tick(Sight(float(second), max(30.0 - second, 10.0), arrived=True))
        if isinstance(output, Done):
            break
    assert second == 31
    assert output == Done(
        ONE, Code.NOT_REACHED, "the reference has arrived, the vessel has not: within 10 s it has not come nearer than 10.00 m"
    )
    assert orders == [Order.HOLD]


def test_a_newer_goal_ends_the_older_one_once_its_way_is_planned() -> None:
    tasks = sailing()
    assert tasks.offer(OTHER) == [Sail(OTHER)]
    assert tasks.tick(Sight(0.0, 9.0, arrived=False)) == [Report(ONE)]
    assert tasks.sailed(OTHER) == [Done(ONE, Code.PREEMPTED, "a newer goal took its place")]
    assert tasks.tick(Sight(1.0, 9.0, arrived=False)) == [Report(OTHER)]


def test_a_newer_goal_that_cannot_be_sailed_leaves_the_older_one_alone() -> None:
    tasks = sailing()
    tasks.offer(OTHER)
    assert tasks.failed(OTHER, "corner 2 has no room") == [Done(OTHER, Code.REFUSED, "corner 2 has no room")]
    assert tasks.tick(Sight(0.0, 9.0, arrived=False)) == [Report(ONE)]


def test_a_short_safe_action_ends_no_goal_and_a_long_one_does_with_its_reason() -> None:
    tasks = sailing()
    for second in range(10):  # every gap is short
        tasks.controller("", "OVERDUE" if second % 3 else "")
        assert tasks.tick(Sight(float(second), 9.0, arrived=False)) == [Report(ONE)]
    assert tasks.recoveries == 3
    tasks.controller("", "OVERDUE")
    tasks.tick(Sight(20.0, 9.0, arrived=False))
    done, order = tasks.tick(Sight(24.0, 9.0, arrived=False))
    assert done == Done(
        ONE,
        Code.CONTROLLER,
        "controller in its safe action for more than 3 s: OVERDUE: the vessel comes to rest and keeps station",
    )
    assert order is Order.HOLD


@pytest.mark.parametrize(("at_end", "order"), [("hold", []), ("stop", [Order.STOP]), ("return", [Order.RETURN])])
def test_the_end_of_a_mission_is_followed_by_what_is_declared(at_end: str, order: list[Order]) -> None:
    tasks = sailing(at_end=at_end)
    done, *orders = tasks.tick(Sight(0.0, 0.0, arrived=True))
    assert isinstance(done, Done)
    assert orders == order


def test_a_pose_that_is_reached_is_no_end_of_a_mission() -> None:
    tasks, pose = Tasks(Limits(1.0, 10.0, 3.0, "return")), Goal(3, is_mission=False)
    tasks.offer(pose)
    tasks.sailed(pose)
    assert len(tasks.tick(Sight(0.0, 0.0, arrived=True))) == 1


def test_a_low_battery_ends_every_goal_once_and_refuses_the_next() -> None:
    tasks = sailing()
    low = "battery at 12 %, below 20 %"
    assert tasks.block("battery", low, "return") == [Done(ONE, Code.ENDED, f"{low}: the vessel returns"), Order.RETURN]
    assert tasks.block("battery", low, "return") == []
    assert tasks.offer(OTHER) == [Done(OTHER, Code.REFUSED, low)]
    tasks.unblock("battery")
    assert tasks.offer(OTHER) == [Sail(OTHER)]


def test_a_goal_that_is_held_is_judged_again_after_it_goes_on() -> None:
    tasks = sailing()
    assert tasks.hold() == [Order.HOLD]
    assert tasks.tick(Sight(100.0, 0.0, arrived=True)) == [Report(ONE)]
    assert tasks.offer(OTHER)[0].code is Code.REFUSED  # type: ignore[union-attr]
    assert tasks.go_on() == [Order.GO_ON]
    with pytest.raises(RefusalError, match="nothing is held"):
        tasks.go_on()
    assert isinstance(tasks.tick(Sight(101.0, 0.0, arrived=True))[0], Done)
