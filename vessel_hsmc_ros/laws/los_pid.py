"""The field's everyday choice: line-of-sight guidance above a heading autopilot and a speed controller, both PID.

| symbol | meaning | unit |
|---|---|---|
| x_e, y_e | place relative to the reference, along and across its course | m, m |
| s | integral of line of sight, which leans against a steady drift | m |
| D | lookahead: T_D times the reference's speed, at least D_min | m |
| psi_c, r_c | commanded heading and its rate, filtered | rad, rad/s |
| u_c | commanded surge velocity | m/s |
| w_psi, zeta | bandwidth and damping of the autopilot | rad/s, - |
| k_u, k_x | gains of speed and of place along the course | 1/s, 1/s |
| I_1, I_2 | integrals of the speed controller and of the autopilot | m/s², rad/s² |

While the reference moves, integral line of sight: psi_c = psi_d - atan((y_e + s)/D), ds = k_s·|dp_d|·D·y_e/(D² + (y_e + s)²),
and u_c = u_d - k_x·x_e within v_e of u_d. While it rests, pure pursuit: outside a radius the ship turns its bow or its stern to
the point, whichever is nearer, and goes there; inside it takes the heading asked for.
The loop is built as well as its kind can be: the integrals stop while their actuator is at its limit, the acceleration of the
reference is fed forward, the commanded heading is filtered, and a ship that points away is not driven ahead.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.kinematics import tracking_error, transform, wrap
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.laws.law import Law
from vessel_hsmc_ros.laws.terms import Terms

Array = NDArray[np.float64]

RESTING_SPEED = 0.05
"""Below this speed a reference rests, m/s."""


def gain(default: float, description: str, unit: str, symbol: str, low: float = 0.0, high: float = 1e3) -> float:
    """Declare a gain that may be changed while the law runs."""
    return parameter(default, description, unit=unit, low=low, high=high, symbol=symbol, tunable=True)


@dataclass(frozen=True)
class LosPidParameters:
    """Gains; how they were found stands in docs/baselines.md."""

    lookahead_time: float = gain(4.0, "Lookahead as a time at the reference's speed.", "s", "T_D")
    lookahead_distance: float = gain(12.0, "Least lookahead.", "m", "D_min", low=1e-3)
    drift_gain: float = gain(0.45, "Rate at which line of sight leans against a drift.", "", "k_s")
    along_gain: float = gain(0.6, "Speed for each metre behind or ahead.", "1/s", "k_x")
    catch_up_speed: float = gain(2.0, "Largest speed above or below the reference's.", "m/s", "v_e")
    surge_gain: float = gain(3.0, "Gain of the speed controller.", "1/s", "k_u")
    surge_integral_gain: float = gain(0.3, "Its integral's gain.", "1/s²", "k_iu")
    yaw_bandwidth: float = gain(0.6, "Bandwidth of the autopilot.", "rad/s", "w_psi")
    yaw_damping: float = gain(0.5, "Its damping ratio.", "", "zeta")
    yaw_integral_gain: float = gain(0.075, "Its integral's gain.", "1/s³", "k_ipsi")
    command_bandwidth: float = gain(1.1, "Bandwidth of the filter of the commanded heading.", "rad/s", "w_c", low=1e-3)
    capture_radius: float = gain(1.0, "Distance from a resting reference at which the ship stops going there.", "m", "R")


class Gains(NamedTuple):
    """Everything constant in the law."""

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
    """What the law carries from one period to the next: s, the filter's offset and its rate, I_1, I_2."""

    drift: float = 0.0
    offset: float = 0.0
    offset_rate: float = 0.0
    surge_integral: float = 0.0
    yaw_integral: float = 0.0


class Aim(NamedTuple):
    """What guidance asks for: the heading's offset from the reference's [rad], the speed [m/s], and ds [m/s]."""

    offset: float
    speed: float
    drift_rate: float


def clip(value: float, limit: float) -> float:
    """The value, at most `limit` either way."""
    return min(max(value, -limit), limit)


