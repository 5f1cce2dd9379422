"""Course control, case 1: the paper's yaw law for the heading alone, with one sliding surface and one network.

The paper gives no equations for this case; these are (17) to (22) without the sway surface, a = 0 and b = 1.

S = c2·z3e + dz3e,  tau_2 = m33·(-c2·dz3e - fr + ddz3d - eta·sgn S - k·S),  dWr = gamma·S·H

| symbol | meaning | unit | equation |
|---|---|---|---|
| z3e | heading error | rad | (11) |
| S | sliding surface, sigma2 | rad/s | (17) |
| c2 | slope of the surface | 1/s | (17) |
| k, eta, phi | reaching gain, switching gain, boundary layer | 1/s, rad/s², rad/s | (21) |
| gamma | adaptation gain | 1/s | (29) |
| fr, Wr | network output for f_r, its weights, shape (l,) | rad/s² | (15) |
| H | activations of the network, shape (l,) | - | (2) |
| tau_1, tau_2 | constant surge force, yaw moment | N, N·m | (22) |

The PD heading controller that case 1 compares with the sliding-mode law.

tau_2 = m33·dr_d + d_r·r_d - Kp·z3e - Kd·dz3e

| symbol | meaning | unit | equation |
|---|---|---|---|
| z3e, dz3e | heading error and its rate | rad, rad/s | (11) |
| r_d, dr_d | desired yaw rate and its derivative | rad/s, rad/s² | (8) |
| Kp, Kd | gains on the error and on its rate | N·m/rad, N·m·s/rad | - |
| d_r | assumed linear yaw damping | kg·m²/s | (6) |
| tau_1, tau_2 | constant surge force, yaw moment | N, N·m | - |

The paper gives neither the form nor the gains of its PD controller. The first two terms are the usual reference feedforward of a
course autopilot, the moment that a ship with linear damping needs for the desired motion; without it a PD controller lags behind
a sine. The gains are chosen to reproduce Figures 1 and 2, where the controller takes most of a cycle to converge and deviates by
ten degrees under the disturbance: the damping ratio is 2.4, and the disturbance of section 6.2, a moment that oscillates between
0 and 1900e2 N·m, turns the ship by up to 10.9°.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.interface.law import NO_NETWORKS, AdaptiveLaw, KernelLaw
from vessel_hsmc_ros.control.interface.network import NetworkParameters, Neurons, activate, adapt, output
from vessel_hsmc_ros.control.laws.hierarchical_printed import SWITCHING, check_step, gain, layer, switch
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.kernel import Array, kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, wrap
from vessel_hsmc_ros.core.schema import group, parameter


def thrust() -> float:
    """Declare the constant surge force of a law that controls the heading alone, 0 by default."""
    return parameter(0.0, "Constant surge force.", unit="N", low=-1e9, high=1e9, symbol="tau_1", tunable=True)


@dataclass(frozen=True)
class CourseLawParameters:
    """Gains of the paper's yaw law; it gives no adaptation gain, boundary layer or surge force, so those are our choice."""

    heading_surface_slope: float = gain(0.3, "Slope of the heading surface (17).", "1/s", "c2")
    reaching_gain: float = gain(100.0, "Reaching gain of the heading surface (21).", "1/s", "k")
    switching_gain: float = gain(0.001, "Switching gain of the law (21).", "rad/s²", "eta")
    adaptation_gain: float = gain(0.001, "Adaptation gain of the network for f_r (29).", "1/s", "gamma")
    switching: str = parameter(
        "sgn", "Switching function of the law: sgn as printed, saturation with a boundary layer, or tanh.", choices=SWITCHING
    )
    boundary_layer: float = layer("Boundary layer of the heading surface; not used with sgn.", "rad/s", "phi")
    surge_force: float = thrust()
    network: NetworkParameters = group(NetworkParameters)


class Gains(NamedTuple):
    """The constants of the law by their symbols, and the index of the switching function in SWITCHING."""

    c2: float
    k: float
    eta: float
    gamma: float
    phi: float
    tau_1: float
    m33: float
    T: float
    switching: int


class Constants(NamedTuple):
    """What does not change from step to step."""

    gains: Gains
    neurons: Neurons


class Memory(NamedTuple):
    """Internal state of the law."""

    W: Array  # weights, shape (1, l), written in place
    H: Array  # activations of the last step, shape (l,), written in place
    scratch: Array  # working memory, shape (1, l)
    # rate of the weights of the last step, divided by H and times T, shape (1, 1), written in place; the next step integrates
    # it
    growth: Array


class StepTerms(NamedTuple):
    """The terms of a step, by their names in `Terms`."""

    heading_error: float
    heading_error_rate: float
    heading_surface: float
    yaw_surface: float
    yaw_estimate: float


