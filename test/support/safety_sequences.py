"""Random sequences of messages, law values and operator commands, driven through the checks of both inputs and the supervision.

A sequence is a string of bytes: the first chooses the safe action and the kind of law, each further group of four is a control
period. What a message must be is known by its kind, so that refused data cannot pass as accepted data unnoticed.
"""

import math
from collections.abc import Callable, Iterator
from typing import Any

from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.safety.freshness import Freshness, Sample
from vessel_hsmc_ros.safety.parameters import ACTIONS, FreshnessParameters, SafetyParameters
from vessel_hsmc_ros.safety.plausibility import Jumps, Verdict
from vessel_hsmc_ros.safety.reasons import Operation, Reason
from vessel_hsmc_ros.safety.safe_action import Authority
from vessel_hsmc_ros.safety.supervision import Supervision

PERIOD = 100_000_000
"""Control period, ns."""

TIMEOUT, RAMP_TIME, LENGTH = 0.25, 0.5, 10.0
LIMITS = (1000.0, 700.0)
RATES = (LIMITS[0] / RAMP_TIME, LIMITS[1] / RAMP_TIME)
SECOND = 1_000_000_000

MESSAGES = ("good", "none", "duplicate", "old", "ahead", "reordered", "frame", "nan", "uncertain", "jump", "infinite", "twice")
WRENCHES = ("small", "large", "other side", "none", "nan", "over", "huge", "slow")
LAW = {
    "small": (0.1 * LIMITS[0], -0.1 * LIMITS[1]),
    "large": LIMITS,
    "other side": (-LIMITS[0], -LIMITS[1]),
    "nan": (math.nan, 1.0),
    "over": (1.5 * LIMITS[0], 0.0),
    "huge": (-1e300, math.inf),
}

ORDERS = ("stop", "rearm", "activate", "standby", "handover", "not ready", "reset", "step back")
BAD: dict[str, Callable[[int], dict[str, Any]]] = {
    "old": lambda now: {"stamp": now - round(TIMEOUT * SECOND) - 1},
    "ahead": lambda now: {"stamp": now + round(0.1 * SECOND) + 1},
    "frame": lambda _: {"frame": "map"},
    "nan": lambda _: {"values": (math.nan, 0.0, 0.0, 1.0, 0.0, 0.0)},
    "infinite": lambda _: {"values": (0.0, 0.0, 0.0, 1.0, 0.0, -math.inf)},
    "uncertain": lambda now: {"covariance": math.nan if now % 3 else 5.0},
}
"""What makes a good message of a time one that is never taken."""

BOUND_TO_ACTIVE = 24
"""Good control periods after which the law commands again, whatever happened before."""


