"""Azimuths and rudders turn towards the forces that the thrust allocation wants of them: kernels."""

import math

from vessel_hsmc_ros.control.thruster_sets import AllocationState, Allocator, inflow, wrench_of
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import magnitude, wrap
from vessel_hsmc_ros.core.limits import between, clip
from vessel_hsmc_ros.core.thruster_layout import ALL_ROUND, AZIMUTH, FIXED, RUDDER


@kernel
def change_within(rate: float, elapsed: float) -> float:
    """The largest change in a time; infinite, not NaN, where an infinite rate has no time."""
    return rate if rate == math.inf else rate * elapsed


@kernel
def steer(elapsed: float, u: float, c: Allocator, s: AllocationState) -> None:
    """Turn azimuths and rudders towards their forces, within rates; write their demands, and the forces that these give.

    Args:
        elapsed: Time since the last demands, s.
        u: Surge speed, m/s.
        c, s: Constants and state of the allocation.
    """
    for i in range(len(c.x)):
        if c.kind[i] == FIXED:
            continue
        p, q, change = s.p[i], s.q[i], change_within(c.angle_rate[i], elapsed)
        angle = s.angle[i]
        wanted = rudder_angle(i, p, q, u, c, angle) if c.kind[i] == RUDDER else azimuth_angle(i, p, q, c, angle)
        turn = wanted - angle
        if c.angle_limit[i] >= ALL_ROUND:
            turn = wrap(turn)
        angle = wanted if abs(turn) <= change else angle + clip(turn, change)
        s.angle[i] = wrap(angle) if c.angle_limit[i] >= ALL_ROUND else clip(angle, c.angle_limit[i])
        thrust = p if c.kind[i] == RUDDER else p * math.cos(angle) + q * math.sin(angle)
        s.thrust[i] = between(thrust, s.low[i], s.high[i])
        s.mode[i] = 0.0
        s.p[i], s.q[i] = given_force(i, u, c, s)


@kernel
def azimuth_angle(i: int, p: float, q: float, c: Allocator, angle: float) -> float:
    """The angle at which an azimuth gives a force (p, q), N, by pushing or pulling, whichever is nearer to its present angle."""
    force = magnitude(p, q)
    if force <= 1e-9 * c.ahead[i]:
        return angle
    push = math.atan2(q, p)
    if c.angle_limit[i] < ALL_ROUND:
        return push if p >= 0.0 else math.atan2(-q, -p)
    pull = math.atan2(-q, -p)
    return pull if force <= c.astern[i] and abs(wrap(pull - angle)) < abs(wrap(push - angle)) else push


@kernel
def rudder_angle(i: int, p: float, q: float, u: float, c: Allocator, angle: float) -> float:
    """The angle at which a rudder gives a lift q, N, at a thrust p, N, and a surge speed, m/s: L = (l·d - l_2·|d|d)·q_r."""
    flow = inflow(i, p, u, c)
    if flow == 0.0:
        return angle
    l1, l2, limit = c.lift[i], c.lift_quadratic[i], c.angle_limit[i]
    wanted = clip(q / flow, (l1 - l2 * limit) * limit)
    root = l1 * l1 - 4.0 * l2 * abs(wanted)
    # The smaller root, in the form without cancellation.
    return clip(2.0 * wanted / (l1 + (math.sqrt(root) if root > 0.0 else 0.0)), limit)


@kernel
def given_force(i: int, u: float, c: Allocator, s: AllocationState) -> tuple[float, float]:
    """The force p, q that a thruster gives with its demands, N."""
    thrust, angle = s.thrust[i], s.angle[i]
    if c.kind[i] == FIXED:
        return thrust, 0.0
    if c.kind[i] == AZIMUTH:
        return thrust * math.cos(angle), thrust * math.sin(angle)
    return thrust, (c.lift[i] - c.lift_quadratic[i] * abs(angle)) * angle * inflow(i, thrust, u, c)


@kernel
def allocated_wrench(u: float, c: Allocator, s: AllocationState) -> tuple[float, float, float]:
    """Surge force [N], sway force [N] and yaw moment [N·m] of all demands."""
    x = y = n = 0.0
    for i in range(len(c.x)):
        p, q = given_force(i, u, c, s)
        force, moment = wrench_of(i, p, q, c)
        x, n = x + force, n + moment
        y += p * math.sin(c.angle[i]) if c.kind[i] == FIXED else q
    return x, y, n