def line_of_sight(state: Array, reference: Array, drift: float, g: Gains) -> Aim:
    """Integral line of sight on the line through the moving reference, along its course.

    Args:
        state, reference: x, y, psi, u, v, r, shape (6,); the reference moves.
        drift: The integral s.
        g: Gains.
    """
    u_d, v_d = float(reference[3]), float(reference[4])
    ahead = 1.0 if u_d >= 0.0 else -1.0
    course = float(reference[2]) + math.atan2(ahead * v_d, ahead * u_d)
    x, y = float(state[0] - reference[0]), float(state[1] - reference[1])
    c, s = math.cos(course), math.sin(course)
    x_e, y_e = c * x + s * y, -s * x + c * y
    speed = math.hypot(u_d, v_d)
    D = max(g.D_min, g.T_D * speed)
    leaning = y_e + drift
    return Aim(
        -ahead * math.atan(leaning / D),
        u_d - clip(g.k_x * x_e, g.v_e),
        g.k_s * speed * D * y_e / (D * D + leaning * leaning),
    )


def pursuit(state: Array, reference: Array, g: Gains) -> Aim:
    """Pure pursuit of a resting reference, ahead or astern, whichever needs the smaller turn; inside R its heading."""
    x, y = float(reference[0] - state[0]), float(reference[1] - state[1])
    psi, psi_d = float(state[2]), float(reference[2])
    along = x * math.cos(psi) + y * math.sin(psi)
    speed = clip(g.k_x * along, g.v_e)
    if math.hypot(x, y) <= g.R:
        return Aim(0.0, speed, 0.0)
    bearing = math.atan2(y, x) if along >= 0.0 else math.atan2(-y, -x)
    return Aim(wrap(bearing - psi_d), speed, 0.0)


def guide(state: Array, reference: Array, drift: float, g: Gains) -> Aim:
    """Line of sight while the reference moves, pursuit while it rests."""
    if math.hypot(float(reference[3]), float(reference[4])) < RESTING_SPEED:
        return pursuit(state, reference, g)
    return line_of_sight(state, reference, drift, g)


class LosPidController(Law[LosPidParameters]):
    """The law with its memory: integrals and the command filter, advanced by one Euler step each period.

    Args:
        parameters: Gains.
        vessel: What is known of the ship.
        period: Time between two updates, s.
    """

    def retune(self, parameters: LosPidParameters) -> None:
        """Take other gains and keep the integrals."""
        self._gains = Gains(**schema.symbols(parameters), **schema.symbols(self._vessel))

    def reset(self) -> None:
        """Forget the integrals."""
        self.memory = Memory()

    def _step(self, state: Array, reference: Array, reference_acceleration: Array) -> tuple[Array, Terms]:
        """Guidance, filter, the two controllers, the limits."""
        g, m = self._gains, self.memory
        aim = guide(state, reference, m.drift, g)
        offset_acceleration = g.w_c * (g.w_c * wrap(aim.offset - m.offset) - 2.0 * m.offset_rate)
        psi_c = float(reference[2]) + m.offset
        r_c = float(reference[5]) + m.offset_rate
        psi_e, r_e = wrap(float(state[2]) - psi_c), float(state[5]) - r_c
        u_c = aim.speed * max(0.0, math.cos(psi_e))
        u_e = float(state[3]) - u_c

        feedback_1 = -g.k_u * u_e - m.surge_integral
        feedback_2 = -2.0 * g.zeta * g.w_psi * r_e - g.w_psi * g.w_psi * psi_e - m.yaw_integral
        demand_1 = g.m11 * (float(reference_acceleration[0]) + feedback_1)
        demand_2 = g.m33 * (float(reference_acceleration[2]) + offset_acceleration + feedback_2)
        tau_1 = clip(demand_1, self._vessel.surge_force_limit)
        tau_2 = clip(demand_2, self._vessel.yaw_moment_limit)
        cut_1, cut_2 = tau_1 != demand_1, tau_2 != demand_2
        self._remember(aim, offset_acceleration, 0.0 if cut_1 else u_e, 0.0 if cut_2 else psi_e)
        errors = tracking_error(transform(state), transform(reference))
        return np.array([tau_1, tau_2]), Terms(
            *errors,
            commanded_heading=wrap(psi_c),
            commanded_yaw_rate=r_c,
            commanded_surge_velocity=u_c,
            surge_saturated=cut_1,
            yaw_saturated=cut_2,
        )

    def _remember(self, aim: Aim, offset_acceleration: float, u_e: float, psi_e: float) -> None:
        """Move the filter and the integrals on by one period, each integral by the error that it may take in."""
        g, T, m = self._gains, self._period, self.memory
        self.memory = Memory(
            m.drift + T * aim.drift_rate,
            m.offset + T * m.offset_rate,
            m.offset_rate + T * offset_acceleration,
            m.surge_integral + T * g.k_iu * u_e,
            m.yaw_integral + T * g.k_ipsi * psi_e,
        )
