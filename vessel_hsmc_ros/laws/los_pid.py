"""The standard approach in practice: line-of-sight guidance with a heading autopilot (PID) and a speed controller (PI).

| symbol | meaning | unit |
|---|---|---|
| x_e, y_e | along-track and cross-track error | m, m |
| s | integral state of the guidance, which compensates a steady drift | m |
| D | lookahead distance: T_D times the reference's speed, at least D_min | m |
| psi_c, r_c | commanded heading and its rate, filtered | rad, rad/s |
| u_c | commanded surge velocity | m/s |
| w_psi, zeta | bandwidth and damping of the autopilot | rad/s, - |
| k_u, k_x | gains on the speed error and on the along-track error | 1/s, 1/s |
| I_1, I_2 | integral states of the speed controller and of the autopilot | m/s², rad/s² |

While the reference moves, integral line-of-sight guidance (ILOS): psi_c = psi_d - atan((y_e + s)/D),
ds = k_s·|dp_d|·D·y_e/(D² + (y_e + s)²), and u_c = u_d - k_x·x_e within v_e of u_d. In station keeping, pure pursuit: outside a
capture radius the ship points its bow or its stern at the reference, whichever needs the smaller turn, and approaches; inside it
takes the reference's heading.
The baseline is meant to be strong: the integrators stop while their actuator is saturated (anti-windup), the acceleration of the
reference is fed forward, the commanded heading is filtered, and the ship is not driven ahead while it points away.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, tracking_error, transform, wrap
from vessel_hsmc_ros.core.limits import clip
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.laws.law import Law
from vessel_hsmc_ros.laws.terms import Terms

RESTING_SPEED = 0.05
"""Below this speed of the reference the law changes to station keeping, m/s."""


def gain(default: float, description: str, unit: str, symbol: str, low: float = 0.0, high: float = 1e3) -> float:
    """Declare a gain that may be changed while the law runs; the arguments are those of `parameter`."""
    return parameter(default, description, unit=unit, low=low, high=high, symbol=symbol, tunable=True)


@dataclass(frozen=True)
class LosPidParameters:
    """Gains; docs/baselines.md describes how they were tuned."""

    lookahead_time: float = gain(4.0, "Lookahead distance divided by the reference's speed.", "s", "T_D")
    lookahead_distance: float = gain(12.0, "Smallest lookahead distance.", "m", "D_min", low=1e-3)
    drift_gain: float = gain(0.45, "Integral gain of the line-of-sight guidance, which compensates a drift.", "", "k_s")
    along_gain: float = gain(0.6, "Gain from the along-track error to the commanded speed.", "1/s", "k_x")
    catch_up_speed: float = gain(2.0, "Largest difference between commanded and reference speed.", "m/s", "v_e")
    surge_gain: float = gain(3.0, "Proportional gain of the speed controller.", "1/s", "k_u")
    surge_integral_gain: float = gain(0.3, "Integral gain of the speed controller.", "1/s²", "k_iu")
    yaw_bandwidth: float = gain(0.6, "Bandwidth of the heading autopilot.", "rad/s", "w_psi")
    yaw_damping: float = gain(0.5, "Damping ratio of the heading autopilot.", "", "zeta")
    yaw_integral_gain: float = gain(0.075, "Integral gain of the heading autopilot.", "1/s³", "k_ipsi")
    command_bandwidth: float = gain(1.1, "Bandwidth of the commanded-heading filter.", "rad/s", "w_c", low=1e-3)
    capture_radius: float = gain(
        1.0, "Distance in station keeping within which the ship takes the reference's heading.", "m", "R"
    )


class Gains(NamedTuple):
    """The constants of the law by their symbols."""

    T_D: float
    D_min: float
    k_s: float
    k_x: float
    v_e: float
    k_u: float
    k_iu: float
    w_psi: float
    zeta: float
    k_ipsi: float
    w_c: float
    R: float
    m11: float
    m33: float


class Memory(NamedTuple):
    """Internal state: s, the filtered heading offset psi_c - psi_d and its rate, I_1, I_2."""

    drift: float = 0.0
    offset: float = 0.0
    offset_rate: float = 0.0
    surge_integral: float = 0.0
    yaw_integral: float = 0.0


class Aim(NamedTuple):
    """Output of the guidance: heading offset from the reference [rad], speed command [m/s], and ds [m/s]."""

    offset: float
    speed: float
    drift_rate: float


def line_of_sight(motion: Motion, desired: Motion, drift: float, g: Gains) -> Aim:
    """Integral line-of-sight guidance on the line through the moving reference, along its course.

    Args:
        motion: State of the ship.
        desired: State of the reference, which moves.
        drift: Integral state s, m.
        g: Gains.

    Returns:
        Heading offset -atan((y_e + s)/D), reversed for a reference that goes astern; speed command; rate of s.
    """
    u_d, v_d = desired.u, desired.v
    # A reference that goes astern is followed astern: the course is that of its stern.
    ahead = 1.0 if u_d >= 0.0 else -1.0
    course = desired.psi + math.atan2(ahead * v_d, ahead * u_d)
    x, y = motion.x - desired.x, motion.y - desired.y
    c, s = math.cos(course), math.sin(course)
    x_e, y_e = c * x + s * y, -s * x + c * y
    speed = math.hypot(u_d, v_d)
    # A lookahead proportional to the speed gives the same time constant of the cross-track error at every speed.
    D = max(g.D_min, g.T_D * speed)
    compensated = y_e + drift
    return Aim(
        -ahead * math.atan(compensated / D),
        u_d - clip(g.k_x * x_e, g.v_e),
        g.k_s * speed * D * y_e / (D * D + compensated * compensated),
    )


def pursuit(motion: Motion, desired: Motion, g: Gains) -> Aim:
    """Station keeping by pure pursuit, ahead or astern, whichever needs the smaller turn; inside R, the reference's heading.

    Args:
        motion: State of the ship.
        desired: State of the reference, which is stationary.
        g: Gains.

    Returns:
        Heading offset and speed command; the integral state of the guidance is not changed.
    """
    x, y = desired.x - motion.x, desired.y - motion.y
    along = x * math.cos(motion.psi) + y * math.sin(motion.psi)
    speed = clip(g.k_x * along, g.v_e)
    if math.hypot(x, y) <= g.R:
        return Aim(0.0, speed, 0.0)
    bearing = math.atan2(y, x) if along >= 0.0 else math.atan2(-y, -x)
    return Aim(wrap(bearing - desired.psi), speed, 0.0)


def guide(motion: Motion, desired: Motion, drift: float, g: Gains) -> Aim:
    """Line-of-sight guidance while the reference moves, pure pursuit in station keeping.

    Args:
        motion, desired: States of the ship and of the reference.
        drift: Integral state s, m.
        g: Gains.

    Returns:
        Heading offset, speed command and rate of s.
    """
    if math.hypot(desired.u, desired.v) < RESTING_SPEED:
        return pursuit(motion, desired, g)
    return line_of_sight(motion, desired, drift, g)


class LosPidController(Law[LosPidParameters]):
    """The law with its internal state, integrators and command filter, which are integrated by one Euler step per period.

    Args:
        parameters: Gains.
        vessel: The known inertia and limits.
        period: Control period, s.
    """

    name = "los_pid"

    def retune(self, parameters: LosPidParameters) -> None:
        """Take new gains and keep the integrals."""
        self._gains = Gains(**schema.symbols(parameters), **schema.symbols(self.vessel))

    def reset(self) -> None:
        """Set the integrals and the command filter to zero."""
        self.memory = Memory()

    def step(self, motion: Motion, desired: Motion, acceleration: Acceleration) -> tuple[tuple[float, float], Terms]:
        """Guidance, command filter, the two controllers, saturation; see `Law.step`."""
        g, m = self._gains, self.memory
        aim = guide(motion, desired, m.drift, g)
        # Critically damped second-order filter of the heading offset; its derivatives are fed forward below. Filtering the
        # offset instead of the heading leaves the reference's own turn without a lag.
        offset_acceleration = g.w_c * (g.w_c * wrap(aim.offset - m.offset) - 2.0 * m.offset_rate)
        psi_c = desired.psi + m.offset
        r_c = desired.r + m.offset_rate
        psi_e, r_e = wrap(motion.psi - psi_c), motion.r - r_c
        # The speed is reduced while the ship points away from its course, to zero at 90 degrees.
        u_c = aim.speed * max(0.0, math.cos(psi_e))
        u_e = motion.u - u_c

        feedback_1 = -g.k_u * u_e - m.surge_integral
        feedback_2 = -2.0 * g.zeta * g.w_psi * r_e - g.w_psi * g.w_psi * psi_e - m.yaw_integral
        demand_1 = g.m11 * (acceleration.du + feedback_1)
        demand_2 = g.m33 * (acceleration.dr + offset_acceleration + feedback_2)
        tau_1 = clip(demand_1, self.vessel.surge_force_limit)
        tau_2 = clip(demand_2, self.vessel.yaw_moment_limit)
        cut_1, cut_2 = tau_1 != demand_1, tau_2 != demand_2
        # Anti-windup: an integrator takes no error in while its actuator is saturated.
        self._integrate(aim, offset_acceleration, 0.0 if cut_1 else u_e, 0.0 if cut_2 else psi_e)
        errors = tracking_error(transform(motion), transform(desired))
        return (tau_1, tau_2), Terms(
            *errors,
            commanded_heading=wrap(psi_c),
            commanded_yaw_rate=r_c,
            commanded_surge_velocity=u_c,
            surge_saturated=cut_1,
            yaw_saturated=cut_2,
        )

    def _integrate(self, aim: Aim, offset_acceleration: float, u_e: float, psi_e: float) -> None:
        """One Euler step of the command filter and the integrators.

        Args:
            aim: Output of the guidance.
            offset_acceleration: Second derivative of the filtered heading offset, rad/s².
            u_e, psi_e: Inputs of the two integrators, m/s and rad.
        """
        g, T, m = self._gains, self.period, self.memory
        self.memory = Memory(
            m.drift + T * aim.drift_rate,
            m.offset + T * m.offset_rate,
            m.offset_rate + T * offset_acceleration,
            m.surge_integral + T * g.k_iu * u_e,
            m.yaw_integral + T * g.k_ipsi * psi_e,
        )
