"""Thrust allocation: thrusts and angles that give a demanded surge force and yaw moment, inside limits and rates.

In a period of length T a thrust may change by rate·T, and an angle likewise. Fixed thrusters give the wrench that is the nearest
to the demand, moment before force (`allocated_forces`), inside what limits and rates leave. Azimuths and rudders are first given
the forces that would be best if they could turn at once. They turn towards these forces as fast as their rate allows, an azimuth
by the shorter way, ahead or with its thrust reversed; it gives the part of its force that points its present way. The fixed
thrusters of the same ship then make up for what is missing. The sway force is free: no law of this package demands one.
"""

import math
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.control.loop.allocated_forces import (
    AHEAD,
    ANGLE,
    ANGLE_LIMIT,
    ANGLE_RATE,
    ASTERN,
    BEST,
    COLUMNS,
    HIGH,
    KIND,
    LIFT,
    LIFT_QUADRATIC,
    LOW,
    MODE,
    SINE,
    THRUST,
    THRUST_RATE,
    TURN,
    Allocator,
    Array,
    P,
    Q,
    inflow,
    share_between_two,
    share_forces,
    wrench_of,
)
from vessel_hsmc_ros.core.kernel import between, clip, kernel
from vessel_hsmc_ros.core.kinematics import magnitude, wrap
from vessel_hsmc_ros.core.thruster_layout import ALL_ROUND, AZIMUTH, FIXED, RUDDER, ThrusterLayout
from vessel_hsmc_ros.core.timing import seconds


@kernel
def change_within(rate: float, elapsed: float) -> float:
    """The largest change in a time; infinite, not NaN, where an infinite rate has no time."""
    return rate if rate == math.inf else rate * elapsed


@kernel
def steer(elapsed: float, u: float, c: Allocator, s: Array) -> None:
    """Turn azimuths and rudders towards their forces, within rates; write their demands, and the forces that these give.

    `elapsed`: time since the last demands, s. `u`: surge speed, m/s.
    """
    for i in range(len(c.rows)):
        if c.rows[i, KIND] == FIXED:
            continue
        p, q, change = s[i, P], s[i, Q], change_within(c.rows[i, ANGLE_RATE], elapsed)
        angle = s[i, TURN]
        demanded = rudder_angle(i, p, q, u, c, angle) if c.rows[i, KIND] == RUDDER else azimuth_angle(i, p, q, c, angle)
        turn = demanded - angle
        if c.rows[i, ANGLE_LIMIT] >= ALL_ROUND:
            turn = wrap(turn)
        angle = demanded if abs(turn) <= change else angle + clip(turn, change)
        s[i, TURN] = wrap(angle) if c.rows[i, ANGLE_LIMIT] >= ALL_ROUND else clip(angle, c.rows[i, ANGLE_LIMIT])
        thrust = p if c.rows[i, KIND] == RUDDER else p * math.cos(angle) + q * math.sin(angle)
        s[i, THRUST] = between(thrust, s[i, LOW], s[i, HIGH])
        s[i, MODE] = 0.0
        s[i, P], s[i, Q] = given_force(i, u, c, s)


@kernel
def azimuth_angle(i: int, p: float, q: float, c: Allocator, angle: float) -> float:
    """The angle at which an azimuth gives a force (p, q), N, ahead or with its thrust reversed, whichever is nearer."""
    force = magnitude(p, q)
    if force <= 1e-9 * c.rows[i, AHEAD]:
        return angle
    ahead = math.atan2(q, p)
    if c.rows[i, ANGLE_LIMIT] < ALL_ROUND:
        return ahead if p >= 0.0 else math.atan2(-q, -p)
    astern = math.atan2(-q, -p)
    nearer = abs(wrap(astern - angle)) < abs(wrap(ahead - angle))
    return astern if nearer and force <= c.rows[i, ASTERN] else ahead


@kernel
def rudder_angle(i: int, p: float, q: float, u: float, c: Allocator, angle: float) -> float:
    """The angle at which a rudder gives a lift q, N, at a thrust p, N, and a surge speed, m/s: L = (l·d - l_2·|d|d)·q_r."""
    flow = inflow(i, p, u, c)
    if flow == 0.0:
        return angle
    l1, l2, limit = c.rows[i, LIFT], c.rows[i, LIFT_QUADRATIC], c.rows[i, ANGLE_LIMIT]
    demanded = clip(q / flow, (l1 - l2 * limit) * limit)
    root = l1 * l1 - 4.0 * l2 * abs(demanded)
    # The smaller root, in the form without cancellation.
    return clip(2.0 * demanded / (l1 + (math.sqrt(root) if root > 0.0 else 0.0)), limit)


