"""The paper's law: hierarchical sliding-mode control of yaw, sliding-mode control of surge, adaptive networks; (12) to (29).

| symbol | meaning | unit | equation |
|---|---|---|---|
| z1e, z2e, z3e | tracking errors | m, m, rad | (11) |
| sigma1, sigma2 | first-level surfaces, sway and heading | m/s, rad/s | (12), (17) |
| S1, S2 | second-level surface of yaw, surface of surge | rad/s, m/s | (20), (23) |
| c1, c2, c3 | slopes of sigma1, sigma2, S2 | 1/s | (12), (17), (23) |
| a, b | weights of sigma1, sigma2 in S1; the sign of a may be switched | rad/m, - | (20) |
| k1, k2 | reaching gains | 1/s | (21), (27) |
| eta1, eta2 | switching gains | rad/s², m/s² | (21), (27) |
| phi1, phi2 | boundary layers of S1, S2, not used with sgn | rad/s, m/s | - |
| gamma1, gamma2, gamma3 | adaptation gains of f_v, f_r, f_u | mixed | (29) |
| fu, fv, fr | network outputs for f_u, f_v, f_r | m/s², m/s², rad/s² | (14), (15), (25) |
| W | their weights W3, W1, W2, shape (3, l) | as the outputs | (14), (15), (25) |
| H | activations shared by the three networks, shape (l,) | - | (2) |
| tau_1, tau_2 | surge force, yaw moment | N, N·m | (28), (22) |

Two interpretations differ from the printed equations. The parts of tau_2 are summed before the division, because z1 cancels: the
printed (16) is singular at z1 = 0. The weights adapt by the law that makes the derivative of the Lyapunov function (32) negative:
the printed (29) assigns the networks to the wrong errors. It remains selectable.
Source: Trajectory tracking of underactuated surface vessels based on neural network and hierarchical sliding mode.

Switching functions of a sliding-mode law, and the longest control period for which it is stable in discrete time.

The switching functions are sgn as printed in (21) and (27), and two continuous approximations.

With s = c·e + de and the reaching law ds = -k·s, the error follows dde = -(k + c)·de - k·c·e. A sampled law holds the right-hand
side constant over the period T. The two discrete poles lie inside the unit circle if and only if

    (k + c)·T < 2

| symbol | meaning | unit | equation |
|---|---|---|---|
| k | reaching gain | 1/s | (21), (27) |
| c | slope of the surface | 1/s | (12), (17), (23) |
| T | control period | s | - |

The ship's own damping d changes the limit by a relative (d·T)²/12, about 1e-6 here. For the tau_2 of the hierarchical law, c is
(b·c2 - a·z1·c1)/(b - a·z1), which is practically c2 as long as z1 is far below b/a.
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.interface.law import AdaptiveLaw
from vessel_hsmc_ros.control.interface.network import Estimates, NetworkParameters, Neurons, activate, adapt, outputs
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ControlError, InstabilityError
from vessel_hsmc_ros.core.kernel import Array, clip, kernel
from vessel_hsmc_ros.core.kinematics import (
    Acceleration,
    Motion,
    tracking_error,
    transform,
    transform_acceleration,
    transform_rate,
)
from vessel_hsmc_ros.core.schema import group, parameter

SWITCHING = ("sgn", "saturation", "tanh")
SGN, _, TANH = range(3)  # indices of the switching functions in SWITCHING


@kernel
def sign(value: float) -> float:
    """The signum function of (21) and (27): -1, 0 or 1."""
    # math.copysign would give ±1 at zero; sgn 0 = 0 keeps a motion exactly on the surface undisturbed.
    if value > 0.0:
        return 1.0
    if value < 0.0:
        return -1.0
    return 0.0


@kernel
def switch(S: float, phi: float, kind: int) -> float:
    """The switching function of a surface: sgn S, sat(S/phi) or tanh(S/phi).

    The continuous functions avoid chattering: inside the boundary layer |S| < phi they act as a proportional gain. `phi`: width
    of the boundary layer, in the unit of S, above 0. `kind`: index in SWITCHING. Returns a value in [-1, 1].
    """
    if kind == SGN:
        return sign(S)
    if kind == TANH:
        return math.tanh(S / phi)
    return clip(S / phi, 1.0)


LIMIT = 2.0


def check_step(parameters: Any, gain: str, slope: str, period: float, law: str) -> None:
    """Reject a reaching gain and a slope that are unstable at a control period.

    `gain`, `slope`: names of the parameters that hold the reaching gain k and the slope c. `period`: control period T, s.
    `law`: name of the law, for the error message. Raises InstabilityError if (k + c)·T is 2 or more.
    """
    k, c = getattr(parameters, gain), getattr(parameters, slope)
    if (k + c) * period < LIMIT:
        return
    # Not positive if the slope alone is too large for the period: then only a higher rate helps.
    largest = LIMIT / period - c
    remedy = f"a gain below {largest:g} 1/s or a rate" if largest > 0.0 else "a rate"
    raise InstabilityError(
        f"controller.{law}.{gain} = {k:g} 1/s is unstable at controller.rate_hz = {1.0 / period:g} Hz:"
        f" gain plus {slope} = {c:g} 1/s, times the period, is {(k + c) * period:g} and must be below {LIMIT:g},"
        f" so set {remedy} above {(k + c) / LIMIT:g} Hz"
    )


def gain(default: float, description: str, unit: str, symbol: str) -> float:
    """Declare a non-negative gain that may be changed while the law runs; the arguments are those of `parameter`."""
    return parameter(default, description, unit=unit, low=0.0, high=1e9, symbol=symbol, tunable=True)


def layer(description: str, unit: str, symbol: str) -> float:
    """Declare the width of a boundary layer, 0.01 by default; the arguments are those of `parameter`."""
    return parameter(0.01, description, unit=unit, low=1e-9, high=1e3, symbol=symbol, tunable=True)


@dataclass(frozen=True)
class HierarchicalPrintedParameters:
    """Gains of the paper's section 6.2; it gives no adaptation gains, boundary layers or centres, so those are our choice."""

    sway_surface_slope: float = gain(0.3, "Slope of the sway surface (12).", "1/s", "c1")
    heading_surface_slope: float = gain(0.3, "Slope of the heading surface (17).", "1/s", "c2")
    surge_surface_slope: float = gain(0.3, "Slope of the surge surface (23).", "1/s", "c3")
    sway_weight: float = gain(0.001, "Weight of the sway surface in the yaw surface (20).", "rad/m", "a")
    heading_weight: float = gain(100.0, "Weight of the heading surface in the yaw surface (20).", "", "b")
    yaw_reaching_gain: float = gain(100.0, "Reaching gain of the yaw surface (21).", "1/s", "k1")
    surge_reaching_gain: float = gain(100.0, "Reaching gain of the surge surface (27).", "1/s", "k2")
    yaw_switching_gain: float = gain(0.001, "Switching gain of the yaw law (21).", "rad/s²", "eta1")
    surge_switching_gain: float = gain(0.001, "Switching gain of the surge law (27).", "m/s²", "eta2")
    # The units of the adaptation gains differ with the surfaces in (29); they are left out of the declarations.
    sway_adaptation_gain: float = gain(0.001, "Adaptation gain of the network for f_v (29).", "", "gamma1")
    yaw_adaptation_gain: float = gain(0.001, "Adaptation gain of the network for f_r (29).", "", "gamma2")
    surge_adaptation_gain: float = gain(0.001, "Adaptation gain of the network for f_u (29).", "", "gamma3")
    sway_weight_sign: str = parameter(
        "constant",
        "Sign of the sway weight: constant as printed, or switched so that both terms of the yaw surface agree in sign.",
        choices=("constant", "switched"),
    )
    switching: str = parameter(
        "sgn", "Switching function of both laws: sgn as printed, saturation with a boundary layer, or tanh.", choices=SWITCHING
    )
    yaw_boundary_layer: float = layer("Boundary layer of the yaw surface; not used with sgn.", "rad/s", "phi1")
    surge_boundary_layer: float = layer("Boundary layer of the surge surface; not used with sgn.", "m/s", "phi2")
    adaptation: str = parameter(
        "lyapunov",
        "Adaptation law of the weights: derived from the Lyapunov function (32), or (29) as printed.",
        choices=("lyapunov", "as_printed"),
    )
    network: NetworkParameters = group(NetworkParameters)