@kernel
def step(
    motion: Motion, desired: Motion, acceleration: Acceleration, m: Memory, constants: Constants
) -> tuple[tuple[float, float], StepTerms, Memory]:
    """One period: the Euler step of the weights that the last period has left, then the wrench.

    `m`: internal state; its arrays are written in place.
    """
    g, neurons = constants
    # Adaptation (29) after the wrench of its period: a step uses the weights that its terms report.
    adapt(m.W, m.growth, m.H, m.scratch)
    activate(motion.u, motion.v, motion.r, neurons, m.H)
    z3e, dz3e = wrap(motion.psi - desired.psi), motion.r - desired.r
    fr = output(m.W[0], m.H, m.scratch)
    S = g.c2 * z3e + dz3e
    # The yaw acceleration for which dS = 0 if fr is exact; switching and reaching terms are added to it.
    equivalent = -g.c2 * dz3e - fr + acceleration.dr
    tau_2 = g.m33 * (equivalent - g.eta * switch(S, g.phi, g.switching) - g.k * S)
    m.growth[0, 0] = g.T * (g.gamma * S)
    return (g.tau_1, tau_2), StepTerms(z3e, dz3e, S, S, fr), m


class CourseController(AdaptiveLaw[CourseLawParameters]):
    """The law with its internal state, the weights, which are integrated by one Euler step per period.

    `vessel`: the known inertia; the limits are not used, as in the paper.
    """

    name = "course"
    keeps_limits = False
    tracks = False
    kernel = staticmethod(step)
    terms = StepTerms
    networks = ("yaw",)
    memory: Memory

    def retune(self, parameters: CourseLawParameters) -> None:
        """Take new gains and keep the weights; the size of the network stays as constructed."""
        check_step(parameters, "reaching_gain", "heading_surface_slope", self.period, "course")
        known, switching = schema.symbols(self.vessel), SWITCHING.index(parameters.switching)
        gains = Gains(**schema.symbols(parameters), m33=known["m33"], T=self.period, switching=switching)
        self.constants = Constants(gains, self.neurons)

    def reset(self) -> None:
        """Set all weights to zero."""
        neurons = len(self.neurons.mu)
        self.memory = Memory(np.zeros((1, neurons)), np.zeros(neurons), np.zeros((1, neurons)), np.zeros((1, 1)))


def pd_gain(default: float, description: str, unit: str, symbol: str) -> float:
    """Declare a non-negative gain that may be changed while the law runs; the arguments are those of `parameter`."""
    return parameter(default, description, unit=unit, low=0.0, high=1e15, symbol=symbol, tunable=True)


@dataclass(frozen=True)
class PdParameters:
    """PdGains of the PD controller, all of them our choice: the paper gives none."""

    heading_gain: float = pd_gain(1.0e6, "Yaw moment per heading error.", "N·m/rad", "Kp")
    yaw_rate_gain: float = pd_gain(3.0e7, "Yaw moment per yaw-rate error.", "N·m·s/rad", "Kd")
    yaw_damping: float = pd_gain(
        802e4, "Assumed linear yaw damping, for the feedforward of the desired yaw rate.", "kg·m²/s", "d_r"
    )
    surge_force: float = thrust()


class PdGains(NamedTuple):
    """The constants of the law by their symbols."""

    Kp: float
    Kd: float
    d_r: float
    tau_1: float
    m33: float


class PdMemory(NamedTuple):
    """There is no internal state: W has the shape (0, 0)."""

    W: NDArray[np.float64]


class PdTerms(NamedTuple):
    """The terms of a step, by their names in `Terms`."""

    heading_error: float
    heading_error_rate: float


@kernel
def pd_step(
    motion: Motion, desired: Motion, acceleration: Acceleration, m: PdMemory, g: PdGains
) -> tuple[tuple[float, float], PdTerms, PdMemory]:
    """The wrench for the present errors. `m`: internal state, returned unchanged."""
    z3e, dz3e = wrap(motion.psi - desired.psi), motion.r - desired.r
    # The moment that moves a ship with linear damping along the desired heading without any error.
    feedforward = g.m33 * acceleration.dr + g.d_r * desired.r
    tau_2 = feedforward - g.Kp * z3e - g.Kd * dz3e
    return (g.tau_1, tau_2), PdTerms(z3e, dz3e), m


class PdController(KernelLaw[PdParameters]):
    """The law; it has no internal state.

    `vessel`: the known inertia; the limits are not used. `period`: control period, s; the law does not depend on it.
    """

    name = "pd"
    keeps_limits = False
    tracks = False
    kernel = staticmethod(pd_step)
    terms = PdTerms
    memory = PdMemory(NO_NETWORKS)

    def retune(self, parameters: PdParameters) -> None:
        """Take new gains."""
        self.constants = PdGains(**schema.symbols(parameters), m33=schema.symbols(self.vessel)["m33"])
