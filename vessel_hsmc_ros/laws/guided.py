"""The guided law: the paper's two surfaces and networks below a guidance layer, inside the limits of the actuators.

| symbol | meaning | unit | equation |
|---|---|---|---|
| psi_c, r_c, u_c | commanded heading, yaw rate and surge velocity | rad, rad/s, m/s | guidance |
| sigma2 | heading surface -c(epsilon) + r - r_w | rad/s | (17) |
| S1 | yaw surface r - r_c, which is sigma2 behind the command filter | rad/s | (20) |
| S2 | surge surface u - u_c | m/s | (23) |
| rho_c, zeta | command filter: r_c - r_d and its integral part | rad/s, rad/s² | - |
| k1, k2 | reaching gains | 1/s | (21), (27) |
| fu, fv, fr | network outputs for f_u, f_v, f_r | m/s², m/s², rad/s² | (14), (15), (25) |
| Wu, Wv, Wr | their weights, shape (l,) | as the outputs | (14), (15), (25) |
| H | activations shared by the three networks, shape (l,) | - | (2) |
| e_u, e_v, e_r | innovations: measured velocity minus predicted | m/s, m/s, rad/s | predictor |
| tau_1, tau_2 | surge force, yaw moment | N, N·m | (28), (22) |

tau_2 = m33·(dr_c - fr - k1·S1) and tau_1 = m11·(du_c - fu - k2·S2), so that dS1 = -k1·S1 and dS2 = -k2·S2 once the networks know.
The networks learn from the innovations: W += (1 - z)²/T·e·H/(HᵀH). A network rests while its actuator is at its limit.
The law knows m11, m33 and the limits. docs/guided.md derives it.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.kinematics import TURN, tracking_error, transform
from vessel_hsmc_ros.laws import guidance
from vessel_hsmc_ros.laws.guidance import clip
from vessel_hsmc_ros.laws.guided_parameters import Gains, GuidedParameters, gains
from vessel_hsmc_ros.laws.known_vessel import KnownVessel
from vessel_hsmc_ros.laws.law import Law
from vessel_hsmc_ros.laws.network import activations
from vessel_hsmc_ros.laws.predictor import Motion, correct, predict
from vessel_hsmc_ros.laws.terms import Terms

Array = NDArray[np.float64]

LARGEST = 1e12
"""Numbers beyond it are taken as it: their powers must stay finite."""

SURPRISE = 1.0, 1.0, 0.2
"""Largest innovation that a network learns from: an outlier must not teach it."""


class Filter(NamedTuple):
    """Memory of the command filter and of guidance: rho_c, zeta, the direction of travel s and the integral xi."""

    rate: float = 0.0
    integral: float = 0.0
    s: float = 1.0
    xi: tuple[float, float] = (0.0, 0.0)


class Memory(NamedTuple):
    """What the law carries from one period to the next, beside the weights."""

    predicted: Motion
    filter: Filter = Filter()
    tau_1: float = 0.0
    tau_2: float = 0.0
    cut_1: bool = False
    cut_2: bool = False


class Estimates(NamedTuple):
    """Outputs of the networks; their weights are the rows of one array, in the same order."""

    fu: float
    fv: float
    fr: float


class Command(NamedTuple):
    """What guidance and the command filter ask for."""

    psi_c: float
    sigma2: float
    r_c: float
    dr_c: float
    u_c: float
    du_c: float


def readable(state: Array, reference: Array, acceleration: Array) -> tuple[Motion, Motion, list[float]]:
    """The law's input as plain numbers, none beyond LARGEST, headings in [-pi, pi]."""
    numbers: list[float] = [*np.asarray(state).tolist(), *np.asarray(reference).tolist(), *np.asarray(acceleration).tolist()]
    if max(map(abs, numbers)) > LARGEST:
        numbers[2], numbers[8] = math.remainder(numbers[2], TURN), math.remainder(numbers[8], TURN)
        numbers = [clip(number, LARGEST) for number in numbers]
    x, y, psi, u, v, r, x_d, y_d, psi_d, u_d, v_d, r_d = numbers[:12]
    ship = Motion(x, y, math.remainder(psi, TURN), u, v, r)
    return ship, Motion(x_d, y_d, math.remainder(psi_d, TURN), u_d, v_d, r_d), numbers[12:]


def learn(W: Array, H: Array, measured: Motion, m: Memory, g: Gains) -> Array:
    """The weights after an innovation, those of an actuator at its limit unchanged.

    Args:
        W: Weights, shape (3, l).
        H: Activations, shape (l,).
        measured: The ship.
        m: Memory.
        g: Gains.
    """
    p = m.predicted
    scale = 1.0 / (g.T * (float(np.dot(H, H)) + 1e-6))
    steps = (
        0.0 if m.cut_1 else (1.0 - g.z_u) ** 2 * scale * clip(measured.u - p.u, SURPRISE[0]),
        (1.0 - g.z_v) ** 2 * scale * clip(measured.v - p.v, SURPRISE[1]),
        0.0 if m.cut_2 else (1.0 - g.z_r) ** 2 * scale * clip(measured.r - p.r, SURPRISE[2]),
    )
    learnt: Array = W + np.multiply.outer(steps, H)
    return learnt