class Gains(NamedTuple):
    """The constants by the paper's symbols, the period T, and the interpretations; `switching` is an index in SWITCHING."""

    c1: float
    c2: float
    c3: float
    a: float
    b: float
    k1: float
    k2: float
    eta1: float
    eta2: float
    gamma1: float
    gamma2: float
    gamma3: float
    m11: float
    m33: float
    T: float
    phi1: float = 0.01
    phi2: float = 0.01
    switching: int = 0
    sign_switches: bool = False
    adapts_as_printed: bool = False


def gains(parameters: HierarchicalPrintedParameters, vessel: KnownVessel, period: float) -> Gains:
    """The constants of the law from its parameters, the known vessel and the control period, s."""
    p = parameters
    return Gains(
        **schema.symbols(p),
        **schema.symbols(vessel),
        T=period,
        switching=SWITCHING.index(p.switching),
        sign_switches=p.sway_weight_sign == "switched",
        adapts_as_printed=p.adaptation == "as_printed",
    )


class Rates(NamedTuple):
    """Rates of the weights of the three networks, divided by the activations H that they share."""

    u: float
    v: float
    r: float


class Constants(NamedTuple):
    """What does not change from step to step."""

    gains: Gains
    neurons: Neurons


class Memory(NamedTuple):
    """Internal state of the law.

    Attributes:
        W: Weights of the networks for f_u, f_v, f_r, shape (3, l), written in place.
        H: Activations of the last step, shape (l,), written in place.
        scratch: Working memory, shape (3, l).
        growth: Rates of the weights of the last step, divided by H and times T, shape (3, 1), written in place; the next step
            integrates them.
        side: Sign of b - a·z1 at the last step; 0 before the first.
    """

    W: Array
    H: Array
    scratch: Array
    growth: Array
    side: float


