"""The one place that decides what is commanded: a state machine between a law and its actuators.

| from | event | to | command |
|---|---|---|---|
| STANDBY | activate, ready | ACTIVE | from zero at a bounded rate to the law's |
| STANDBY | activate, not ready | STANDBY | zero; the reason is returned |
| ACTIVE | no wrench, a fault, a violation of the guard | SAFE | the safe action |
| SAFE | the same | SAFE | the safe action goes on |
| SAFE | the fence | SAFE | at once what keeps the vessel inside, also with another fault |
| SAFE | fresh_samples good periods | ACTIVE | from the present command at a bounded rate to the law's |
| ACTIVE, SAFE | standby | STANDBY | zero at once |
| any | stop | STOPPED | zero at once |
| STOPPED | activate, standby | STOPPED | zero; refused |
| STOPPED | rearm | STANDBY | zero |

A change of command that is not the law's own is bounded: |change| <= limit/ramp_time·period in each component. It counts from the
previous command within the limits, which is what the actuators gave. A handover ends when the law's command is reached, at the
latest after 2·ramp_time, in which every wrench within the limits is reached: what differs then is the law's own change.

What is commanded instead of a law's wrench: zero, a ramp, a hold, a brake, or the wrench of a fallback law.
"""

import math
from collections import Counter
from typing import NamedTuple

from vessel_hsmc_ros.control.safety.parameters import Operation, Reason, SafetyParameters
from vessel_hsmc_ros.core.kernel import clip

Pair = tuple[float, float]


NO_WRENCH = (0.0, 0.0)

BRAKING_TIME = 5.0  # time constant of the brake, s; longer where a control period is longer


def towards(previous: Pair, demand: Pair, rates: Pair, period: float) -> Pair:
    """The command on the way from the previous to the demanded one: |command - previous| <= rate·period in each component.

    `previous`, `demand`: finite commands, N and N·m. `rates`: largest changes per second. `period`: time since the previous
    command, s.
    """
    return (_moved(previous[0], demand[0], rates[0] * period), _moved(previous[1], demand[1], rates[1] * period))


def _moved(start: float, end: float, change: float) -> float:
    if abs(end - start) <= change:
        return end
    moved = start + math.copysign(change, end - start)
    # The sum is rounded: it may be one unit in the last place too far.
    while abs(moved - start) > change:
        moved = math.nextafter(moved, start)
    return moved


class Authority(NamedTuple):
    """What the ship's actuators can give, and what they move."""

    limits: Pair  # largest surge force and yaw moment, N and N·m
    inertia: Pair  # what they accelerate, kg and kg·m²
    bounded: bool = True  # whether the law keeps to the limits; the guard then does too
    clips: bool = False  # whether a command beyond the limits is cut to them instead

    def within(self, command: Pair) -> Pair:
        """A finite command within the limits."""
        return clip(command[0], self.limits[0]), clip(command[1], self.limits[1])

    def rates(self, ramp_time: float) -> Pair:
        """The rates that lead from the limits to zero in a time, s."""
        return self.limits[0] / ramp_time, self.limits[1] / ramp_time


def brake(motion: Pair, authority: Authority, period: float) -> Pair:
    """The wrench against a surge speed u and a yaw rate r: -m·u/t and -m·r/t, within the limits.

    In a control period T it changes the velocity by at most T/t of it. With t >= T it never reverses the motion, so it
    dissipates energy. `motion`: u and r, m/s and rad/s. `period`: T, s.
    """
    t = BRAKING_TIME if period < BRAKING_TIME else period
    m = authority.inertia
    return authority.within((-m[0] * motion[0] / t, -m[1] * motion[1] / t))


def safe_command(
    previous: Pair,
    elapsed: float,
    period: float,
    parameters: SafetyParameters,
    authority: Authority,
    motion: Pair | None = None,
    fallback: Pair | None = None,
) -> Pair:
    """The next command of the safe action.

    Args:
        previous: The command before, within the limits.
        elapsed: Time since the safe action began, s.
        period: s.
        motion: Measured surge speed and yaw rate, for the brake; None where they are not known: ramp.
        fallback: Wrench of the fallback law, finite; None where it has none: ramp.
    """
    action, target = parameters.action, NO_WRENCH
    if action == "zero":
        return NO_WRENCH
    if action == "hold" and elapsed < parameters.hold_time:
        return previous
    if action == "brake" and motion is not None:
        target = brake(motion, authority, period)
    if action == "fallback" and fallback is not None:
        target = authority.within(fallback)
    return towards(previous, target, authority.rates(parameters.ramp_time), period)


