"""The tracking laws of `laws` written again from their descriptions, with complex numbers and without sharing a line of code.

A position, a velocity or a force is x + i·y; a frame turned by an angle is a factor exp(-i·angle).
"""

import cmath
import math
from typing import Any, NamedTuple

from vessel_hsmc_ros.core.kinematics import Acceleration, Motion

TURN = 2.0 * math.pi


def wrapped(angle: float) -> float:
    return math.remainder(angle, TURN)


def limited(value: float, most: float) -> float:
    return min(max(value, -most), most)


def errors(ship: Motion, desired: Motion) -> tuple[float, float, float]:
    """z_e of (11)."""
    e = complex(ship.x, ship.y) * cmath.exp(-1j * ship.psi) - complex(desired.x, desired.y) * cmath.exp(-1j * desired.psi)
    return e.real, e.imag, wrapped(ship.psi - desired.psi)


class Step(NamedTuple):
    """What a law makes of an input: wrench, whether each part of it is at its limit, and what it commands."""

    wrench: tuple[float, float]
    saturated: tuple[bool, bool]
    heading: float = math.nan
    yaw_rate: float = math.nan
    speed: float = math.nan


def at_most(demand: tuple[float, float], vessel: Any) -> tuple[tuple[float, float], tuple[bool, bool]]:
    """A demand within the limits of the ship, and which of them it exceeds."""
    most = vessel.surge_force_limit, vessel.yaw_moment_limit
    return (limited(demand[0], most[0]), limited(demand[1], most[1])), (abs(demand[0]) > most[0], abs(demand[1]) > most[1])


class LineOfSight:
    """`los_pid` with gains that are taken as they are."""

    def __init__(self, gains: Any, vessel: Any, period: float) -> None:
        self.p, self.vessel, self.T = gains, vessel, period
        self.s = self.offset = self.rate = self.surge_integral = self.yaw_integral = 0.0

    def guidance(self, ship: Motion, desired: Motion) -> tuple[float, float, float]:
        """Heading relative to the reference's, speed, and the rate of s."""
        p, way = self.p, complex(ship.x - desired.x, ship.y - desired.y)
        if math.hypot(desired.u, desired.v) < p.station_keeping_speed:
            ahead = -way * cmath.exp(-1j * ship.psi)
            speed = limited(p.along_gain * ahead.real, p.catch_up_speed)
            if abs(way) <= p.capture_radius:
                return 0.0, speed, 0.0
            turn = cmath.phase(ahead if ahead.real >= 0.0 else -ahead)
            return wrapped(ship.psi + turn - desired.psi), speed, 0.0
        side, W = (1.0 if desired.u >= 0.0 else -1.0), math.hypot(desired.u, desired.v)
        e = way * cmath.exp(-1j * (desired.psi + cmath.phase(side * complex(desired.u, desired.v))))
        D, speed = max(p.lookahead_distance, p.lookahead_time * W), desired.u - limited(p.along_gain * e.real, p.catch_up_speed)
        if p.guidance == "alos":
            wound = abs(self.s) >= 0.5 and (self.s > 0.0) == (e.imag > 0.0)
            sine = e.imag / math.hypot(D, e.imag)
            return -side * (self.s + math.atan2(e.imag, D)), speed, 0.0 if wound else p.adaptation_gain * D * sine
        y = e.imag + self.s
        return -side * math.atan2(y, D), speed, p.integral_gain * W * D * e.imag / (D**2 + y**2)

    def step(self, ship: Motion, desired: Motion, change: Acceleration) -> Step:
        p, T = self.p, self.T
        offset, speed, ds = self.guidance(ship, desired)
        bend = p.command_bandwidth**2 * wrapped(offset - self.offset) - 2.0 * p.command_bandwidth * self.rate
        heading, yaw_rate = desired.psi + self.offset, desired.r + self.rate
        psi_e, r_e = wrapped(ship.psi - heading), ship.r - yaw_rate
        u_c = speed * max(0.0, math.cos(psi_e))
        w = p.yaw_bandwidth
        demand = (
            self.vessel.surge_inertia * (change.du - p.surge_gain * (ship.u - u_c) - self.surge_integral),
            self.vessel.yaw_inertia * (change.dr + bend - 2.0 * p.yaw_damping * w * r_e - w**2 * psi_e - self.yaw_integral),
        )
        wrench, saturated = at_most(demand, self.vessel)
        self.s += T * ds
        self.offset, self.rate = self.offset + T * self.rate, self.rate + T * bend
        self.surge_integral += 0.0 if saturated[0] else T * p.surge_integral_gain * (ship.u - u_c)
        self.yaw_integral += 0.0 if saturated[1] else T * p.yaw_integral_gain * psi_e
        return Step(wrench, saturated, wrapped(heading), yaw_rate, u_c)