@kernel
def given_force(i: int, u: float, c: Allocator, s: Array) -> tuple[float, float]:
    """The force p, q that a thruster gives with its demands, N."""
    thrust, angle = s[i, THRUST], s[i, TURN]
    if c.rows[i, KIND] == FIXED:
        return thrust, 0.0
    if c.rows[i, KIND] == AZIMUTH:
        return thrust * math.cos(angle), thrust * math.sin(angle)
    return thrust, (c.rows[i, LIFT] - c.rows[i, LIFT_QUADRATIC] * abs(angle)) * angle * inflow(i, thrust, u, c)


@kernel
def allocated_wrench(u: float, c: Allocator, s: Array) -> tuple[float, float, float]:
    """Surge force [N], sway force [N] and yaw moment [N·m] of all demands."""
    x = y = n = 0.0
    for i in range(len(c.rows)):
        p, q = given_force(i, u, c, s)
        force, moment = wrench_of(i, p, q, c)
        x, n = x + force, n + moment
        y += p * c.rows[i, SINE] if c.rows[i, KIND] == FIXED else q
    return x, y, n


class Allocated(NamedTuple):
    """An allocation."""

    # thrust, angle: demands for each thruster, N and rad
    thrust: list[float]
    angle: list[float]
    wrench: tuple[float, float, float]  # what they give together in steady state: surge force, sway force, yaw moment
    saturated: bool  # whether that differs from the demand


class Allocation:
    """The allocation of one vessel, which keeps its latest demands for the limits of their rates.

    `layout`: the thrusters, at least one.
    """

    def __init__(self, layout: ThrusterLayout) -> None:
        self.constants = allocator(layout)
        self._scale = layout.limits()
        self.reset()

    def reset(self) -> None:
        """Return to no thrust and straight angles."""
        self.state = new_state(self.constants)
        self._last: int | None = None

    def stop(self) -> None:
        """Note that the thrusts have been set to zero, while angles hold."""
        self.state[:, THRUST] = 0.0

    def step_at(self, stamp: int, command: tuple[float, float], surge_speed: float) -> Allocated:
        """Allocate a command of a stamp, whose limits of rates depend on the stamp before; the first has no time to change.

        `stamp`: ns. `command`: surge force and yaw moment, N and N·m, finite. `surge_speed`: for the inflow of rudders, m/s.
        """
        elapsed = elapsed_time(stamp, stamp if self._last is None else self._last)
        self._last = stamp
        return self.step(*command, elapsed, surge_speed)

    def step(self, surge_force: float, yaw_moment: float, elapsed: float, surge_speed: float = 0.0) -> Allocated:
        """Allocate a demand.

        `surge_force`, `yaw_moment`: the demand, N and N·m, finite. `elapsed`: time since the last demand, s. `surge_speed`: for
        the inflow of rudders, m/s.
        """
        allocate(surge_force, yaw_moment, elapsed, surge_speed, self.constants, self.state)
        x, y, n = map(float, allocated_wrench(surge_speed, self.constants, self.state))
        missing = abs(x - surge_force) > 1e-6 * self._scale[0] or abs(n - yaw_moment) > 1e-6 * self._scale[1]
        return Allocated(self.state[:, THRUST].tolist(), self.state[:, TURN].tolist(), (x, y, n), missing)


def allocator(layout: ThrusterLayout) -> Allocator:
    """The constants of an allocation."""
    each, rows = layout.thrusters(), []
    for t in each:
        limit = t.largest_angle if t.kind == RUDDER else t.angle_limit
        shown = t.angle if t.kind == FIXED else limit
        thrust = (t.thrust_ahead, t.thrust_astern, t.thrust_rate)
        turn = (limit, t.angle_rate, t.lift, t.lift_quadratic, t.slipstream)
        rows.append((t.kind, t.x, t.y, t.angle, math.cos(shown), math.sin(shown), *thrust, *turn))
    sectors = sum(t.has_angle and t.angle_limit < ALL_ROUND for t in each)
    return Allocator(np.array(rows, float), max(math.hypot(t.x, t.y) for t in each), sum(t.has_angle for t in each), sectors)


