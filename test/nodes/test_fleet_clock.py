"""The barrier of a fleet: the owner of /clock waits for its followers, a follower for the next tick."""

from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import WrenchStamped
from rosgraph_msgs.msg import Clock

from vessel_hsmc_ros.messages import conversions
from vessel_sim_node.drives import BEFORE_START, FleetClock

STEP = 10_000_000
SECOND, THIRD = "/second/applied_wrench", "/third/applied_wrench"


class Plant:
    """Stands in for the node of a plant: keeps its subscriptions and knows which topics have publishers."""

    def __init__(self) -> None:
        self.callbacks: dict[str, Callable[[Any], None]] = {}
        self.published = {"/clock", SECOND, THIRD}

    def listen(self, _kind: Any, topic: str, callback: Callable[[Any], None], _profile: Any) -> None:
        self.callbacks[topic] = callback

    def count_publishers(self, topic: str) -> int:
        return int(topic in self.published)

    def finish(self, topic: str, stamp: int) -> None:
        """A follower has finished a step."""
        message = WrenchStamped()
        message.header.stamp = conversions.time_message(stamp)
        self.callbacks[topic](message)

    def tick(self, stamp: int) -> None:
        """The owner has published a tick."""
        self.callbacks["/clock"](Clock(clock=conversions.time_message(stamp)))


def owner() -> tuple[Plant, FleetClock, list[str]]:
    plant: Any = Plant()
    return plant, FleetClock(plant, ("second", "third")), []


def follower() -> tuple[Plant, FleetClock, list[str]]:
    plant: Any = Plant()
    return plant, FleetClock(plant, ()), []


def test_the_owner_begins_the_first_step_at_once() -> None:
    _, clock, begun = owner()
    clock.wait(BEFORE_START, 0, lambda: begun.append("step 0"))
    assert begun == ["step 0"]


def test_the_owner_takes_a_step_when_every_follower_has_finished_the_last_one() -> None:
    plant, clock, begun = owner()
    clock.wait(0, STEP, lambda: begun.append("step 1"))
    plant.finish(SECOND, 0)
    assert not begun
    plant.finish(THIRD, 0)
    assert begun == ["step 1"]


def test_a_follower_that_is_done_first_is_not_waited_for() -> None:
    plant, clock, begun = owner()
    for topic in (SECOND, THIRD):
        plant.finish(topic, 0)
    clock.wait(0, STEP, lambda: begun.append("step 1"))
    assert begun == ["step 1"]


def test_a_follower_takes_each_step_at_its_tick_and_once() -> None:
    plant, clock, begun = follower()
    clock.wait(BEFORE_START, 0, lambda: begun.append("step 0"))
    assert not begun
    plant.tick(0)
    clock.wait(0, STEP, lambda: begun.append("step 1"))
    plant.tick(0)
    assert begun == ["step 0"]
    plant.tick(STEP)
    plant.tick(STEP)
    assert begun == ["step 0", "step 1"]


def test_the_owner_ends_after_its_followers() -> None:
    plant, clock, ended = owner()
    plant.finish(SECOND, STEP)
    clock.wait_for_end(STEP, lambda: ended.append("end"))
    assert not ended
    plant.finish(THIRD, STEP)
    assert ended == ["end"]


def test_a_follower_ends_at_once() -> None:
    _, clock, ended = follower()
    clock.wait_for_end(STEP, lambda: ended.append("end"))
    assert ended == ["end"]


def test_the_plant_that_is_waited_for_and_gone_is_named() -> None:
    plant, clock, _ = owner()
    plant.finish(SECOND, 0)
    clock.wait(0, STEP, lambda: None)
    assert clock.waiting
    assert not clock.lost()
    plant.published = {"/clock"}  # the second has finished its step: it is not what the owner waits for
    assert clock.lost() == THIRD
