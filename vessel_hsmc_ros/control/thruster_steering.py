"""Azimuths and rudders turn towards the forces that the thrust allocation wants of them: kernels."""

import math

from vessel_hsmc_ros.control.thruster_sets import (
    AHEAD,
    ANGLE_LIMIT,
    ANGLE_RATE,
    ASTERN,
    HIGH,
    KIND,
    LIFT,
    LIFT_QUADRATIC,
    LOW,
    MODE,
    SINE,
    THRUST,
    TURN,
    Allocator,
    Array,
    P,
    Q,
    inflow,
    wrench_of,
)
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import magnitude, wrap
from vessel_hsmc_ros.core.limits import between, clip
from vessel_hsmc_ros.core.thruster_layout import ALL_ROUND, AZIMUTH, FIXED, RUDDER


@kernel
def change_within(rate: float, elapsed: float) -> float:
    """The largest change in a time; infinite, not NaN, where an infinite rate has no time."""
    return rate if rate == math.inf else rate * elapsed


@kernel
def steer(elapsed: float, u: float, c: Allocator, s: Array) -> None:
    """Turn azimuths and rudders towards their forces, within rates; write their demands, and the forces that these give.

    Args:
        elapsed: Time since the last demands, s.
        u: Surge speed, m/s.
        c, s: Constants and state of the allocation.
    """
    for i in range(len(c.rows)):
        if c.rows[i, KIND] == FIXED:
            continue
        p, q, change = s[i, P], s[i, Q], change_within(c.rows[i, ANGLE_RATE], elapsed)
        angle = s[i, TURN]
        wanted = rudder_angle(i, p, q, u, c, angle) if c.rows[i, KIND] == RUDDER else azimuth_angle(i, p, q, c, angle)
        turn = wanted - angle
        if c.rows[i, ANGLE_LIMIT] >= ALL_ROUND:
            turn = wrap(turn)
        angle = wanted if abs(turn) <= change else angle + clip(turn, change)
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
    wanted = clip(q / flow, (l1 - l2 * limit) * limit)
    root = l1 * l1 - 4.0 * l2 * abs(wanted)
    # The smaller root, in the form without cancellation.
    return clip(2.0 * wanted / (l1 + (math.sqrt(root) if root > 0.0 else 0.0)), limit)


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