def new_state(c: Allocator) -> Array:
    """The state before the first demand, (k, COLUMNS), which is written in place."""
    state = np.zeros((len(c.rows), COLUMNS))
    fixed = c.rows[:, KIND] == FIXED
    state[fixed, TURN] = c.rows[fixed, ANGLE]
    return state


@kernel
def allocate(surge_force: float, yaw_moment: float, elapsed: float, u: float, c: Allocator, s: Array) -> None:
    """Write the demands for a wrench into the state.

    `surge_force`, `yaw_moment`: N and N·m, finite. `elapsed`: time since the last demands, s. `u`: surge speed, m/s.
    """
    k = len(c.rows)
    for i in range(k):
        s[i, LOW], s[i, HIGH] = thrust_range(i, elapsed, c, s)
    if k == 2 and c.steered == 0:
        share_between_two(surge_force, yaw_moment, c, s)
    else:
        share_in_best_mode(surge_force, yaw_moment, u, c, s)
        if c.steered > 0:
            steer(elapsed, u, c, s)
            if c.steered < k:
                share_forces(surge_force, yaw_moment, u, c, s)
    for i in range(k):
        if c.rows[i, KIND] == FIXED:
            s[i, THRUST] = between(s[i, P], s[i, LOW], s[i, HIGH])


@kernel
def thrust_range(i: int, elapsed: float, c: Allocator, s: Array) -> tuple[float, float]:
    """The least and the largest thrust of a thruster in this period, N."""
    change = change_within(c.rows[i, THRUST_RATE], elapsed)
    low, high = -c.rows[i, ASTERN], c.rows[i, AHEAD]
    return between(s[i, THRUST] - change, low, high), between(s[i, THRUST] + change, low, high)


@kernel
def share_in_best_mode(surge_force: float, yaw_moment: float, u: float, c: Allocator, s: Array) -> None:
    """`share_forces` with each azimuth or rudder that does not turn all the way round ahead or reversed, as is best.

    Best is the nearest moment, then the nearest surge force, then the least sum of squares; all combinations are compared.
    `surge_force`, `yaw_moment`: the demand, N and N·m. `u`: surge speed, m/s.
    """
    off_n = off_x = effort = math.inf
    for mode in range(1 << c.sectors):
        bit = 1
        for i in range(len(c.rows)):
            s[i, MODE] = 1.0
            if c.rows[i, KIND] != FIXED and c.rows[i, ANGLE_LIMIT] < ALL_ROUND:
                s[i, MODE] = -1.0 if mode & bit else 1.0
                bit *= 2
        if share_forces(surge_force, yaw_moment, u, c, s):  # no other mode gives the demand with smaller forces
            return
        x, n, squares = totals(c, s)
        x, n = abs(x - surge_force) / c.rows[0, AHEAD], abs(n - yaw_moment) / (c.rows[0, AHEAD] * c.lever)
        # Rounding errors are no differences.
        if n < off_n - 1e-9 or (n < off_n + 1e-9 and (x < off_x - 1e-9 or (x < off_x + 1e-9 and squares < effort - 1e-9))):
            off_n, off_x, effort = n, x, squares
            for i in range(len(c.rows)):
                s[i, BEST], s[i, BEST + 1] = s[i, P], s[i, Q]
    for i in range(len(c.rows)):
        s[i, P], s[i, Q] = s[i, BEST], s[i, BEST + 1]


@kernel
def totals(c: Allocator, s: Array) -> tuple[float, float, float]:
    """Surge force [N] and yaw moment [N·m] of the forces, and the sum of their squares over those of the largest thrusts."""
    x = n = squares = 0.0
    for i in range(len(c.rows)):
        force, moment = wrench_of(i, s[i, P], s[i, Q], c)
        x, n = x + force, n + moment
        squares += (s[i, P] * s[i, P] + s[i, Q] * s[i, Q]) / (c.rows[i, AHEAD] * c.rows[i, AHEAD])
    return x, n, squares


@kernel
def elapsed_time(stamp: int, last: int) -> float:
    """Time between the stamps of two demands, s; 0 where the clock was set back."""
    return seconds(stamp - last) if stamp > last else 0.0
