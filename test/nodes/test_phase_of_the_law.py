"""The law runs half a period away from the odometry: at the start, after each step of the clock, and after a silent sensor."""

import math
from typing import Any

import numpy as np
import pytest
from driving import STATE
from stepped_node import SteppedTime

from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import controller_timing
from vessel_hsmc_ros.nodes.controller import ControllerNode
from vessel_hsmc_ros.nodes.controller_inputs import read_odometry

PERIOD = 10_000_000


class Timed:
    """A controller on clocks of the test, whose timers it does not start but notes.

    Attributes:
        fires: System time at which the timer that was made last fires, ns.
    """

    def __init__(self, bench: Any, monkeypatch: pytest.MonkeyPatch) -> None:
        self.node = bench.start(ControllerNode, lockstep=False, law="los_pid", input_timeout=0.3)
        self.time, self.offset, self.fires = SteppedTime(), 0, 0
        monkeypatch.setattr(controller_timing, "time", self.time)
        monkeypatch.setattr(self.node, "now", lambda: self.time.monotonic_ns() + self.offset)
        monkeypatch.setattr(self.node, "create_timer", self._note)
        monkeypatch.setattr(self.node, "destroy_timer", lambda _: None)
        self.node.connected = True
        self.steps = self.node._steps

    def _note(self, period: float, _callback: Any) -> None:
        self.fires = self.node.now() + round(1e9 * period)

    def odometry(self, nanoseconds: int) -> None:
        """Odometry after some time, ns, stamped with its receipt."""
        self.time.seconds += 1e-9 * nanoseconds
        self.steps._check()
        message = conv.new_odometry()
        conv.write_odometry(message, conv.time_message(self.node.now()), STATE)
        self.steps.take_odometry(read_odometry(message))

    def phase(self) -> float:
        """Time from the last odometry to the law, as a share of the period."""
        return math.fmod(self.fires - self.node.now(), PERIOD) / PERIOD


@pytest.fixture
def made(bench: Any, monkeypatch: pytest.MonkeyPatch) -> Timed:
    return Timed(bench, monkeypatch)


def test_after_each_step_of_the_system_clock_the_law_keeps_half_a_period_from_the_odometry(made: Timed) -> None:
    made.odometry(PERIOD)
    assert made.phase() == pytest.approx(0.5, abs=1e-3)
    rng = np.random.default_rng(4)
    for step in (*rng.uniform(-5e9, 5e9, 20), 3600e9, -86_400e9, 2e9 + 0.5 * PERIOD):
        if abs(step) < 0.6e9:
            continue
        for _ in range(3):
            made.odometry(PERIOD)
        made.offset += round(float(step))
        made.time.seconds += 1e-9 * float(rng.uniform(0.0, PERIOD))
        made.steps._check()
        made.odometry(PERIOD)
        assert made.phase() == pytest.approx(0.5, abs=1e-3), f"after a step of {1e-9 * step:.3f} s"


def test_odometry_that_returns_with_another_phase_is_followed_and_a_single_late_message_is_not(made: Timed) -> None:
    made.odometry(PERIOD)
    fires = made.fires
    made.odometry(round(1.3 * PERIOD))
    assert made.fires == fires
    for phase in (0.2, 0.5, 0.9):
        made.odometry(round((60 + phase) * PERIOD))
        assert made.phase() == pytest.approx(0.5, abs=1e-3)
