"""The wrench that reaches the hull, as the observer computes it from the commands: limit, dead time, lag and rate limit."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.observer_model import ObserverParameters
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.limits import clip
from vessel_hsmc_ros.core.timing import seconds
from vessel_hsmc_ros.laws.known_vessel import KnownVessel

Array = NDArray[np.float64]
Wrench = tuple[float, float]

CAPACITY = 1024
"""Number of commands kept where there is a dead time: 10 s at 100 Hz; of a longer one the oldest of them is taken."""


class Actuators(NamedTuple):
    """What is known of the actuators, in each field of the surge force and of the yaw moment.

    Attributes:
        limit: Largest magnitude, N, N·m.
        dead_time, lag: s; 0 for none.
        rate: Largest rate of change, N/s, N·m/s.
    """

    limit: Wrench
    dead_time: Wrench
    lag: Wrench
    rate: Wrench


class Commands(NamedTuple):
    """The latest commands, written in place as a ring: when and what, shapes (n,) and (n, 2), and how many there were, (1,)."""

    at: NDArray[np.int64]
    wrench: Array
    number: NDArray[np.int64]


def actuators(p: ObserverParameters, vessel: KnownVessel) -> Actuators:
    """The actuators as declared; what is not declared counts as ideal, because the observer only estimates what they do."""
    lags = (vessel.surge_lag, vessel.yaw_lag) if p.actuator_lag < 0.0 else (p.actuator_lag, p.actuator_lag)
    rates = [rate if rate >= 0.0 else math.inf for rate in (vessel.surge_force_rate, vessel.yaw_moment_rate)]
    return Actuators(
        (vessel.surge_force_limit, vessel.yaw_moment_limit),
        (max(vessel.surge_dead_time, 0.0), max(vessel.yaw_dead_time, 0.0)),
        (max(lags[0], 0.0), max(lags[1], 0.0)),
        (rates[0], rates[1]),
    )


def no_commands(c: Actuators) -> Commands:
    """An empty ring, of no more than one command where none is delayed."""
    n = CAPACITY if max(c.dead_time) > 0.0 else 1
    return Commands(np.zeros(n, np.int64), np.zeros((n, 2)), np.zeros(1, np.int64))


@kernel
def actuated(last: Wrench, stamp: int, command: Wrench, dt: float, ring: Commands, c: Actuators) -> Wrench:
    """The wrench at the end of dt.

    Args:
        last: The wrench at its beginning, N, N·m.
        stamp: Time of its beginning, ns.
        command: Wrench commanded then, N, N·m.
        dt: Time step, s.
        ring: The latest commands; written in place.
        c: What is known of the actuators.
    """
    i = int(ring.number[0]) % len(ring.at)
    ring.at[i], ring.wrench[i, 0], ring.wrench[i, 1] = stamp, command[0], command[1]
    ring.number[0] += 1
    surge, yaw = effective(0, stamp, ring, c), effective(1, stamp, ring, c)
    return followed(0, last[0], surge, dt, c), followed(1, last[1], yaw, dt, c)


@kernel
def effective(j: int, stamp: int, ring: Commands, c: Actuators) -> float:
    """The command to input j that takes effect now: the latest that is at least a dead time old; 0 before the first one.

    Args:
        j: 0 for the surge force, 1 for the yaw moment.
        stamp: Present time, ns.
        ring: The latest commands.
        c: What is known of the actuators.
    """
    n, count = len(ring.at), int(ring.number[0])
    for k in range(min(n, count)):
        i = (count - 1 - k) % n
        if seconds(stamp - int(ring.at[i])) >= c.dead_time[j]:
            return float(ring.wrench[i, j])
    return float(ring.wrench[count % n, j]) if count >= n else 0.0


@kernel
def followed(j: int, last: float, command: float, dt: float, c: Actuators) -> float:
    """Input j at the end of dt, by a first-order lag of limited rate towards the limited command.

    Args:
        j: 0 for the surge force, 1 for the yaw moment.
        last: The input at the beginning, N or N·m.
        command: The command, N or N·m.
        dt: Time step, s.
        c: What is known of the actuators.
    """
    goal = clip(command, c.limit[j])
    if c.lag[j] == 0.0 and not math.isfinite(c.rate[j]):
        return goal
    change = goal - last if c.lag[j] == 0.0 else -math.expm1(-dt / c.lag[j]) * (goal - last)
    if math.isfinite(c.rate[j]):
        change = clip(change, c.rate[j] * dt)
    return last + change
