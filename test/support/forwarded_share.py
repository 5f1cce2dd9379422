"""The share of its command that a node passes on, computed anew, beside what the node sends in random sequences of events.

Everything that a person, a controller and an autopilot may do comes and goes with random lengths. The node commands a constant
wrench, so that what it sends is its share.
"""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple, Protocol

import numpy as np
import pytest
from vessel_hsmc_msgs.msg import ControlState

OPERATIONS = (ControlState.ACTIVE, ControlState.SAFE, ControlState.STANDBY, ControlState.STOPPED)
AT_REST = OPERATIONS[2:]

REFUSED = ("nan", "frame", "old", "future", "repeated")
"""What is wrong with commands that do not count."""

HEARTBEAT_TIMEOUT = 0.71
"""The times are no whole periods, so that no comparison is a matter of the last bit."""


class Period(NamedTuple):
    """What happens within one period.

    Attributes:
        command: "good", one of REFUSED, or empty.
        operation: What the controller reports.
        heard: Whether the autopilot is heard; the next four are its state:
        armed, mode, failsafe, restarted: Whether it is; mode is whether it takes commands in its present one.
    """

    command: str = "good"
    operation: int = ControlState.ACTIVE
    heard: bool = True
    armed: bool = True
    mode: bool = True
    failsafe: bool = False
    restarted: bool = False

    @property
    def ready(self) -> bool:
        """Whether the autopilot takes commands."""
        return self.armed and self.mode and not self.failsafe


class Node(Protocol):
    """The node under test on a clock of the test."""

    PERIOD: float

    def period(self, given: Period) -> float:
        """Let a period pass; returns the share that was sent in it, 0 if nothing was."""

    def stop(self, rearm: bool = False) -> None:
        """Call the service."""

    def change(self, **values: float) -> None:
        """Change parameters."""


@dataclass
class Expected:
    """The share that a node has to pass on.

    Attributes:
        timeout, ramp: Its parameters, s.
        is_autopilot: Whether an autopilot and the controller's operation count, or the commands alone.
    """

    timeout: float
    ramp: float
    is_autopilot: bool
    now: float = 0.0
    share: float = 0.0
    is_stopped: bool = False
    at_rest: bool = True
    taken_over: bool = False
    commanded: float = -math.inf
    heard: float = -math.inf
    was_ready: bool = False

    def period(self, length: float, given: Period) -> float:
        """The share in the next period."""
        self.now += length
        if self.is_autopilot:
            self._look()
            if given.heard:
                self.heard, self.was_ready = self.now, given.ready
                self._look()
            self.taken_over |= given.restarted and not self.at_rest
            self.at_rest = given.operation in AT_REST
            self.taken_over &= not self.at_rest
            self._look()
        if given.command == "good":
            self.commanded = self.now
        allowed = not self.is_autopilot or (self._is_ready() and not self.at_rest and not self.taken_over)
        fresh = self.now - self.commanded <= self.timeout
        change = length / self.ramp * (1.0 if fresh else -1.0)
        self.share = min(max(self.share + change, 0.0), 1.0) if allowed and not self.is_stopped else 0.0
        return self.share

    def _is_ready(self) -> bool:
        return self.was_ready and self.now - self.heard <= HEARTBEAT_TIMEOUT

    def _look(self) -> None:
        """A controller that commands an autopilot which is not ready is taken over, until it has been at rest."""
        self.taken_over |= not self.at_rest and not self._is_ready()


def compare(node: Node, seed: int, periods: int, tolerance: float, is_autopilot: bool) -> None:
    """Compare node and expectation over a random sequence.

    Args:
        node: The node, with its heartbeats' time-out HEARTBEAT_TIMEOUT.
        seed: Of the sequence.
        periods: Its length.
        tolerance: Of a share: an output may be rounded.
        is_autopilot: As in `Expected`.
    """
    rng, given = np.random.default_rng(seed), Period(operation=ControlState.STANDBY)
    expected, passed = Expected(0.31, 0.53, is_autopilot), []
    node.change(command_timeout=expected.timeout, ramp_time=expected.ramp)
    past: list[str] = []
    for _ in range(periods):
        event = _event(rng, is_autopilot)
        if event in ("stop", "rearm", "well"):
            node.stop(rearm=event != "stop")
            expected.is_stopped = event == "stop"
            expected.share *= event != "stop"
        elif event == "change":
            expected.timeout, expected.ramp = float(rng.choice([0.13, 0.31, 0.97])), float(rng.choice([0.19, 0.53, 1.3]))
            node.change(command_timeout=expected.timeout, ramp_time=expected.ramp)
        given = _after(rng, given, event)
        past.append(f"{event or '-'}: {given}")
        share = node.period(given)
        passed.append(expected.period(node.PERIOD, given))
        assert share == pytest.approx(passed[-1], abs=tolerance), "\n".join(past[-60:])
    moving = [a for a, b in pairwise(passed) if 0.0 < a != b]
    assert min(passed.count(0.0), passed.count(1.0), len(moving)) > periods // 50, "the sequence has all of it"


def _event(rng: np.random.Generator, is_autopilot: bool) -> str:
    """What begins in a period, mostly nothing; "well" ends all faults."""
    names = ["command", "stop", "rearm", "change", "well", "well"]
    names += ["operation", "heard", "heard", "heard", "armed", "mode", "failsafe", "restarted"] * is_autopilot
    return str(rng.choice(names)) if rng.random() < 0.04 else ""


def _after(rng: np.random.Generator, given: Period, event: str) -> Period:
    """What happens from an event on; faults end by themselves after a while, and a person enables the controller again."""
    well = Period(operation=ControlState.STANDBY)
    ending = str(rng.choice(["command", "heard", "armed", "mode", "failsafe"]))
    change: dict[str, object] = {"restarted": event == "restarted"}
    if event == "well":
        change = well._asdict()
    elif event == "command":
        change |= {"command": str(rng.choice(["", *REFUSED]))}
    elif event == "operation":
        change |= {"operation": int(rng.choice(OPERATIONS))}
    elif event in ("heard", "armed", "mode", "failsafe"):
        change |= {event: not getattr(given, event)}
    elif rng.random() < 0.1:
        change |= {ending: getattr(well, ending)}
    elif given.operation in AT_REST and rng.random() < 0.2:
        change |= {"operation": ControlState.ACTIVE}
    return given._replace(**change)  # type: ignore[arg-type] # each of its own type