class StepTerms(NamedTuple):
    """The terms of a step, by their names in `Terms`."""

    surge_error: float
    sway_error: float
    heading_error: float
    surge_error_rate: float
    sway_error_rate: float
    heading_error_rate: float
    sway_surface: float
    heading_surface: float
    yaw_surface: float
    surge_surface: float
    surge_estimate: float
    sway_estimate: float
    yaw_estimate: float


def initial(neurons: int) -> Memory:
    """The internal state before the first step, for a number of neurons."""
    return Memory(np.zeros((3, neurons)), np.zeros(neurons), np.zeros((3, neurons)), np.zeros((3, 1)), 0.0)


UNDEFINED_WRENCH = math.nan, math.nan
UNDEFINED = StepTerms(*[math.nan] * len(StepTerms._fields))


@kernel
def sway_weight(sigma1: float, sigma2: float, g: Gains) -> float:
    """The weight a of (20): constant, or with the sign of sigma1·sigma2, so that both terms of S1 have the same sign.

    `sigma1`, `sigma2`: first-level surfaces of sway [m/s] and heading [rad/s]. Returns a, rad/m, with its sign.
    """
    return -g.a if g.sign_switches and sigma1 * sigma2 < 0.0 else g.a


@kernel
def control(
    motion: Motion, desired: Motion, acceleration: Acceleration, f: Estimates, g: Gains
) -> tuple[tuple[float, float], StepTerms]:
    """The wrench (22), (28), with the parts of tau_2 summed so that z1 cancels.

    tau_2 = [b·tau_eq22 - a·(z1·tau_eq21) + m33·(-eta1·sgn S1 - k1·S1)] / (b - a·z1)

    The equivalent controls tau_eq keep the motion on the surfaces; the switching and reaching terms drive it there. With
    g.switching other than sgn, its smooth approximation takes the place of sgn. Returns (tau_1 [N], tau_2 [N·m]) and the
    intermediate terms. Undefined where b = a·z1, which the caller must exclude.
    """
    u, v, r = motion.u, motion.v, motion.r
    z, z_d = transform(motion), transform(desired)
    dz, dz_d = transform_rate(z, motion), transform_rate(z_d, desired)
    ddz_d = transform_acceleration(z_d, desired, acceleration)
    z_e = tracking_error(z, z_d)
    dz1e, dz2e, dz3e = dz.z1 - dz_d.z1, dz.z2 - dz_d.z2, dz.z3 - dz_d.z3
    fu, fv, fr = f

    sigma1 = g.c1 * z_e.z2 + dz2e
    sigma2 = g.c2 * z_e.z3 + dz3e
    a = sway_weight(sigma1, sigma2, g)
    S1 = a * sigma1 + g.b * sigma2
    S2 = g.c3 * z_e.z1 + dz1e

    # z1 times (16): the condition dsigma1 = 0 contains the moment only as -z1·tau_2/m33, so (16) divides by z1, and a·z1 in the
    # weighted sum of (22) multiplies by it again.
    z1_tau_eq21 = -g.m33 * (-g.c1 * dz2e - fv + (u + z.z2 * r) * r + z.z1 * fr + ddz_d.z2)
    tau_eq22 = g.m33 * (-g.c2 * dz3e - fr + ddz_d.z3)
    reaching = g.m33 * (-g.eta1 * switch(S1, g.phi1, g.switching) - g.k1 * S1)
    tau_2 = (g.b * tau_eq22 - a * z1_tau_eq21 + reaching) / (g.b - a * z.z1)

    # (28) needs tau_2: the yaw acceleration enters ddz1 as z2·dr.
    tau_eq1 = g.m11 * (-g.c3 * dz1e - fu - (v - z.z1 * r) * r - z.z2 * (fr + tau_2 / g.m33) + ddz_d.z1)
    tau_1 = tau_eq1 + g.m11 * (-g.eta2 * switch(S2, g.phi2, g.switching) - g.k2 * S2)

    return (tau_1, tau_2), StepTerms(z_e.z1, z_e.z2, z_e.z3, dz1e, dz2e, dz3e, sigma1, sigma2, S1, S2, fu, fv, fr)