class Input:
    """One input, with the kinds of its messages."""

    def __init__(self) -> None:
        self.fresh = Freshness(TIMEOUT, FreshnessParameters(covariance_limit=4.0), "odom", "base_link")
        self.jumps = Jumps(SafetyParameters(jump_samples=3), LENGTH)
        self.taken: list[int] = []
        self.place = 0.0

    def messages(self, kind: str, now: int) -> Iterator[tuple[Sample, bool | None]]:
        """The messages of a kind; and whether each must be taken, None where that depends on the past."""
        good = Sample(now - PERIOD // 4, "odom", "base_link", (self.place, 0.0, 0.0, 1.0, 0.0, 0.0), 1.0)
        last = self.fresh.last
        after = True if last is None or good.stamp > last else None
        # A jump has another place for good: it has to be taken after some samples. The other kinds are never taken.
        if kind == "jump":
            self.place = 1e6 - self.place
            good = good._replace(values=(self.place, *good.values[1:]))
        if kind in ("good", "jump", "twice"):
            yield good, after
        if kind == "twice":
            yield good, False
        if kind == "duplicate" and last is not None:
            yield good._replace(stamp=last), False
        if kind == "reordered" and last is not None:
            yield good._replace(stamp=last - 1), False
        if kind in BAD:
            yield good._replace(**BAD[kind](now)), False

    def receive(self, kind: str, now: int) -> bool:
        """Check the messages of a kind; returns whether one was taken as a re-localisation."""
        moved = False
        for sample, expected in self.messages(kind, now):
            before = self.fresh.last
            reason = self.fresh.accept(sample, now, now)
            assert expected is None or (reason is Reason.NONE) is expected, (kind, reason)
            if reason is Reason.NONE:
                assert before is None or sample.stamp > before, "the order of what is taken is that of the stamps"
                assert all(map(math.isfinite, sample.values))
                self.taken.append(sample.stamp)
                verdict = self.jumps.check(sample.stamp, Motion(*sample.values))
                moved = moved or verdict is Verdict.RELOCALISED
        return moved


class Machine:
    """A controller without a law: what reaches the supervision is drawn.

    Args:
        choice: Chooses the safe action.
        bounded: Whether the law keeps to the limits.
    """

    def __init__(self, choice: int, bounded: bool) -> None:
        self.action = ACTIONS[choice % len(ACTIONS)]
        p = SafetyParameters(action=self.action, ramp_time=RAMP_TIME, hold_time=0.3, jump_samples=3)
        self.supervision = Supervision(p, Authority(LIMITS, (120.0, 900.0), bounded), active=choice % 2 == 0)
        self.bounded = bounded
        self.inputs = (Input(), Input())
        self.now = 10 * SECOND
        self.stopped = False

    def order(self, name: str) -> None:
        """Carry out what a person commands, and what happens to clock and law."""
        s = self.supervision
        if name == "stop":
            s.stop()
            self.stopped = True
        elif name == "rearm":
            s.rearm()
            self.stopped = False
        elif name in ("activate", "not ready"):
            refused = s.activate(Reason.NOT_READY if name == "not ready" else Reason.NONE)
            assert not self.stopped or refused is Reason.IN_STOP
        elif name == "standby":
            assert not self.stopped or s.standby() is Reason.IN_STOP
        elif name == "handover":
            s.handover()
        elif name == "step back":
            self.now -= 3 * SECOND
        if name in ("reset", "step back"):
            for each in self.inputs:
                each.fresh.reset()
                each.jumps.reset()

    def wrench(self, kind: str) -> tuple[float, float] | None:
        """The wrench of the law."""
        return (1.0 + self.now * 1e-10, 2.0) if kind == "slow" else LAW.get(kind)

    def step(self, odometry: str, reference: str, wrench: str) -> None:
        """A control period, with every property that must hold at its end."""
        s, before = self.supervision, self.supervision.command
        was, handing_over = s.operation, s._handing_over is not None
        moved = [each.receive(kind, self.now) for each, kind in zip(self.inputs, (odometry, reference), strict=True)]
        if any(moved):
            s.handover()
            handing_over = True
        faults = [each.fresh.overdue(self.now, self.now) for each in self.inputs]
        fault = next((f for f in faults if f), Reason.NONE)
        wanted = None if fault else self.wrench(wrench)
        motion = (1.0, -0.01) if not faults[0] else None
        command = s.step(wanted, fault, PERIOD * 1e-9, motion, (0.5 * LIMITS[0], math.nan if wrench == "nan" else 0.0))
        self.check(before, command, was, handing_over, wanted)
        self.now += PERIOD

    def check(
        self,
        before: tuple[float, float],
        command: tuple[float, float],
        was: Operation,
        handing_over: bool,
        wanted: tuple[float, float] | None,
    ) -> None:
        """The properties of a command."""
        s = self.supervision
        own = s.operation is Operation.ACTIVE and s.reason is Reason.NONE
        assert all(map(math.isfinite, command))
        if self.bounded or not own:
            assert all(abs(c) <= limit for c, limit in zip(command, LIMITS, strict=True)), command
        assert (s.operation is Operation.STOPPED) is self.stopped, "stop holds until rearm"
        if s.operation in (Operation.STOPPED, Operation.STANDBY):
            assert command == (0.0, 0.0)
        elif wanted is None or not all(map(math.isfinite, wanted)):
            assert s.operation is Operation.SAFE, "no command comes from refused data"
        if s.operation is Operation.SAFE:
            assert s.reason is not Reason.NONE
        if own:
            assert command == wanted
        if own and was is Operation.ACTIVE and not handing_over:
            return  # the law's own change
        if own and not self.bounded:
            return  # the end of a handover to a law beyond the limits
        at_once = s.operation in (Operation.STOPPED, Operation.STANDBY) or (
            s.operation is Operation.SAFE and self.action == "zero"
        )
        for a, b, limit, rate in zip(before, command, LIMITS, RATES, strict=True):
            start = max(-limit, min(limit, a))
            assert at_once or abs(b - start) <= rate * (PERIOD * 1e-9), (before, command, s.operation, s.reason)


def drive(data: bytes) -> Machine:
    """Drive a sequence, then good periods until the law commands; the assertions are the properties."""
    head, body = data[:1] or b"\0", data[1:]
    machine = Machine(head[0] & 15, head[0] < 192)
    for start in range(0, len(body) - 3, 4):
        odometry, reference, wrench, order = body[start : start + 4]
        # Half of all messages are good, and half of all periods are without an order.
        names = [MESSAGES[code % len(MESSAGES)] if code & 128 else "good" for code in (odometry, reference)]
        if order & 192 == 192:
            machine.order(ORDERS[order % len(ORDERS)])
        machine.step(names[0], names[1], WRENCHES[wrench % len(WRENCHES)] if wrench & 64 else "slow")
    machine.order("rearm")
    machine.order("activate")
    for _ in range(BOUND_TO_ACTIVE):
        machine.step("good", "good", "slow")
    s = machine.supervision
    assert (s.operation, s.reason) == (Operation.ACTIVE, Reason.NONE), "good data lead back to the law"
    return machine