ROUNDING = 1.0 + 1e-9  # what a law that clips to a limit in other units may exceed it by


def violation(command: Pair, previous: Pair, limits: Pair, rates: Pair, period: float) -> Reason:
    """The output guard: the first rule that a command violates, whatever the law: finite, within its limits, within its rates.

    `command`: surge force and yaw moment, N and N·m. `limits`: largest values; infinite for none. `rates`: largest changes per
    second; infinite for none. `period`: time between the two commands, s. Returns NONE, COMMAND_NOT_FINITE, COMMAND_LIMIT or
    COMMAND_RATE.
    """
    if not (math.isfinite(command[0]) and math.isfinite(command[1])):
        return Reason.COMMAND_NOT_FINITE
    if abs(command[0]) > limits[0] * ROUNDING or abs(command[1]) > limits[1] * ROUNDING:
        return Reason.COMMAND_LIMIT
    changes = abs(command[0] - previous[0]), abs(command[1] - previous[1])
    if changes[0] > rates[0] * period * ROUNDING or changes[1] > rates[1] * period * ROUNDING:
        return Reason.COMMAND_RATE
    return Reason.NONE


UNBOUNDED = (math.inf, math.inf)


class Supervision:
    """Decides what is commanded, from what the law gives and what a person commands.

    `active`: whether the law commands from the first step on, without a handover; else the controller is in standby.

    Attributes:
        operation, reason: The present state, and why it is not the law that commands.
        command: The last command, surge force and yaw moment, N and N·m.
        violations: Number of violations of the output guard, by reason.
    """

    def __init__(self, parameters: SafetyParameters, authority: Authority, active: bool = True) -> None:
        self.parameters, self.authority = parameters, authority
        p, bounded = parameters, authority.bounded
        own = p.surge_force_limit, p.yaw_moment_limit
        self._limits = tuple(
            (ship if bounded else math.inf) if limit < 0.0 else limit for limit, ship in zip(own, authority.limits, strict=True)
        )
        self.operation, self.reason = (Operation.ACTIVE, Reason.NONE) if active else (Operation.STANDBY, Reason.IN_STANDBY)
        self.command = NO_WRENCH
        self.violations: Counter[Reason] = Counter()
        self._handing_over: float | None = None
        self._follows_own = False  # whether the last command was the law's, so that its rate of change is the law's too
        self._elapsed = 0.0
        self._good = 0

    # -- what a person commands ---------------------------------------------------------------------------------------

    def activate(self, ready: Reason = Reason.NONE) -> Reason:
        """Let the law command, if the controller is ready.

        `ready`: NONE, or what is missing. Returns NONE, or why it is refused.
        """
        if self.operation is Operation.STOPPED:
            return Reason.IN_STOP
        if ready or self.operation is not Operation.STANDBY:
            return ready
        self._enter(Operation.ACTIVE, Reason.NONE)
        self.handover()
        return Reason.NONE

    def standby(self) -> Reason:
        """Compute, but command nothing; refused while stopped."""
        if self.operation is Operation.STOPPED:
            return Reason.IN_STOP
        self._enter(Operation.STANDBY, Reason.IN_STANDBY)
        return Reason.NONE

    def stop(self, reason: Reason = Reason.IN_STOP) -> Reason:
        """Command zero until `rearm`; always allowed."""
        self._enter(Operation.STOPPED, reason)
        return Reason.NONE

    def rearm(self) -> Reason:
        """Leave the stop for standby."""
        if self.operation is Operation.STOPPED:
            self._enter(Operation.STANDBY, Reason.IN_STANDBY)
        return Reason.NONE

    def handover(self) -> None:
        """Let the next commands move at the bounded rate, as after a change of law or gains or a re-localisation."""
        self._handing_over, self._follows_own = 0.0, False

    @property
    def consequence(self) -> str:
        """What is commanded where the law may not command, as the end of a message."""
        others = {Operation.STANDBY: "nothing is commanded", Operation.STOPPED: "zero is commanded"}
        return others.get(self.operation, "the safe action is commanded")

    # -- every control period -----------------------------------------------------------------------------------------

    @property
    def follows_law(self) -> bool:
        """Whether the law commands, and no handover to it is under way."""
        return self.operation is Operation.ACTIVE and self._handing_over is None

    @property
    def wants_fallback(self) -> bool:
        """Whether the wrench of the fallback law is used, if there is one."""
        return self.operation is Operation.SAFE and self.parameters.action == "fallback"

    def step(
        self,
        demand: Pair | None,
        reason: Reason,
        period: float,
        motion: Pair | None = None,
        fallback: Pair | None = None,
        fenced: Pair | None = None,
    ) -> Pair:
        """The command of a control period.

        Args:
            demand: The law's wrench, N and N·m; None where it has none.
            reason: NONE, or why the wrench must not be used or is missing.
            period: Time since the last command, s.
            motion: Measured surge speed and yaw rate, for the brake; None where they are not known.
            fallback: Wrench of the fallback law; None where it has none.
            fenced: Finite wrench that keeps the vessel inside of its fence; None where it is not needed.
        """
        if self.operation in (Operation.STANDBY, Operation.STOPPED):
            self.command = NO_WRENCH
            return self.command
        fault = self._fault(demand, reason, period)
        if fault and self.operation is Operation.ACTIVE:
            self._enter(Operation.SAFE, fault)
        if self.operation is Operation.SAFE:
            self._recover(fault)
        if demand is not None and self.operation is Operation.ACTIVE:
            self.command = self._towards_law(self._given(demand), period)
        else:
            self.command = self._safe(period, motion, fallback)
            if fenced is not None:  # without the ramp: a bump is better than to cross the fence
                self.command = self.authority.within(fenced)
        return self.command

    def _fault(self, demand: Pair | None, reason: Reason, period: float) -> Reason:
        """What forbids the law's wrench; a violation of the guard is counted."""
        if demand is None:
            return reason or Reason.LAW_UNDEFINED
        if reason:
            return reason
        p = self.parameters
        rates = (p.surge_force_rate, p.yaw_moment_rate) if self._follows_own else UNBOUNDED
        found = violation(demand, self.command, (self._limits[0], self._limits[1]), UNBOUNDED, period)
        found = found or violation(self._given(demand), self.command, UNBOUNDED, rates, period)
        if found:
            self.violations[found] += 1
        return found

    def _given(self, demand: Pair) -> Pair:
        """What the actuators are given of the law's wrench."""
        return self.authority.within(demand) if self.authority.clips else demand

    def _recover(self, fault: Reason) -> None:
        self._good = 0 if fault else self._good + 1
        self.reason = fault or Reason.NOT_READY
        if self._good >= self.parameters.fresh_samples:
            self._enter(Operation.ACTIVE, Reason.NONE)
            self.handover()

    def _towards_law(self, demand: Pair, period: float) -> Pair:
        if self._handing_over is not None:
            self._handing_over += period
            previous, target = self.authority.within(self.command), self.authority.within(demand)
            command = towards(previous, target, self.authority.rates(self.parameters.ramp_time), period)
            if command != target and self._handing_over <= 2.0 * self.parameters.ramp_time:
                self.reason = Reason.HANDOVER
                return command
        self._handing_over, self._follows_own, self.reason = None, True, Reason.NONE
        return demand

    def _safe(self, period: float, motion: Pair | None, fallback: Pair | None) -> Pair:
        previous, elapsed = self.authority.within(self.command), self._elapsed
        self._elapsed += period
        if fallback is not None and violation(fallback, previous, UNBOUNDED, UNBOUNDED, period):
            fallback = None
        if motion is not None and not (math.isfinite(motion[0]) and math.isfinite(motion[1])):
            motion = None
        return safe_command(previous, elapsed, period, self.parameters, self.authority, motion, fallback)

    def _enter(self, operation: Operation, reason: Reason) -> None:
        self.operation, self.reason = operation, reason
        self._handing_over, self._follows_own = None, False
        self._elapsed, self._good = 0.0, 0
