"""What is commanded instead of a law's wrench: zero, a ramp, a hold, a brake, or the wrench of a fallback law."""

import math
from typing import NamedTuple

from vessel_hsmc_ros.control.safety.parameters import SafetyParameters
from vessel_hsmc_ros.core.limits import clip

Pair = tuple[float, float]


NO_WRENCH = (0.0, 0.0)

BRAKING_TIME = 5.0  # time constant of the brake, s; longer where a control period is longer


def towards(previous: Pair, demand: Pair, rates: Pair, period: float) -> Pair:
    """The command on the way from the previous to the demanded one: |command - previous| <= rate·period in each component.

    `previous`, `demand`: finite commands, N and N·m. `rates`: largest changes per second. `period`: time since the previous
    command, s.
    """
    return (
        _moved(previous[0], demand[0], rates[0] * period),
        _moved(previous[1], demand[1], rates[1] * period),
    )


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
