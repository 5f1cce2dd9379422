"""Backstepping for tracking and stabilisation in the form of Do, Jiang and Pan, with dynamic surfaces.

After K. D. Do, Z. P. Jiang, J. Pan: Universal controllers for stabilization and tracking of underactuated ships. Systems &
Control Letters 47 (2002) 299-317. Rebuilt: the robustifying terms of its Lyapunov
function are left out, and the derivatives of the virtual controls come from first-order filters (dynamic surface control).

| symbol | meaning | unit |
|---|---|---|
| x_e, y_e, psi_e | errors in the ship's frame: p - p_d along and across the hull, heading | m, m, rad |
| w | velocity of the reference in the ship's frame | m/s |
| L, W | scale of the errors, and sqrt(L² + x_e² + y_e²) | m, m |
| k | weight of the cross error in the heading, abs(k) < 1 | - |
| z_e | heading error from the course to the reference | rad |
| alpha_u, alpha_r | virtual controls of surge velocity and yaw rate | m/s, rad/s |
| a_u, a_r | the same, filtered with the time constant T_f | m/s, rad/s |
| k1 to k4, l1 to l3 | gains | 1/s, 1/s, 1/s, 1/s; s²/m², -, rad/s |

z_e = psi_e + asin(k·y_e/W) with k = l1·(u_d² + r_d²·L²) + l2·sin(l3·t): the sine excites the law in station keeping.
alpha_u = w_x - k1·x_e/sqrt(1 + (x_e/X)²); alpha_r solves dz_e = -k2·z_e, which is possible because abs(k) < 1.
tau_1 = m11·(da_u - f_u - k3·(u - a_u)), tau_2 = m33·(da_r - f_r - k4·(r - a_r)).
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.interface.known_vessel import KnownDamping, Ship, free_acceleration, known_ship, rotated
from vessel_hsmc_ros.control.interface.law import NO_NETWORKS, KernelLaw, gain
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.kernel import clip, kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, tracking_error, transform, wrap
from vessel_hsmc_ros.core.schema import group

LARGEST_WEIGHT = 0.9  # bound of abs(k), below 1


@dataclass(frozen=True)
class BacksteppingParameters:
    """Gains, tuned as docs/baselines.md describes, and the damping that the law needs to know."""

    along_gain: float = gain(3.0, "Gain from the along-hull error to the surge velocity.", "1/s", "k1")
    along_scale: float = gain(14.0, "Along-hull error above which that gain decreases.", "m", "X", low=1e-3)
    heading_gain: float = gain(0.093, "Gain on the heading error from the course to the reference.", "1/s", "k2")
    surge_gain: float = gain(0.82, "Gain on the error of the surge velocity.", "1/s", "k3")
    yaw_gain: float = gain(6.6, "Gain on the error of the yaw rate.", "1/s", "k4")
    speed_weight: float = gain(
        0.28, "Weight of the cross error in the heading per squared speed of the reference.", "s²/m²", "l1"
    )
    excitation: float = gain(0.4, "Amplitude of the excitation of that weight.", "", "l2")
    excitation_frequency: float = gain(0.47, "Frequency of the excitation.", "rad/s", "l3")
    error_scale: float = gain(1.2, "Error above which the heading turns to the reference.", "m", "L", low=1e-3)
    filter_time: float = gain(0.38, "Time constant of the filters of the virtual controls.", "s", "T_f", low=1e-3)
    model: KnownDamping = group(KnownDamping)


class Gains(NamedTuple):
    """The constants of the law by their symbols."""

    k1: float
    X: float
    k2: float
    k3: float
    k4: float
    l1: float
    l2: float
    l3: float
    L: float
    T_f: float
    T: float
    ship: Ship


class Memory(NamedTuple):
    """Internal state: whether there has been a step, the phase of the excitation, a_u and a_r; there are no networks."""

    started: bool
    phase: float
    a_u: float
    a_r: float
    W: NDArray[np.float64]


class StepTerms(NamedTuple):
    """The terms of a step, by their names in `Terms`."""

    surge_error: float
    sway_error: float
    heading_error: float
    yaw_surface: float
    surge_surface: float
    commanded_yaw_rate: float
    commanded_surge_velocity: float
    surge_saturated: float
    yaw_saturated: float


class Virtual(NamedTuple):
    """The virtual controls alpha_u and alpha_r."""

    u: float
    r: float


@kernel
def cross_weight(desired: Motion, acceleration: Acceleration, phase: float, g: Gains) -> tuple[float, float]:
    """The weight k of the cross error and its rate; where it is bounded, its rate is zero."""
    turning = desired.r * g.L
    k = g.l1 * (desired.u * desired.u + turning * turning) + g.l2 * math.sin(phase)
    dk = 2.0 * g.l1 * (desired.u * acceleration.du + turning * acceleration.dr * g.L) + g.l2 * g.l3 * math.cos(phase)
    bounded = clip(k, LARGEST_WEIGHT)
    return bounded, dk if bounded == k else 0.0


@kernel
def virtual_controls(motion: Motion, desired: Motion, acceleration: Acceleration, phase: float, g: Gains) -> Virtual:
    """The surge velocity and the yaw rate that stabilise the kinematics. Returns alpha_u and alpha_r."""
    psi_e = wrap(motion.psi - desired.psi)
    e = rotated(motion.x - desired.x, motion.y - desired.y, -motion.psi)
    w = rotated(desired.u, desired.v, -psi_e)
    k, dk = cross_weight(desired, acceleration, phase, g)
    across = g.L * g.L + e.x * e.x
    W = math.sqrt(across + e.y * e.y)
    ratio = k * e.y / W
    z_e = wrap(psi_e + math.asin(ratio))
    # d/dt asin(ratio) = fixed + slope·r, from dx_e = r·y_e + u - w_x and dy_e = -r·x_e + v - w_y.
    moving = across * (motion.v - w.y) - e.x * e.y * (motion.u - w.x)
    cosine = math.sqrt(1.0 - ratio * ratio)
    fixed = (dk * e.y + k * moving / (W * W)) / (W * cosine)
    slope = -k * e.x / (W * cosine)
    along = e.x / math.sqrt(1.0 + e.x * e.x / (g.X * g.X))
    return Virtual(w.x - g.k1 * along, (desired.r - fixed - g.k2 * z_e) / (1.0 + slope))


@kernel
def step(
    motion: Motion, desired: Motion, acceleration: Acceleration, m: Memory, g: Gains
) -> tuple[tuple[float, float], StepTerms, Memory]:
    """One period: virtual controls, their filters, inversion of the model, saturation."""
    s = g.ship
    f = free_acceleration(motion, s)
    alpha = virtual_controls(motion, desired, acceleration, m.phase, g)
    a_u, a_r = (m.a_u, m.a_r) if m.started else (alpha.u, alpha.r)
    # The filters are stable at every period: the rate carries them at most to their input.
    lag = g.T_f if g.T_f > g.T else g.T
    da_u, da_r = (alpha.u - a_u) / lag, (alpha.r - a_r) / lag
    S_u, S_r = motion.u - a_u, motion.r - a_r
    demand_1, demand_2 = s.m11 * (da_u - f.du - g.k3 * S_u), s.m33 * (da_r - f.dr - g.k4 * S_r)
    tau_1, tau_2 = clip(demand_1, s.tau_1max), clip(demand_2, s.tau_2max)
    flags = 0.0 if tau_1 == demand_1 else 1.0, 0.0 if tau_2 == demand_2 else 1.0
    e = tracking_error(transform(motion), transform(desired))
    terms = StepTerms(e.z1, e.z2, e.z3, S_r, S_u, alpha.r, alpha.u, flags[0], flags[1])
    after = Memory(True, wrap(m.phase + g.l3 * g.T), a_u + g.T * da_u, a_r + g.T * da_r, m.W)
    return (tau_1, tau_2), terms, after


class BacksteppingController(KernelLaw[BacksteppingParameters]):
    """The law with its filters."""

    name = "backstepping"
    kernel = staticmethod(step)
    terms = StepTerms
    memory: Memory

    def retune(self, parameters: BacksteppingParameters) -> None:
        """Take new gains and keep the filters."""
        self.constants = Gains(**schema.symbols(parameters), T=self.period, ship=known_ship(self.vessel, parameters.model))

    def reset(self) -> None:
        """Start the filters at the next virtual controls, and the excitation at zero."""
        self.memory = Memory(False, 0.0, 0.0, 0.0, NO_NETWORKS)
