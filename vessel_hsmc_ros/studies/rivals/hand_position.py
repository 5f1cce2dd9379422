"""Hand-position tracking: feedback linearisation of a point ahead of the ship, which both actuators accelerate.

After C. Paliotta, E. Lefeber, K. Y. Pettersen, J. Pinto, M. Costa, J. T. de Figueiredo Borges de Sousa: Trajectory tracking and
path following for underactuated marine vehicles. IEEE Transactions on Control Systems Technology 27 (2019) 1423-1437.
Derived anew for the model (6); the current observer of the paper is an integral here.

| symbol | meaning | unit |
|---|---|---|
| l_h | distance of the hand position ahead of the origin | m |
| h, h_d | hand position of ship and reference | m |
| e | hand-position error h - h_d | m |
| k_p, k_v, k_i | gains on the error, its rate and its integral | 1/s², 1/s, 1/s³ |
| e_max | largest error that the proportional term uses | m |
| f_u, f_v, f_r | modelled accelerations without actuators | m/s², m/s², rad/s² |

ddh = R·(f_u + tau_1/m11 - r·(v + l_h·r), f_v + l_h·(f_r + tau_2/m33) + r·u): the matrix diag(1/m11, l_h/m33) of the inputs is
regular for all inertias. The law demands ddh = ddh_d - k_v·de - k_p·sat(e) - k_i·int e, where sat limits the length of e to
e_max. The heading is free; on a straight line at constant speed it is stable for every l_h > 0 where m11 <= m22. The origin of
the ship follows that of the reference as far as both have the same drift angle.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.interface.known_vessel import (
    KnownDamping,
    Ship,
    Vector,
    free_acceleration,
    known_ship,
    point_ahead,
    rotated,
)
from vessel_hsmc_ros.control.interface.law import NO_NETWORKS, KernelLaw, gain
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.kernel import clip, kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, magnitude, tracking_error, transform
from vessel_hsmc_ros.core.schema import group


@dataclass(frozen=True)
class HandPositionParameters:
    """Gains, tuned as docs/baselines.md describes, and the damping that the law needs to know."""

    hand_distance: float = gain(1.5, "Distance of the hand position ahead of the origin.", "m", "l_h", low=1e-3)
    position_gain: float = gain(0.35, "Gain on the error of the hand position.", "1/s²", "k_p")
    velocity_gain: float = gain(1.7, "Gain on the rate of the error.", "1/s", "k_v")
    integral_gain: float = gain(0.14, "Gain on the integral of the error.", "1/s³", "k_i")
    largest_error: float = gain(25.0, "Largest error that the proportional term uses.", "m", "e_max", low=1e-3)
    model: KnownDamping = group(KnownDamping)


class Gains(NamedTuple):
    """The constants of the law by their symbols."""

    l_h: float
    k_p: float
    k_v: float
    k_i: float
    e_max: float
    T: float
    ship: Ship


class Memory(NamedTuple):
    """Internal state: the integral of the error, m·s, earth-fixed; there are no networks."""

    integral: Vector
    W: NDArray[np.float64]


class StepTerms(NamedTuple):
    """The terms of a step, by their names in `Terms`."""

    surge_error: float
    sway_error: float
    heading_error: float
    surge_saturated: float
    yaw_saturated: float


@kernel
def step(
    motion: Motion, desired: Motion, acceleration: Acceleration, m: Memory, g: Gains
) -> tuple[tuple[float, float], StepTerms, Memory]:
    """One period: demanded acceleration of the hand position, inversion of the model, saturation."""
    s = g.ship
    f = free_acceleration(motion, s)
    # The acceleration that the hand position would have without actuators.
    h, h_d = point_ahead(motion, f, g.l_h), point_ahead(desired, acceleration, g.l_h)
    e_x, e_y = h.position.x - h_d.position.x, h.position.y - h_d.position.y
    distance = magnitude(e_x, e_y)
    share = g.e_max / distance if distance > g.e_max else 1.0
    demand_x = h_d.acceleration.x - g.k_v * (h.velocity.x - h_d.velocity.x) - g.k_p * share * e_x - g.k_i * m.integral.x
    demand_y = h_d.acceleration.y - g.k_v * (h.velocity.y - h_d.velocity.y) - g.k_p * share * e_y - g.k_i * m.integral.y
    lacking = rotated(demand_x - h.acceleration.x, demand_y - h.acceleration.y, -motion.psi)
    demand_1, demand_2 = s.m11 * lacking.x, s.m33 * lacking.y / g.l_h
    tau_1, tau_2 = clip(demand_1, s.tau_1max), clip(demand_2, s.tau_2max)
    saturated_1, saturated_2 = tau_1 != demand_1, tau_2 != demand_2
    # Anti-windup: the integral takes no error in while an actuator or the error is saturated.
    taken = 0.0 if saturated_1 or saturated_2 or share < 1.0 else g.T
    integral = Vector(m.integral.x + taken * e_x, m.integral.y + taken * e_y)
    e = tracking_error(transform(motion), transform(desired))
    terms = StepTerms(e.z1, e.z2, e.z3, 1.0 if saturated_1 else 0.0, 1.0 if saturated_2 else 0.0)
    return (tau_1, tau_2), terms, Memory(integral, m.W)


class HandPositionController(KernelLaw[HandPositionParameters]):
    """The law with its integral."""

    name = "hand_position"
    kernel = staticmethod(step)
    terms = StepTerms
    memory: Memory

    def retune(self, parameters: HandPositionParameters) -> None:
        """Take new gains and keep the integral."""
        self.constants = Gains(**schema.symbols(parameters), T=self.period, ship=known_ship(self.vessel, parameters.model))

    def reset(self) -> None:
        """Set the integral to zero."""
        self.memory = Memory(Vector(0.0, 0.0), NO_NETWORKS)
