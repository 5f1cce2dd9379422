"""The latch of a stop by itself: what its act sees, and what follows a stop that a person takes back at once."""

from types import SimpleNamespace
from typing import Any

import pytest
from std_srvs.srv import Trigger
from stepped_node import SteppedTime

from vessel_hsmc_ros.boats import takeover
from vessel_hsmc_ros.boats.takeover import StopLatch

PERIOD, RAMP = 0.02, 1.0


class Latch:
    """A latch on a clock of the test, its services by their names, and the shares that its act has seen."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, share: float = 1.0) -> None:
        self.time = SteppedTime()
        monkeypatch.setattr(takeover, "time", self.time)
        self.services: dict[str, Any] = {}
        log = SimpleNamespace(warning=lambda _: None, info=lambda _: None)
        node: Any = SimpleNamespace(
            parameters=SimpleNamespace(ramp_time=RAMP),
            create_service=lambda _, name, serve: self.services.update({name: serve}),
            get_logger=lambda: log,
        )
        self.seen: list[float] = []
        self.latch = StopLatch(node, "the output", lambda: self.seen.append(self.latch.update(not self.latch.stopped)), share)

    def call(self, name: str) -> Any:
        return self.services[name](Trigger.Request(), Trigger.Response())

    def after(self, seconds: float, fresh: bool = True, allowed: bool = True) -> float:
        self.time.seconds += seconds
        return self.latch.update(fresh, allowed)


def test_a_stop_that_is_taken_back_before_the_next_period_begins_at_zero_too(monkeypatch: pytest.MonkeyPatch) -> None:
    made = Latch(monkeypatch)
    made.latch._act = lambda: None  # a node that sends zero by itself
    for _ in range(2):
        made.call("~/stop")
        assert made.latch.share == 0.0
        made.call("~/rearm")
        assert made.after(PERIOD) == pytest.approx(PERIOD / RAMP)
        assert made.after(2.0 * RAMP) == 1.0


def test_what_acts_on_a_stop_sees_it_each_time_also_one_that_holds_already(monkeypatch: pytest.MonkeyPatch) -> None:
    made = Latch(monkeypatch)
    for number in (1, 2, 3):
        answer = made.call("~/stop")
        assert (answer.success, answer.message) == (True, "stopped: the output is zero until ~/rearm")
        assert made.seen == [0.0] * number
        if number == 2:
            assert made.call("~/rearm").success
            assert made.after(2.0 * RAMP) == 1.0


def test_the_share_moves_with_the_time_since_the_last_look_whatever_happened_in_between(monkeypatch: pytest.MonkeyPatch) -> None:
    made = Latch(monkeypatch)
    expected = 1.0
    for seconds, fresh in ((0.1, False), (0.3, False), (0.05, True), (0.2, False), (0.01, True), (0.02, True), (0.3, False)):
        expected += seconds / RAMP if fresh else -seconds / RAMP
        assert made.after(seconds, fresh) == pytest.approx(expected)
    assert made.after(100.0, False) == 0.0
    assert made.after(PERIOD) == pytest.approx(PERIOD / RAMP), "not with the time of silence"
    assert made.after(0.3, True, allowed=False) == 0.0
    assert made.after(PERIOD) == pytest.approx(PERIOD / RAMP)
