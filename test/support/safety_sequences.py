"""Random sequences of messages, law values and operator commands, driven through the controller's own code, and their oracle.

A sequence is a string of bytes: the first chooses the safe action, the kind of law and the kind of clock, each further group of
four is a control period. The controller is the real one without rclpy (`controller_without_ros`). The oracle knows what each
message was made as, what the controller passes to the law, and what it publishes.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from controller_without_ros import ControllerWithoutRos, Pair

from vessel_hsmc_ros.control.guided.parameters import GuidedParameters
from vessel_hsmc_ros.control.safety.parameters import ACTIONS, Operation, Reason
from vessel_hsmc_ros.control.safety.samples import Sample
from vessel_hsmc_ros.core.exceptions import RefusalError
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.nodes.base import LAST_COMMANDS
from vessel_hsmc_ros.nodes.controller_inputs import Desired, Measured

PERIOD = 100_000_000
"""Control period, ns."""

SECOND = 1_000_000_000
TIMEOUT, RAMP_TIME, FRESH_SAMPLES = 0.25, 0.5, 3
LIMITS = (2e5, 3e6)
RATES = (LIMITS[0] / RAMP_TIME, LIMITS[1] / RAMP_TIME)

MESSAGES = ("good", "none", "duplicate", "old", "ahead", "reordered", "frame", "nan", "uncertain", "jump", "infinite", "twice")
WRENCHES = ("small", "large", "other side", "none", "nan", "over", "huge", "slow")
LAW = {
    "small": (0.1 * LIMITS[0], -0.1 * LIMITS[1]),
    "large": LIMITS,
    "other side": (-LIMITS[0], -LIMITS[1]),
    "nan": (math.nan, 1.0),
    "over": (1.5 * LIMITS[0], 0.0),
    "huge": (-1e300, math.inf),
    "slow": (1.0, 2.0),
}

ORDERS = ("stop", "rearm", "activate", "standby", "retune", "step ahead", "reset", "step back", "activate", "standby")
BAD: dict[str, Callable[[int], dict[str, Any]]] = {
    "old": lambda now: {"stamp": now - round(TIMEOUT * SECOND) - 1},
    "ahead": lambda now: {"stamp": now + round(0.1 * SECOND) + 1},
    "frame": lambda _: {"frame": "elsewhere"},
    "nan": lambda _: {"values": (math.nan, 0.0, 0.0, 1.0, 0.0, 0.0)},
    "infinite": lambda _: {"values": (0.0, 0.0, 0.0, 1.0, 0.0, -math.inf)},
    "uncertain": lambda now: {"covariance": math.nan if now % 3 else 5.0},
}
"""What makes a good message of a time one that is never taken."""

BOUND_TO_ACTIVE = 16
"""Good control periods after which the law commands again, whatever happened before: re-localisation, samples, and a handover."""


class Sent(NamedTuple):
    """A good message: when it was sent, in which epoch of the clock, and where its sender was."""

    at: int
    epoch: int
    place: float


class Source:
    """A sender of odometry or of the reference; each of its good messages has a number, which is its y in micrometres.

    Args:
        jumps: Whether it moves to another place at a jump.
        samples: Number of samples for which a jump is held out.

    Attributes:
        good: Its good messages by number.
        place: Where it is, m.
        believed: Where the controller must take it to be: at its first place, or at one of enough messages in a row.
        apart: Number of its last messages that are from another place.
        last, in_a_row: Stamp of the last good one, and number of good ones in a row, of this time of the clock.
    """

    def __init__(self, jumps: bool, samples: int) -> None:
        self.good: list[Sent] = []
        self.last: int | None = None
        self.place, self.in_a_row, self.apart = 0.0, 0, 0
        self.believed: float | None = None
        self._jumps, self._samples = jumps, samples

    def messages(self, kind: str, now: int, epoch: int) -> list[Sample]:
        """The messages of a kind, at a time of the clock, ns."""
        if kind == "jump" and self._jumps:
            self.place = 1e6 - self.place
        stamp, sent = now - PERIOD // 4, []
        if kind in ("good", "jump", "twice"):
            sent.append(self._sample(stamp, 1e-6 * len(self.good)))
            self.good.append(Sent(now, epoch, self.place))
            self.in_a_row += 1
            self._believe()
        if kind == "twice":
            sent.append(sent[0])
        if kind in ("duplicate", "reordered") and self.last is not None:
            sent.append(self._sample(self.last - (kind == "reordered"), -1.0))
        if kind in BAD:
            sent.append(self._sample(stamp, -1.0)._replace(**BAD[kind](now)))
            self.in_a_row = 0
        self.last = stamp if kind in ("good", "jump", "twice") else self.last
        return sent

    def forget(self) -> None:
        """Begin anew after a step of the clock: what came before counts neither as a sample nor as an earlier one."""
        self.last, self.in_a_row, self.apart, self.believed = None, 0, 0, None

    def _believe(self) -> None:
        self.apart = 0 if self.place == self.believed else self.apart + 1
        if self.believed is None or self.apart > self._samples:
            self.believed, self.apart = self.place, 0

    def _sample(self, stamp: int, y: float) -> Sample:
        return Sample(stamp, "odom", "base_link" if self._jumps else "", (self.place, y, 0.0, 1.0, 0.0, 0.0), 1.0)


class Machine:
    """The controller, its sources, and the oracle.

    Args:
        choice: Chooses safe action, kind of law, kind of clock, how jumps are judged, and whether the law commands at first.
    """

    def __init__(self, choice: int) -> None:
        self.action = ACTIONS[(choice & 15) % len(ACTIONS)]
        self.choice, self.bounded = choice, choice < 192
        safety = {"action": self.action, "ramp_time": RAMP_TIME, "hold_time": 0.3, "fresh_samples": FRESH_SAMPLES}
        settings = {f"safety.{name}": value for name, value in safety.items()}
        # After three samples the time-out has led to the safe action, after one the law still commands.
        samples = 1 if choice & 64 else 3
        settings |= {"safety.jump_samples": samples, "safety.freshness.covariance_limit": 4.0}
        settings |= {"rate_hz": SECOND / PERIOD, "input_timeout": TIMEOUT, "safety.enable_distance": math.inf}
        self.node = ControllerWithoutRos(bool(choice & 16), self.bounded, settings)
        self.node.ros_time = 1000 * SECOND
        self.odometry, self.reference = Source(True, samples), Source(False, samples)
        self.epoch, self.stepped = 0, False
        self.stopped = self.handed_over = self.forgotten = False
        self.handing_over = self.good_periods = self.zeros = 0
        self.used: dict[str, Sent] = {}

    def begin(self, active: bool) -> None:
        """The first period, after which a step of the clock can be seen; and those until the law commands, if it is to."""
        self.node.timer.start()
        self.node.timer._on_timer()
        self._pass()
        for _ in range(FRESH_SAMPLES + 2 if active else 0):
            self.order("activate")
            self.step("good", "good", "slow")

    def _pass(self) -> None:
        self.node.ros_time += PERIOD
        self.node.steady.now += PERIOD

    # -- what a person commands, and what happens to the clock ---------------------------------------------------------

    @property
    def refused(self) -> set[Reason]:
        """Why messages were refused."""
        return {reason for each in self.node.inputs.monitor._freshness.values() for reason in each.refused}

    def order(self, name: str) -> None:
        """Carry out an order through the controller's own functions."""
        node, s = self.node, self.node.loop.supervision
        if name == "stop":
            node.halt()
            assert node.take_sent()[-1:] == [(node.now(), (0.0, 0.0))], "a stop is commanded at once"
            self.stopped = True
        elif name == "rearm" and self.stopped:
            node.rearm()
            self.stopped = False
        elif name == "activate":
            self._activate()
        elif name == "standby":
            node.pause()
            assert s.operation is (Operation.STOPPED if self.stopped else Operation.STANDBY)
        elif name == "retune":
            node.loop.retune(GuidedParameters())
            self.handed_over = True
        elif name == "reset":
            node._reset()
            self.handed_over = self.forgotten = True
        elif name in ("step ahead", "step back"):
            node.ros_time += 5 * SECOND if name == "step ahead" else -3 * SECOND
            self.stepped, self.odometry.last, self.reference.last = True, None, None
            self.forgotten = name == "step back" or self.forgotten

    def _activate(self) -> None:
        was = self.node.loop.supervision.operation
        try:
            self.node.begin()
        except RefusalError:
            assert self.node.loop.supervision.operation is was
            return
        assert not self.stopped, "stop holds until rearm"
        now = self.node.loop.supervision.operation
        assert now is (Operation.ACTIVE if was is Operation.STANDBY else was), "the safe action ends by good periods alone"
        if was is Operation.STANDBY:
            for source in (self.odometry, self.reference):
                assert source.in_a_row >= FRESH_SAMPLES, "the law commands after enough samples of each input"
                assert self.node.now() - source.good[-1].at <= TIMEOUT * SECOND, "and while they are fresh"
            self.handed_over = True

    # -- a control period ----------------------------------------------------------------------------------------------

    def step(self, odometry: str, reference: str, wrench: str) -> None:
        """A control period, with every property that must hold at its end."""
        node, law = self.node, self.node.drawn
        before, was = node.loop.wrench, (node.loop.supervision.operation, node.loop.supervision.reason)
        for sample in self.odometry.messages(odometry, node.ros_time, self.epoch):
            node.timer.take_odometry(Measured(sample, Motion(*sample.values)))
        for sample in self.reference.messages(reference, node.ros_time, self.epoch):
            node.timer.take_reference(Desired(sample, Motion(*sample.values), Acceleration(0.0, 0.0, 0.0)))
        law.wrench, law.motion, law.desired = LAW.get(wrench), None, None
        if self.forgotten and not self.stepped:
            assert law.fresh, "a reset clears what the law has learned"
        node.timer._on_timer()
        self._check_law()
        self._check_command(before, was)
        if self.stepped:  # the controller has seen it in this period, and what came before does not count
            self.epoch, self.stepped, self.used = self.epoch + 1, False, {}
            self.odometry.forget()
            self.reference.forget()
            assert law.fresh or not self.forgotten, "a clock that is set back clears what the law has learned"
        self.handed_over = self.forgotten = False
        self._pass()

    def _check_law(self) -> None:
        """What the law is called with is recent, good, of this epoch, in order, and where the ship is."""
        law, now = self.node.drawn, self.node.ros_time
        places = {"odometry": (law.motion, self.odometry), "reference": (law.desired, self.reference)}
        for name, (motion, source) in places.items():
            if motion is None:
                continue
            number = round(motion.y * 1e6)
            assert 0 <= number < len(source.good), "the law sees no message that is to be refused"
            sent, last = source.good[number], self.used.get(name)
            assert now - sent.at <= TIMEOUT * SECOND, "the law sees no message that is too old"
            assert sent.epoch == self.epoch, "the law sees no message of another time"
            assert not self.stepped, "in the period of a step of the clock the law has no inputs"
            assert last is None or sent.at >= last.at, "the law sees messages in their order"
            if name == "odometry":
                self._check_place(sent, last)
            self.used[name] = sent
        if law.motion is not None:
            law.fresh = False

    def _check_place(self, sent: Sent, last: Sent | None) -> None:
        """A jump is held out until it persists, and nothing else is."""
        if last is not None and sent.place != last.place:
            self.handed_over = True
        assert sent.place == self.odometry.believed, "a jump is held out until it persists"
        assert sent is self.odometry.good[-1] or self.odometry.apart, "what is no jump is taken at once"

    def _check_command(self, before: Pair, was: tuple[Operation, Reason]) -> None:
        node = self.node
        s, command, sent = node.loop.supervision, node.loop.wrench, node.take_sent()
        operation, reason = s.operation, s.reason
        own = (operation, reason) == (Operation.ACTIVE, Reason.NONE)
        assert all(map(math.isfinite, command))
        assert all(abs(c) <= limit for c, limit in zip(command, LIMITS, strict=True)), command
        assert (operation is Operation.STOPPED) is self.stopped, "stop holds until rearm"
        if operation in (Operation.ACTIVE, Operation.SAFE) or self.stopped:
            assert sent[-1:] == [(node.now(), command)], "each period is answered by its command"
        if operation in (Operation.STOPPED, Operation.STANDBY):
            assert command == (0.0, 0.0)
            assert all(wrench == (0.0, 0.0) for _, wrench in sent)
        elif node.drawn.motion is None or not self._valid(node.drawn.wrench):
            assert operation is Operation.SAFE, "no command comes from refused data"
        assert operation is not Operation.SAFE or reason is not Reason.NONE
        if own:
            assert command == self._clipped(node.drawn.wrench)
        self.good_periods = self.good_periods + 1 if node.drawn.motion and self._valid(node.drawn.wrench) else 0
        if was[0] is Operation.SAFE and operation is Operation.ACTIVE:
            assert self.good_periods >= FRESH_SAMPLES, "the law commands again after some good periods"
        self.zeros = self.zeros + len(sent) if operation is Operation.STANDBY else 0
        assert self.zeros <= LAST_COMMANDS, "in standby another source may command"
        self._check_change(before, command, was, (operation, reason))

    def _check_change(self, before: Pair, command: Pair, was: tuple[Operation, Reason], now: tuple[Operation, Reason]) -> None:
        """Every change that is not the law's own is bounded."""
        own = (Operation.ACTIVE, Reason.NONE)
        # A handover ends at the latest after twice the time of the ramp: what differs then is the law's own change.
        over = self.handing_over * PERIOD >= 2 * RAMP_TIME * SECOND
        self.handing_over = self.handing_over + 1 if now[1] is Reason.HANDOVER and not self.handed_over else 0
        if now == own and not self.handed_over and (was == own or over):
            return
        if now[0] in (Operation.STOPPED, Operation.STANDBY) or (now[0] is Operation.SAFE and self.action == "zero"):
            return
        held = now[0] is Operation.SAFE and was[0] is Operation.ACTIVE and self.action == "hold"
        for a, b, rate in zip(before, command, RATES, strict=True):
            assert abs(b - a) <= (0.0 if held else rate * (PERIOD * 1e-9)), (before, command, was, now)

    def _valid(self, wrench: Pair | None) -> bool:
        """Whether a wrench may be commanded: that of a law with limits within them, that of another one in any size."""
        if wrench is None or not all(map(math.isfinite, wrench)):
            return False
        return not self.bounded or all(abs(c) <= limit for c, limit in zip(wrench, LIMITS, strict=True))

    def _clipped(self, wrench: Pair | None) -> Pair:
        assert wrench is not None
        return max(-LIMITS[0], min(LIMITS[0], wrench[0])), max(-LIMITS[1], min(LIMITS[1], wrench[1]))


def drive(data: bytes) -> Machine:
    """Drive a sequence, then good periods until the law commands; the assertions are the properties."""
    machine, body = Machine((data[:1] or b"\0")[0]), data[1:]
    with machine.node.on_its_clock():
        machine.begin(not machine.choice & 32)
        for start in range(0, len(body) - 3, 4):
            odometry, reference, wrench, order = body[start : start + 4]
            # Half of all messages are good, and half of all periods are without an order.
            names = [MESSAGES[code % len(MESSAGES)] if code & 128 else "good" for code in (odometry, reference)]
            if order & 192 == 192:
                machine.order(ORDERS[order % len(ORDERS)])
            machine.step(names[0], names[1], WRENCHES[wrench % len(WRENCHES)] if wrench & 64 else "slow")
        machine.order("rearm")
        for _ in range(BOUND_TO_ACTIVE):
            machine.order("activate")
            machine.step("good", "good", "slow")
    s = machine.node.loop.supervision
    assert (s.operation, s.reason) == (Operation.ACTIVE, Reason.NONE), "good data lead back to the law"
    return machine
