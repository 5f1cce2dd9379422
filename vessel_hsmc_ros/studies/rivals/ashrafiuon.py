"""Sliding-mode control with two surfaces, of first order in surge and of second order in sway.

After H. Ashrafiuon, K. R. Muske, L. C. McNinch, R. A. Soltan: Sliding-mode tracking control of surface vessels. IEEE Transactions
on Industrial Electronics 55 (2008) 4004-4012, doi:10.1109/TIE.2008.2005933; the position term after T. Elmokadem, M. Zribi, K.
Youcef-Toumi: Trajectory tracking sliding mode control of underactuated AUVs (2016). Rebuilt from descriptions for the model (6).

| symbol | meaning | unit |
|---|---|---|
| c | demanded velocity, earth-fixed, with the components u_c, v_c in the ship's frame | m/s |
| e_u, e_v | velocity errors u - u_c, v - v_c | m/s |
| S1, S2 | surge and sway surface | m/s, m/s² |
| l1, l2 | slopes of the surfaces | 1/s |
| k1, k2 | switching gains | m/s², m/s³ |
| phi1, phi2 | thickness of the boundary layers | m/s, m/s² |
| k, L | gain on the position error, and the error at which it saturates | 1/s, m |
| b | u_c - (m11/m22)·u, by which the yaw acceleration acts on S2 | m/s |

c = dp_d - k·L·tanh((p - p_d)/L), S1 = e_u, S2 = de_v + 2·l2·e_v. As printed, the law tracks velocities: k = 0, and the surfaces
have integrals, S1 = e_u + l1·int e_u and S2 = de_v + 2·l2·e_v + l2²·int e_v. These are integrals in a turning frame, so the
position keeps a constant offset.
tau_1 and tau_2 set dS1 = -k1·sat(S1/phi1) and dS2 = -k2·sat(S2/phi2). The law is singular at b = 0: it needs a ship under way
whose inertias differ. abs(b) is kept above b_min.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.interface.known_vessel import (
    KnownDamping,
    Ship,
    Vector,
    drag_slope,
    free_acceleration,
    jerk,
    known_ship,
    point_ahead,
    rotated,
)
from vessel_hsmc_ros.control.interface.law import NO_NETWORKS, KernelLaw, gain
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.kernel import clip, kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, tracking_error, transform
from vessel_hsmc_ros.core.schema import group, parameter


@dataclass(frozen=True)
class AshrafiuonParameters:
    """Gains, tuned as docs/baselines.md describes, and the damping that the law needs to know."""

    surfaces: str = parameter(
        "position",
        "Surfaces of a velocity that has a position term, or as printed: of the reference's velocity, with integrals.",
        choices=("position", "as_printed"),
    )
    surge_slope: float = gain(0.1, "Slope of the surge surface; used as printed only.", "1/s", "l1")
    sway_slope: float = gain(1.2, "Slope of the sway surface.", "1/s", "l2")
    surge_gain: float = gain(0.4, "Switching gain of the surge surface.", "m/s²", "k1")
    sway_gain: float = gain(0.25, "Switching gain of the sway surface.", "m/s³", "k2")
    surge_boundary: float = gain(0.016, "Boundary layer of the surge surface.", "m/s", "phi1", low=1e-6)
    sway_boundary: float = gain(0.064, "Boundary layer of the sway surface.", "m/s²", "phi2", low=1e-6)
    position_gain: float = gain(0.74, "Gain on the position error; not used as printed.", "1/s", "k")
    position_scale: float = gain(14.0, "Position error at which its term saturates.", "m", "L", low=1e-3)
    least_control_gain: float = gain(0.27, "Smallest magnitude of b, against the singularity.", "m/s", "b_min", low=1e-3)
    model: KnownDamping = group(KnownDamping)


class Gains(NamedTuple):
    """The constants of the law by their symbols; `printed` is 1 with the integrals, 0 without."""

    l1: float
    l2: float
    k1: float
    k2: float
    phi1: float
    phi2: float
    k: float
    L: float
    b_min: float
    printed: float
    T: float
    ship: Ship


class Memory(NamedTuple):
    """Internal state: the integrals of e_u and e_v, m; there are no networks."""

    surge_integral: float
    sway_integral: float
    W: NDArray[np.float64]


class StepTerms(NamedTuple):
    """The terms of a step, by their names in `Terms`."""

    surge_error: float
    sway_error: float
    heading_error: float
    surge_surface: float
    commanded_surge_velocity: float
    surge_saturated: float
    yaw_saturated: float


class Demand(NamedTuple):
    """An element of the position term k·L·tanh(e/L) with its first and second derivative."""

    value: float
    rate: float
    curvature: float


@kernel
def position_term(e: float, de: float, dde: float, g: Gains) -> Demand:
    """k·L·tanh(e/L), its rate and its second derivative."""
    t = math.tanh(e / g.L)
    slope = g.k * (1.0 - t * t)
    return Demand(g.k * g.L * t, slope * de, slope * (dde - 2.0 * t * de * de / g.L))


@kernel
def away_from_zero(value: float, least: float) -> float:
    """The value with its magnitude kept above `least`; zero counts as positive."""
    if -least < value < least:
        return least if value >= 0.0 else -least
    return value


@kernel
def demanded(motion: Motion, own: Acceleration, desired: Motion, acceleration: Acceleration, g: Gains) -> tuple[Vector, ...]:
    """The demanded velocity c and its first two derivatives, in the ship's frame.

    Returns R'c [m/s], R'dc [m/s²], which does not depend on `own`, and R'ddc [m/s³].
    """
    p, p_d, dddp_d = point_ahead(motion, own, 0.0), point_ahead(desired, acceleration, 0.0), jerk(desired, acceleration)
    e = Vector(p.position.x - p_d.position.x, p.position.y - p_d.position.y)
    de = Vector(p.velocity.x - p_d.velocity.x, p.velocity.y - p_d.velocity.y)
    dde = Vector(p.acceleration.x - p_d.acceleration.x, p.acceleration.y - p_d.acceleration.y)
    x, y = position_term(e.x, de.x, dde.x, g), position_term(e.y, de.y, dde.y, g)
    return (
        rotated(p_d.velocity.x - x.value, p_d.velocity.y - y.value, -motion.psi),
        rotated(p_d.acceleration.x - x.rate, p_d.acceleration.y - y.rate, -motion.psi),
        rotated(dddp_d.x - x.curvature, dddp_d.y - y.curvature, -motion.psi),
    )


@kernel
def yaw_acceleration(motion: Motion, own: Acceleration, c: tuple[Vector, ...], sway_integral: float, g: Gains) -> float:
    """The yaw acceleration that sets dS2 = -k2·sat(S2/phi2)."""
    (u_c, v_c), (a_x, a_y), (_, j_y) = c
    s, r, mu = g.ship, motion.r, g.ship.m11 / g.ship.m22
    e_v, de_v = motion.v - v_c, own.dv - a_y + r * u_c
    S2 = de_v + 2.0 * g.l2 * e_v + g.printed * g.l2 * g.l2 * sway_integral
    damping = drag_slope(motion.v, s.d_v, s.d_v2, s.d_v3) / s.m22
    # dS2 = b·dr + unforced
    unforced = r * (a_x + r * v_c - mu * own.du) - damping * own.dv - j_y + r * a_x
    unforced += 2.0 * g.l2 * de_v + g.printed * g.l2 * g.l2 * e_v
    return (-unforced - g.k2 * clip(S2 / g.phi2, 1.0)) / away_from_zero(u_c - mu * motion.u, g.b_min)


@kernel
def step(
    motion: Motion, desired: Motion, acceleration: Acceleration, m: Memory, g: Gains
) -> tuple[tuple[float, float], StepTerms, Memory]:
    """One period: demanded velocity, surge force, and the yaw moment for the surge acceleration that this force causes."""
    s = g.ship
    f = free_acceleration(motion, s)
    (u_c, v_c), (a_x, _), _ = demanded(motion, f, desired, acceleration, g)
    e_u, e_v = motion.u - u_c, motion.v - v_c
    S1 = e_u + g.printed * g.l1 * m.surge_integral
    du_c = a_x + motion.r * v_c
    demand_1 = s.m11 * (du_c - f.du - g.printed * g.l1 * e_u - g.k1 * clip(S1 / g.phi1, 1.0))
    tau_1 = clip(demand_1, s.tau_1max)
    own = Acceleration(f.du + tau_1 / s.m11, f.dv, f.dr)
    c = demanded(motion, own, desired, acceleration, g)
    demand_2 = s.m33 * (yaw_acceleration(motion, own, c, m.sway_integral, g) - f.dr)
    tau_2 = clip(demand_2, s.tau_2max)
    saturated_1, saturated_2 = tau_1 != demand_1, tau_2 != demand_2
    # Anti-windup: an integral takes no error in while its actuator is saturated.
    I_u = m.surge_integral + (0.0 if saturated_1 else g.T * g.printed * e_u)
    I_v = m.sway_integral + (0.0 if saturated_2 else g.T * g.printed * e_v)
    e = tracking_error(transform(motion), transform(desired))
    terms = StepTerms(e.z1, e.z2, e.z3, S1, u_c, 1.0 if saturated_1 else 0.0, 1.0 if saturated_2 else 0.0)
    return (tau_1, tau_2), terms, Memory(I_u, I_v, m.W)


class AshrafiuonController(KernelLaw[AshrafiuonParameters]):
    """The law with the integrals of its surfaces."""

    name = "ashrafiuon"
    kernel = staticmethod(step)
    terms = StepTerms
    memory: Memory

    def retune(self, parameters: AshrafiuonParameters) -> None:
        """Take new gains and keep the integrals."""
        symbols, printed = schema.symbols(parameters), parameters.surfaces == "as_printed"
        if printed:
            symbols["k"] = 0.0
        ship = known_ship(self.vessel, parameters.model)
        self.constants = Gains(**symbols, printed=1.0 if printed else 0.0, T=self.period, ship=ship)

    def reset(self) -> None:
        """Set the integrals to zero."""
        self.memory = Memory(0.0, 0.0, NO_NETWORKS)