def command(
    motion: Motion, desired: Motion, acceleration: list[float], f: Estimates, m: Memory, g: Gains
) -> tuple[Command, Filter]:
    """Guidance and the command filter, and the filter moved on by a period.

    drho_c = zeta + lambda_c·(r_goal - rho_c), dzeta = kappa·lambda_c²·(r_goal - rho_c), with r_goal = c(epsilon) + r_w - r_d; the
    yaw acceleration it asks for is held to 2·a, and the integral part rests meanwhile. So that nothing winds up, rho_c is held
    where |S1| <= S1_max: a larger S1 would take more than the whole moment.

    Args:
        motion: The ship.
        desired: The reference.
        acceleration: du_d, dv_d, dr_d.
        f: Estimates.
        m: Memory.
        g: Gains.
    """
    rate, integral, s, xi = m.filter
    lead = motion.r - desired.r
    rate = min(max(rate, lead - g.S1_max), lead + g.S1_max)
    wanted = guidance.wanted_velocity(motion, desired, acceleration, xi, g)
    w = guidance.resolve(wanted, motion.psi)
    distance = math.hypot(motion.x - desired.x, motion.y - desired.y)
    s = guidance.direction_of_travel(s, w.w_t, distance, desired.u, wanted.fading, g)
    epsilon = guidance.heading_error(w, motion.v, s, g)
    dv = acceleration[1] + g.eta * (f.fv - acceleration[1])
    r_w = guidance.carried_rate(w, motion.v, dv, desired.r, s, g)
    turning = guidance.approach_rate(epsilon, g) + r_w

    rest = guidance.rest(w.w_t * w.w_t + w.w_n * w.w_n, motion.v, f.fu, f.fv, g)
    homing = g.k_h * rest * math.remainder(desired.psi - motion.psi, TURN)
    late = clip(turning + homing - desired.r, 2.0 * g.r_max) - rate
    asked = integral + g.step_c * late
    held = clip(asked, 2.0 * g.a_max)
    if held == asked:
        integral += g.kappa * g.lambda_c * g.step_c * g.T * late
    moved = Filter(rate + g.T * held, integral, s, guidance.drift(xi, motion, desired, wanted.carried, g))
    psi_c, r_c = motion.psi + epsilon, desired.r + rate
    return Command(psi_c, motion.r - turning, r_c, acceleration[2] + held, w.w_t, w.dw_t + motion.r * w.w_n), moved


def actuated(demand: float, last: float, limit: float, g: Gains) -> tuple[float, bool]:
    """A demand within the actuator's limit and within reach of the last command, and whether the limit cut it."""
    within = clip(demand, limit)
    if g.T_s > 0.0:
        within = last + clip(within - last, limit * g.T / g.T_s)
    return within, abs(demand) > limit


class GuidedController(Law[GuidedParameters]):
    """The law with its memory: weights, predicted motion and command filter.

    Args:
        parameters: Gains and network.
        vessel: What is known of the ship.
        period: Time between two updates, s.

    Raises:
        ParameterError: the listed centres are no triples.
    """

    def __init__(self, parameters: GuidedParameters, vessel: KnownVessel, period: float) -> None:
        self._neurons = parameters.network.neurons()
        super().__init__(parameters, vessel, period)

    def retune(self, parameters: GuidedParameters) -> None:
        """Take other gains and keep what was learnt; the network's shape stays as it was made."""
        self._gains = gains(parameters, self._vessel, self._period)

    def reset(self) -> None:
        """Forget all: the weights are zero, and the next state is taken as it is measured."""
        self.weights: Array = np.zeros((3, len(self._neurons.mu)))
        self.memory: Memory | None = None

    def _step(self, state: Array, reference: Array, reference_acceleration: Array) -> tuple[Array, Terms]:
        """Correct the prediction, learn, guide, steer within the limits, predict."""
        g = self._gains
        measured, desired, acceleration = readable(state, reference, reference_acceleration)
        m = self.memory or Memory(measured)
        motion = correct(m.predicted, measured, g.z_p, g.z_h, g.z_u, g.z_v, g.z_r)
        H = activations(np.array(motion[3:]), *self._neurons)
        self.weights = learn(self.weights, H, measured, m, g)
        f = Estimates(*np.dot(self.weights, H).tolist())
        asked, filtered = command(motion, desired, acceleration, f, m, g)

        S1, S2 = motion.r - asked.r_c, motion.u - asked.u_c
        tau_1, cut_1 = actuated(g.m11 * (asked.du_c - f.fu - g.k2 * S2), m.tau_1, g.tau_1max, g)
        tau_2, cut_2 = actuated(g.m33 * (asked.dr_c - f.fr - g.k1 * S1), m.tau_2, g.tau_2max, g)
        predicted = predict(motion, f.fu + tau_1 / g.m11, f.fv, f.fr + tau_2 / g.m33, g.T)
        self.memory = Memory(predicted, filtered, tau_1, tau_2, cut_1, cut_2)
        z_e = tracking_error(transform(measured), transform(desired))
        Wu, Wv, Wr = self.weights
        return np.array([tau_1, tau_2]), Terms(
            surge_error=z_e.z1, sway_error=z_e.z2, heading_error=z_e.z3,
            heading_surface=asked.sigma2, yaw_surface=S1, surge_surface=S2,
            commanded_heading=math.remainder(asked.psi_c, TURN),
            commanded_yaw_rate=asked.r_c, commanded_surge_velocity=asked.u_c,
            surge_estimate=f.fu, sway_estimate=f.fv, yaw_estimate=f.fr,
            surge_weights=Wu, sway_weights=Wv, yaw_weights=Wr,
            surge_saturated=cut_1, yaw_saturated=cut_2,
        )  # fmt: skip
