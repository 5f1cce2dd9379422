"""The standard approach in practice: line-of-sight guidance with a heading autopilot (PID) and a speed controller (PI).

| symbol | meaning | unit |
|---|---|---|
| x_e, y_e | along-track and cross-track error | m, m |
| s | integral state of the guidance, which compensates a steady drift angle | m; adaptive: rad |
| D | lookahead distance: T_D times the reference's speed, at least D_min | m |
| psi_c, r_c | commanded heading and its rate, filtered | rad, rad/s |
| u_c | commanded surge velocity | m/s |
| w_psi, zeta | bandwidth and damping of the autopilot | rad/s, - |
| k_u, k_x | gains on the speed error and on the along-track error | 1/s, 1/s |
| I_1, I_2 | integral states of the speed controller and of the autopilot | m/s², rad/s² |

While the reference moves, integral line-of-sight guidance (ILOS): psi_c = psi_d - atan((y_e + s)/D),
ds = k_s·|dp_d|·D·y_e/(D² + (y_e + s)²), and u_c = u_d - k_x·x_e within v_e of u_d. Adaptive line-of-sight guidance (ALOS; T. I.
Fossen, IEEE Transactions on Control Systems Technology 31 (2023) 2887-2894) estimates the drift angle instead:
psi_c = psi_d - s - atan(y_e/D), ds = gamma·D·y_e/sqrt(D² + y_e²). Near the line this is ILOS with k_s = gamma·D²/|dp_d|.
In station keeping, pure pursuit: outside a capture radius the ship points its bow or its stern at the reference, whichever needs
the smaller turn, and approaches; inside it takes the reference's heading.
The baseline is meant to be strong: the integrators stop while their actuator is saturated (anti-windup), the acceleration of the
reference is fed forward, the commanded heading is filtered, and the ship is not driven ahead while it points away.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.interface.actuators import unit_time
from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.interface.law import NO_NETWORKS, KernelLaw, gain
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.kernel import clip, kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, magnitude, tracking_error, transform, wrap
from vessel_hsmc_ros.core.schema import parameter

PAPER = KnownVessel()  # the ship for which the gains were found
PAPER_DECAY = 1.2  # time in which its sway velocity decays, s
SWAY_SHARE = 0.5
"""The integral gain of the guidance has to be below lookahead distance/(speed·T_v); this share of T/T_v leaves it room."""


@dataclass(frozen=True)
class LosPidParameters:
    """Gains; docs/baselines.md describes how they were tuned."""

    guidance: str = parameter("ilos", "Line-of-sight guidance: with an integral, or adaptive (ALOS).", choices=("ilos", "alos"))
    lookahead_time: float = gain(4.0, "Lookahead distance divided by the reference's speed.", "s", "T_D")
    lookahead_distance: float = gain(9.5, "Smallest lookahead distance.", "m", "D_min", low=1e-3)
    integral_gain: float = gain(1.2, "Integral gain of the line-of-sight guidance, which compensates the drift angle.", "", "k_s")
    adaptation_gain: float = gain(0.002, "Rate of the drift angle per cross-track error; ALOS only.", "1/(m·s)", "gamma")
    along_gain: float = gain(0.9, "Gain from the along-track error to the commanded speed.", "1/s", "k_x")
    catch_up_speed: float = gain(4.0, "Largest difference between commanded and reference speed.", "m/s", "v_e")
    surge_gain: float = gain(1.75, "Proportional gain of the speed controller.", "1/s", "k_u")
    surge_integral_gain: float = gain(0.9, "Integral gain of the speed controller.", "1/s²", "k_iu")
    yaw_bandwidth: float = gain(0.8, "Bandwidth of the heading autopilot.", "rad/s", "w_psi")
    yaw_damping: float = gain(1.3, "Damping ratio of the heading autopilot.", "", "zeta")
    yaw_integral_gain: float = gain(0.04, "Integral gain of the heading autopilot.", "1/s³", "k_ipsi")
    command_bandwidth: float = gain(2.0, "Bandwidth of the commanded-heading filter.", "rad/s", "w_c", low=1e-3)
    capture_radius: float = gain(
        0.1, "Distance in station keeping within which the ship takes the reference's heading.", "m", "R"
    )
    station_keeping_speed: float = gain(0.05, "Speed of the reference below which the ship keeps station.", "m/s", "U_0")
    stretch: float = parameter(
        0.0,
        "Factor by which the times of all gains are longer, for slow actuators; 1: the gains as they are; 0: the gains are those"
        " of the paper's ship; those of another follow from its length, yaw inertia and moment limit, and from its declared lag,"
        " dead time and rate.",
        low=0.0,
        high=1e3,
        tunable=True,
    )


def adapted(p: LosPidParameters, vessel: KnownVessel) -> LosPidParameters:
    """The gains for a ship: those of the paper's ship in its units of length and time, stretched for its actuators.

    `p`: the gains; with `stretch` above 0 they are meant for this ship, and only their times are longer by it. `vessel`: what
    is declared of the ship; what is not declared of its actuators does not count.
    """
    if p.stretch > 0.0:
        return stretched(p, p.stretch)
    own = scaled(p, vessel.length / PAPER.length, unit_time(vessel) / unit_time(PAPER))
    own = replace(own, integral_gain=own.integral_gain * min(1.0, SWAY_SHARE * unit_time(vessel) / sway_decay(vessel)))
    return stretched(own, derived_stretch(own, vessel))


def sway_decay(vessel: KnownVessel) -> float:
    """T_v, the time in which a sway velocity decays, s: as declared, else T, which is about that of most boats."""
    if vessel.sway_damping_rate > 0.0:
        return 1.0 / vessel.sway_damping_rate
    hull, paper = ((v.length, v.sway_inertia, v.yaw_inertia) for v in (vessel, PAPER))
    return PAPER_DECAY if hull == paper else unit_time(vessel)


def scaled(p: LosPidParameters, length: float, time: float) -> LosPidParameters:
    """The gains of a similar ship, of which lengths L and times T = sqrt(m33/tau_2max) are larger by two factors."""
    return replace(
        p,
        lookahead_time=p.lookahead_time * time,
        lookahead_distance=p.lookahead_distance * length,
        adaptation_gain=p.adaptation_gain / (length * time),
        along_gain=p.along_gain / time,
        catch_up_speed=p.catch_up_speed * length / time,
        surge_gain=p.surge_gain / time,
        surge_integral_gain=p.surge_integral_gain / time**2,
        yaw_bandwidth=p.yaw_bandwidth / time,
        yaw_integral_gain=p.yaw_integral_gain / time**3,
        command_bandwidth=p.command_bandwidth / time,
        capture_radius=p.capture_radius * length,
        station_keeping_speed=p.station_keeping_speed * length / time,
    )


def stretched(p: LosPidParameters, q: float) -> LosPidParameters:
    """The gains of the same law with all times longer by q, for a ship whose actuators cannot follow faster ones."""
    return replace(
        p,
        lookahead_time=q * p.lookahead_time,
        lookahead_distance=q * p.lookahead_distance,
        adaptation_gain=p.adaptation_gain / q**2,
        along_gain=p.along_gain / q,
        surge_gain=p.surge_gain / q,
        surge_integral_gain=p.surge_integral_gain / q**2,
        yaw_bandwidth=p.yaw_bandwidth / q,
        yaw_integral_gain=p.yaw_integral_gain / q**3,
        command_bandwidth=p.command_bandwidth / q,
    )


def derived_stretch(p: LosPidParameters, vessel: KnownVessel) -> float:
    """The factor q of `stretched` for the declared actuators: max(1, 1 + w_c·T_e/3, (4·w_psi·T_f)^(1/3)).

    w_c = 2·zeta·w_psi is the crossover frequency of the autopilot. The largest sum T_e of lag and dead time costs phase at w_c/q.
    An input with the time T_f from zero to its limit follows an amplitude A at the frequency w if A·w·T_f is below its limit;
    with all times stretched A decreases by q² and w by q.
    """
    v = vessel
    late = max(max(lag, 0.0) + max(dead, 0.0) for lag, dead in ((v.surge_lag, v.surge_dead_time), (v.yaw_lag, v.yaw_dead_time)))
    rates = (v.surge_force_limit, v.surge_force_rate), (v.yaw_moment_limit, v.yaw_moment_rate)
    full = max(limit / rate if rate > 0.0 else 0.0 for limit, rate in rates)
    slew: float = (4.0 * p.yaw_bandwidth * full) ** (1.0 / 3.0)
    return max(1.0 + 2.0 * p.yaw_damping * p.yaw_bandwidth * late / 3.0, slew)


MAX_INTEGRAL = 0.5  # bound of the drift angle that the adaptive guidance estimates: far from the line it would wind up


class Gains(NamedTuple):
    """The constants of the law by their symbols."""

    T_D: float
    D_min: float
    k_s: float
    gamma: float
    k_x: float
    v_e: float
    k_u: float
    k_iu: float
    w_psi: float
    zeta: float
    k_ipsi: float
    w_c: float
    R: float
    U_0: float
    m11: float
    m33: float
    tau_1max: float
    tau_2max: float
    T: float
    adaptive: bool


class Memory(NamedTuple):
    """Internal state: s, the filtered heading offset psi_c - psi_d and its rate, I_1, I_2; there are no networks."""

    integral: float
    offset: float
    offset_rate: float
    surge_integral: float
    yaw_integral: float
    W: NDArray[np.float64]


class StepTerms(NamedTuple):
    """The terms of a step, by their names in `Terms`."""

    surge_error: float
    sway_error: float
    heading_error: float
    commanded_heading: float
    commanded_yaw_rate: float
    commanded_surge_velocity: float
    surge_saturated: float
    yaw_saturated: float


class Aim(NamedTuple):
    """Output of the guidance: heading offset from the reference [rad], speed command [m/s], and ds [m/s]."""

    offset: float
    speed: float
    integral_rate: float


@kernel
def line_of_sight(motion: Motion, desired: Motion, integral: float, g: Gains) -> Aim:
    """Integral or adaptive line-of-sight guidance on the line through the moving reference, along its course.

    `desired`: state of the reference, which moves. `integral`: integral state s, m. Returns heading offset -atan((y_e + s)/D)
    or -s - atan(y_e/D), reversed for a reference astern; speed command; rate of s.
    """
    u_d, v_d = desired.u, desired.v
    # A reference that goes astern is followed astern: the course is that of its stern.
    ahead = 1.0 if u_d >= 0.0 else -1.0
    course = desired.psi + math.atan2(ahead * v_d, ahead * u_d)
    x, y = motion.x - desired.x, motion.y - desired.y
    c, s = math.cos(course), math.sin(course)
    x_e, y_e = c * x + s * y, -s * x + c * y
    speed = magnitude(u_d, v_d)
    # A lookahead proportional to the speed gives the same time constant of the cross-track error at every speed.
    D = max(g.D_min, g.T_D * speed)
    u_c = u_d - clip(g.k_x * x_e, g.v_e)
    if g.adaptive:
        outwards = abs(integral) >= MAX_INTEGRAL and integral * y_e > 0.0
        rate = 0.0 if outwards else g.gamma * D * y_e / magnitude(D, y_e)
        return Aim(-ahead * (integral + math.atan(y_e / D)), u_c, rate)
    compensated = y_e + integral
    return Aim(-ahead * math.atan(compensated / D), u_c, g.k_s * speed * D * y_e / (D * D + compensated * compensated))


@kernel
def pursuit(motion: Motion, desired: Motion, g: Gains) -> Aim:
    """Station keeping by pure pursuit, ahead or astern, whichever needs the smaller turn; inside R, the reference's heading.

    `desired`: state of the reference, which is stationary. Returns heading offset and speed command; the integral state of the
    guidance is not changed.
    """
    x, y = desired.x - motion.x, desired.y - motion.y
    along = x * math.cos(motion.psi) + y * math.sin(motion.psi)
    speed = clip(g.k_x * along, g.v_e)
    if magnitude(x, y) <= g.R:
        return Aim(0.0, speed, 0.0)
    bearing = math.atan2(y, x) if along >= 0.0 else math.atan2(-y, -x)
    return Aim(wrap(bearing - desired.psi), speed, 0.0)


@kernel
def guide(motion: Motion, desired: Motion, integral: float, g: Gains) -> Aim:
    """Line-of-sight guidance while the reference moves, pure pursuit in station keeping.

    `integral`: integral state s, m. Returns heading offset, speed command and rate of s.
    """
    if magnitude(desired.u, desired.v) < g.U_0:
        return pursuit(motion, desired, g)
    return line_of_sight(motion, desired, integral, g)


@kernel
def integrate(aim: Aim, offset_acceleration: float, u_e: float, psi_e: float, m: Memory, g: Gains) -> Memory:
    """One Euler step of the command filter and the integrators.

    `offset_acceleration`: second derivative of the filtered heading offset, rad/s². `u_e`, `psi_e`: inputs of the two
    integrators, m/s and rad. Returns the internal state one period later.
    """
    return Memory(
        m.integral + g.T * aim.integral_rate,
        m.offset + g.T * m.offset_rate,
        m.offset_rate + g.T * offset_acceleration,
        m.surge_integral + g.T * g.k_iu * u_e,
        m.yaw_integral + g.T * g.k_ipsi * psi_e,
        m.W,
    )


@kernel
def step(
    motion: Motion, desired: Motion, acceleration: Acceleration, m: Memory, g: Gains
) -> tuple[tuple[float, float], StepTerms, Memory]:
    """One period: guidance, command filter, the two controllers, saturation."""
    aim = guide(motion, desired, m.integral, g)
    # Critically damped second-order filter of the heading offset; its derivatives are fed forward below. Filtering the
    # offset instead of the heading leaves the reference's own turn without a lag.
    offset_acceleration = g.w_c * (g.w_c * wrap(aim.offset - m.offset) - 2.0 * m.offset_rate)
    psi_c, r_c = desired.psi + m.offset, desired.r + m.offset_rate
    psi_e, r_e = wrap(motion.psi - psi_c), motion.r - r_c
    # The speed is reduced while the ship points away from its course, to zero at 90 degrees.
    alignment = math.cos(psi_e)
    u_c = aim.speed * (alignment if alignment > 0.0 else 0.0)
    u_e = motion.u - u_c

    feedback_1 = -g.k_u * u_e - m.surge_integral
    feedback_2 = -2.0 * g.zeta * g.w_psi * r_e - g.w_psi * g.w_psi * psi_e - m.yaw_integral
    demand_1 = g.m11 * (acceleration.du + feedback_1)
    demand_2 = g.m33 * (acceleration.dr + offset_acceleration + feedback_2)
    tau_1, tau_2 = clip(demand_1, g.tau_1max), clip(demand_2, g.tau_2max)
    saturated_1, saturated_2 = tau_1 != demand_1, tau_2 != demand_2
    # Anti-windup: an integrator takes no error in while its actuator is saturated.
    after = integrate(aim, offset_acceleration, 0.0 if saturated_1 else u_e, 0.0 if saturated_2 else psi_e, m, g)
    e = tracking_error(transform(motion), transform(desired))
    flags = 1.0 if saturated_1 else 0.0, 1.0 if saturated_2 else 0.0
    return (tau_1, tau_2), StepTerms(e.z1, e.z2, e.z3, wrap(psi_c), r_c, u_c, flags[0], flags[1]), after


class LosPidController(KernelLaw[LosPidParameters]):
    """The law with its internal state, integrators and command filter, which are integrated by one Euler step per period."""

    name = "los_pid"
    kernel = staticmethod(step)
    terms = StepTerms
    memory: Memory

    def retune(self, parameters: LosPidParameters) -> None:
        """Take new gains and keep the integrals."""
        known, adaptive = self.vessel, parameters.guidance == "alos"
        gains = adapted(parameters, known)
        limits = {"tau_1max": known.surge_force_limit, "tau_2max": known.yaw_moment_limit}
        self.constants = Gains(**schema.symbols(gains), **schema.symbols(known), **limits, T=self.period, adaptive=adaptive)

    def reset(self) -> None:
        """Set the integrals and the command filter to zero."""
        self.memory = Memory(0.0, 0.0, 0.0, 0.0, 0.0, NO_NETWORKS)