def free(ship: Motion, vessel: Any, model: Any) -> Acceleration:
    """The acceleration by (6) without actuators."""

    def lost(name: str, q: float) -> float:
        d, d2, d3 = (getattr(model, f"{name}_damping{power}") for power in ("", "_quadratic", "_cubic"))
        return float(d * q + d2 * abs(q) * q + d3 * q**3)

    m11, m22, m33 = vessel.surge_inertia, vessel.sway_inertia, vessel.yaw_inertia
    return Acceleration(
        (m22 * ship.v * ship.r - lost("surge", ship.u)) / m11,
        (-m11 * ship.u * ship.r - lost("sway", ship.v)) / m22,
        ((m11 - m22) * ship.u * ship.v - lost("yaw", ship.r)) / m33,
    )


class HandPosition:
    """`hand_position`."""

    def __init__(self, gains: Any, vessel: Any, period: float) -> None:
        self.p, self.vessel, self.T, self.integral = gains, vessel, period, 0j

    def hand(self, ship: Motion, change: Acceleration) -> tuple[complex, complex, complex]:
        """The point with its first and second derivative."""
        at, length = cmath.exp(1j * ship.psi), self.p.hand_distance
        body, rate = complex(ship.u, ship.v + length * ship.r), complex(change.du, change.dv + length * change.dr)
        return complex(ship.x, ship.y) + length * at, body * at, (rate + 1j * ship.r * body) * at

    def step(self, ship: Motion, desired: Motion, change: Acceleration) -> Step:
        p, unforced = self.p, free(ship, self.vessel, self.p.model)
        (h, dh, ddh), (h_d, dh_d, ddh_d) = self.hand(ship, unforced), self.hand(desired, change)
        e, far = h - h_d, abs(h - h_d) > p.largest_error
        near = e / abs(e) * p.largest_error if far else e
        wanted = ddh_d - p.velocity_gain * (dh - dh_d) - p.position_gain * near - p.integral_gain * self.integral
        body = (wanted - ddh) * cmath.exp(-1j * ship.psi)
        demand = self.vessel.surge_inertia * body.real, self.vessel.yaw_inertia * body.imag / p.hand_distance
        wrench, saturated = at_most(demand, self.vessel)
        if not (far or any(saturated)):
            self.integral += self.T * e
        return Step(wrench, saturated)


class Backstepping:
    """`backstepping` from its virtual controls on, which are those of the law: filters, inversion of the model, limits."""

    def __init__(self, gains: Any, vessel: Any, period: float) -> None:
        self.p, self.vessel, self.T = gains, vessel, period
        self.filtered: tuple[float, float] | None = None

    def step(self, ship: Motion, virtual: tuple[float, float]) -> Step:
        p, f = self.p, free(ship, self.vessel, self.p.model)
        a_u, a_r = self.filtered or virtual
        lag = max(p.filter_time, self.T)
        da_u, da_r = (virtual[0] - a_u) / lag, (virtual[1] - a_r) / lag
        demand = (
            self.vessel.surge_inertia * (da_u - f.du - p.surge_gain * (ship.u - a_u)),
            self.vessel.yaw_inertia * (da_r - f.dr - p.yaw_gain * (ship.r - a_r)),
        )
        self.filtered = a_u + self.T * da_u, a_r + self.T * da_r
        return Step(*at_most(demand, self.vessel))