@kernel
def adaptation(z1: float, z2: float, S1: float, S2: float, a: float, g: Gains) -> Rates:
    """Rates of the weights, divided by H, that cancel the cross terms of (32); those of (29) if g.adapts_as_printed.

    dWv = gamma1·a·S1·H, dWr = gamma2·((b - a·z1)·S1 + z2·S2)·H, dWu = gamma3·S2·H
    (29): dWv = gamma1·S2·H, dWr = gamma2·a·S1·H, dWu = gamma3·(b·z1·S1 - a·z1·S1 + z2·S2)·H

    `z1`, `z2`: transformed position of the ship (9), m. `S1`, `S2`: surfaces of yaw [rad/s] and surge [m/s]. `a`: weight of the
    sway surface with the sign that the control law has used, rad/m. Returns time derivatives of the weights, divided by H.
    """
    if g.adapts_as_printed:
        return Rates(g.gamma3 * (g.b * z1 * S1 - a * z1 * S1 + z2 * S2), g.gamma1 * S2, g.gamma2 * a * S1)
    return Rates(g.gamma3 * S2, g.gamma1 * a * S1, g.gamma2 * ((g.b - a * z1) * S1 + z2 * S2))


@kernel
def side_of_singularity(z1: float, last: float, g: Gains) -> float:
    """The side of z1 = b/a, where the denominator of (22) vanishes, on which the ship is.

    The moment grows without bound towards it, and behind it the gain has the wrong sign. `z1`: transformed position (9), m.
    `last`: the side at the last step; 0 before the first. Returns 1 or -1; NaN if the ship is there, or has crossed it since
    the last step.
    """
    distance = g.b - g.a * (abs(z1) if g.sign_switches else z1)
    # A step can jump over the singularity, therefore the side is compared with that of the last step.
    if abs(distance) <= 1e-9 * g.b or distance * last < 0.0:
        return math.nan
    return math.copysign(1.0, distance)


@kernel
def step(
    motion: Motion, desired: Motion, acceleration: Acceleration, m: Memory, constants: Constants
) -> tuple[tuple[float, float], StepTerms, Memory]:
    """One period: the Euler step of the weights that the last period has left, then the wrench (22), (28).

    `m`: internal state; its arrays are written in place. Returns the wrench, its terms, and the internal state. At the
    singularity the wrench is NaN, and the state unchanged.
    """
    g, neurons = constants
    z = transform(motion)
    side = side_of_singularity(z.z1, m.side, g)
    if math.isnan(side):
        return UNDEFINED_WRENCH, UNDEFINED, m
    adapt(m.W, m.growth, m.H, m.scratch)
    activate(motion.u, motion.v, motion.r, neurons, m.H)
    f = outputs(m.W, m.H, m.scratch)
    wrench, terms = control(motion, desired, acceleration, f, g)
    # The adaptation law takes the weight a with the sign that the control law has just used.
    a = sway_weight(terms.sway_surface, terms.heading_surface, g)
    rates = adaptation(z.z1, z.z2, terms.yaw_surface, terms.surge_surface, a, g)
    m.growth[0, 0], m.growth[1, 0], m.growth[2, 0] = g.T * rates.u, g.T * rates.v, g.T * rates.r
    return wrench, terms, Memory(m.W, m.H, m.scratch, m.growth, side)


class HierarchicalPrintedController(AdaptiveLaw[HierarchicalPrintedParameters]):
    """The law with its internal state, the weights, which are integrated by one Euler step per period.

    `vessel`: the known inertia; the paper's law does not use the limits.
    """

    name = "hierarchical_printed"
    keeps_limits = False
    kernel = staticmethod(step)
    terms = StepTerms
    networks = ("surge", "sway", "yaw")
    memory: Memory

    def retune(self, parameters: HierarchicalPrintedParameters) -> None:
        """Take new gains and keep the weights; the size of the network stays as constructed."""
        for gain, slope in (("yaw_reaching_gain", "heading_surface_slope"), ("surge_reaching_gain", "surge_surface_slope")):
            check_step(parameters, gain, slope, self.period, "hierarchical_printed")
        self.constants = Constants(gains(parameters, self.vessel, self.period), self.neurons)
        # New gains move the singularity z1 = b/a, so the ship may be on its other side.
        if hasattr(self, "memory"):
            self.memory = self.memory._replace(side=0.0)

    def reset(self) -> None:
        """Set all weights to zero."""
        self.memory = initial(len(self.neurons.mu))

    def explain_undefined(self, motion: Motion) -> None:
        """Report the singularity."""
        g, z1 = self.constants.gains, transform(motion).z1
        if math.isnan(side_of_singularity(z1, self.memory.side, g)):
            raise ControlError(
                f"the hierarchical law is singular at b = a·z1: a = {g.a:g}, b = {g.b:g}, and the ship is at z1 = {z1:g} m"
            )
