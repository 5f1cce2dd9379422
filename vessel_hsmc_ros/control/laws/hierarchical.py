"""Hierarchical sliding-mode control with adaptive networks about a point on the vessel: the paper's law (12) to (29), repaired.

| symbol | meaning | unit | equation |
|---|---|---|---|
| e, d | position error p - p_d and its length | m | (11) |
| f | rate at which the error is to decay | 1/s | (12) |
| w | wanted velocity dp_d - f·e | m/s | (12) |
| psi_e | heading error | rad | (11) |
| r_c | yaw rate of the reference, corrected for the current | rad/s | (17) |
| sigma1, sigma2 | first-level surfaces of sway and heading | m/s, rad/s | (12), (17) |
| l, ahead | distance of the controlled point ahead of the origin, b/a of the paper | m | (20) |
| U | wanted speed through the water, the length of w - c | m/s | - |
| a_r | yaw deceleration that a turn is to need at most | rad/s² | - |
| S1, S2 | second-level surface of yaw, surface of surge | m/s, m/s | (20), (23) |
| k1, k2; eta1, eta2; phi1, phi2 | reaching gains, switching gains, boundary layers | 1/s, m/s², m/s | (21), (27) |
| j | largest rate of the yaw acceleration; a reaching of at most sqrt(2·j·l·S1) can be stopped in time | rad/s³ | - |
| fu, fv, fr | network outputs for f_u, f_v, f_r | m/s², m/s², rad/s² | (14), (15), (25) |
| W, H | their weights, shape (3, l), and activations, shape (l,) | as the outputs, - | (1), (2) |
| x_p | motion that networks and wrench predict, from which the surfaces are computed | as x, y, psi, u, v, r | - |
| eu, ev, er | prediction errors of u, v, r: measured less predicted | m/s, m/s, rad/s | - |
| c | estimated current, earth-fixed, and lasting sway velocity of the hull | m/s | - |
| tau_1, tau_2 | surge force, yaw moment | N, N·m | (28), (22) |

    f = 2·c/(1 + sqrt(1 + 2·c²·d/a)),   l⁴ = (l0² + (T_a·U)²)² + (U·sigma1/(2·a_r))², with the sign of u_d
    sigma1 = v - w·beam,   sigma2 = r - r_c,   S1 = sigma1 + l·sigma2,   S2 = u - w·bow

S1 and S2 are the velocity error of the point at the distance l ahead, across and along the hull. In the printed law this point is
b/a = 100 km ahead. Far off the course l grows, so that S1 = 0 asks for the yaw rate that the deceleration a_r stops within the
course error sigma1/U. Both surfaces obey dS = -k·S - eta·sat(S/phi) as far as networks are right and the wrench is not limited.
They take the predicted motion, at the time at which the command arrives at the hull, so noise does not reach the wrench directly.
docs/hierarchical.md derives the law and states what is proven. Source: docs/paper.md.

What the hierarchical law wants: the velocity that reduces the error, and the turn of the hull in a current.

The symbols are those of `hierarchical`.
"""

import math
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.control.interface.actuators import (
    BEST,
    DEAD_TIMES,
    Bank,
    BankState,
    applied,
    arriving,
    bank,
    first_state,
    identify,
    lead,
    with_model,
)
from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.interface.law import AdaptiveLaw
from vessel_hsmc_ros.control.interface.network import Estimates, Neurons, activate, adapt, outputs
from vessel_hsmc_ros.control.laws.hierarchical_parameters import LASTING, Gains, HierarchicalParameters, gains
from vessel_hsmc_ros.core.kernel import Array, clip, kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, extrapolate, magnitude, to_body, wrap


class Guidance(NamedTuple):
    """Errors, their rates and the wanted velocity with its rate, each along bow (1) and beam (2)."""

    e1: float
    e2: float
    psi_e: float
    de1: float
    de2: float
    w1: float
    w2: float
    dw1: float
    dw2: float


@kernel
def guidance(motion: Motion, desired: Motion, acceleration: Acceleration, g: Gains) -> Guidance:
    """The wanted velocity w = dp_d - f·e and its rate dw = ddp_d - f·de - df·e, resolved along the hull."""
    psi_e, r_d = wrap(motion.psi - desired.psi), desired.r
    e1, e2 = to_body(motion.x - desired.x, motion.y - desired.y, motion.psi)
    v1, v2 = to_body(desired.u, desired.v, psi_e)
    a1, a2 = to_body(acceleration.du - r_d * desired.v, acceleration.dv + r_d * desired.u, psi_e)
    de1, de2 = motion.u - v1, motion.v - v2
    d = magnitude(e1, e2)
    root = math.sqrt(1.0 + 2.0 * g.c * g.c * d / g.a)
    f = 2.0 * g.c / (1.0 + root)
    dd = (e1 * de1 + e2 * de2) / max(d, 1e-9)
    df = -f * g.c * g.c * dd / (g.a * root * (1.0 + root))
    return Guidance(
        e1, e2, psi_e, de1, de2, v1 - f * e1, v2 - f * e2, a1 - f * de1 - df * e1, a2 - f * de2 - df * e2
    )  # fmt: skip


@kernel
def turn_in_current(desired: Motion, acceleration: Acceleration, c: tuple[float, float, float], g: Gains) -> tuple[float, float]:
    """The yaw rate r_c of the reference in a current, and its rate: the hull points along its way through the water.

    r_c = s·r_d with the share s = v_d·(v_d - c)/|v_d - c|² by which the velocity through the water turns faster than v_d. In the
    axes of the reference the current turns by -r_d.
    """
    c1, c2 = to_body(c[0], c[1], desired.psi)
    u, v = desired.u - c1, desired.v - c2
    du, dv = acceleration.du - desired.r * c2, acceleration.dv + desired.r * c1
    least = g.U_c * g.U_c
    below = u * u + v * v + least
    share = (desired.u * u + desired.v * v + least) / below
    above = acceleration.du * u + desired.u * du + acceleration.dv * v + desired.v * dv
    dshare = (above - 2.0 * share * (u * du + v * dv)) / below
    return desired.r * share, acceleration.dr * share + desired.r * dshare


@kernel
def learned_current(motion: Motion, desired: Motion, c: tuple[float, float, float], g: Gains) -> tuple[float, float, float]:
    """The estimated current and the lasting sway velocity after a period: what the hull drifts sideways beyond the reference.

    The drift of a current turns with the hull, which tells it from what is fixed to the hull.
    """
    c_x, c_y, lasting = c
    cosine, sine = math.cos(motion.psi), math.sin(motion.psi)
    growth = g.T / g.T_c * clip(motion.v - desired.v - (c_y * cosine - c_x * sine) - lasting, g.U_c)
    return c_x - sine * growth, c_y + cosine * growth, lasting + LASTING * growth


LONGEST_ROLL = 12
"""Number of prediction steps through a delay, however many periods it has."""

MAX_AGE = 2.0
"""Age of a measurement up to which the identification of the actuators keeps commands, s."""


class Constants(NamedTuple):
    """What does not change from step to step."""

    gains: Gains
    neurons: Neurons
    bank: Bank


class Memory(NamedTuple):
    """Internal state of the law; arrays are written in place.

    Attributes:
        W, H, scratch: Weights, activations of the last step, and working memory, shapes (3, l), (l,) and (3, l).
        growth: Rates of the weights of the last step, divided by H and times T, shape (3, 1); the next step integrates them.
        predicted: Motion that is predicted for this step; NaN before the first.
        tau_1, tau_2: Wrench that acts since the last step, as modelled.
        queue: The last commands, (2, n + 1), of which the present one is in the column `head`.
        c: Estimated current along x and y, and lasting sway velocity of the hull.
        bank: What is learned of the actuators.
    """

    W: Array
    H: Array
    scratch: Array
    growth: Array
    predicted: Motion
    tau_1: float
    tau_2: float
    head: int
    queue: Array
    c: tuple[float, float, float]
    bank: BankState


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
    commanded_surge_velocity: float
    commanded_yaw_rate: float
    surge_estimate: float
    sway_estimate: float
    yaw_estimate: float
    surge_saturated: float
    yaw_saturated: float


@kernel
def adapt_weights(m: Memory, errors: tuple[float, float, float], S: tuple[float, float, float], g: Gains) -> None:
    """The rates of the weights (29), normalised: dW = (gamma·S + rho·error)·H/|H|², with rho = lam²/4.

    `m`: internal state, whose `growth` is written. `S`: parts of the surfaces for f_u, f_v and f_r: S2, S1 and l·S1, or 0 while
    the wrench is limited.
    """
    power = 1e-12
    for h in m.H.tolist():
        power += h * h
    m.growth[0, 0] = g.T / power * (g.rho * errors[0] + g.gamma3 * S[0])
    m.growth[1, 0] = g.T / power * (g.rho * errors[1] + g.gamma1 * S[1])
    m.growth[2, 0] = g.T / power * (g.rho * errors[2] + g.gamma2 * S[2])


@kernel
def innovation(motion: Motion, estimate: Motion) -> Motion:
    """The prediction errors: the measured motion less the estimated one."""
    return Motion(
        motion.x - estimate.x, motion.y - estimate.y, wrap(motion.psi - estimate.psi),
        motion.u - estimate.u, motion.v - estimate.v, motion.r - estimate.r,
    )  # fmt: skip


@kernel
def predict(estimate: Motion, rates: Acceleration, e: Motion, g: Gains) -> Motion:
    """The motion that is predicted for the next step by networks and wrench, corrected by lam times the prediction errors."""
    later, step = extrapolate(estimate, rates, g.T), g.T * g.lam
    return Motion(
        later.x + step * e.x, later.y + step * e.y, later.psi + step * e.psi,
        later.u + step * e.u, later.v + step * e.v, later.r + step * e.r,
    )  # fmt: skip


@kernel
def ahead(motion: Motion, f: Estimates, n_1: int, n_2: int, m: Memory, g: Gains) -> tuple[Motion, float, float]:
    """The motion at which the later of the present commands arrives at the hull, and what acts just before each of them arrives.

    `motion`: estimated motion, at the time of the measurement. `n_1`, `n_2`: periods until the commands of force and moment
    arrive.
    """
    tau_1, tau_2, n = m.tau_1, m.tau_2, max(n_1, n_2)
    before_1, before_2 = tau_1, tau_2
    stride, count, sum_1, sum_2 = 1 + n // LONGEST_ROLL, 0, 0.0, 0.0
    for i in range(n):
        # The faster input's command of periods to come is not known: its last one is held.
        tau_1 = applied(tau_1, arriving(m.queue, 0, m.head, max(n_1 - i, 1)), g.surge)
        tau_2 = applied(tau_2, arriving(m.queue, 1, m.head, max(n_2 - i, 1)), g.yaw)
        before_1, before_2 = tau_1 if i < n_1 else before_1, tau_2 if i < n_2 else before_2
        count, sum_1, sum_2 = count + 1, sum_1 + tau_1, sum_2 + tau_2
        if count == stride or i == n - 1:
            rates = Acceleration(f.fu + sum_1 / count / g.m11, f.fv, f.fr + sum_2 / count / g.m33)
            motion = extrapolate(motion, rates, g.T * count)
            count, sum_1, sum_2 = 0, 0.0, 0.0
    return motion, before_1, before_2


class Surfaces(NamedTuple):
    """The surfaces, the distance of the controlled point, the slope of S1 over v, and the wrench without limits."""

    sigma1: float
    sigma2: float
    S1: float
    S2: float
    ahead: float
    slope: float
    tau_1: float
    tau_2: float


@kernel
def control(
    motion: Motion, n: Guidance, turn: tuple[float, float], c: tuple[float, float, float], way: float, f: Estimates, g: Gains
) -> Surfaces:
    """The surfaces (12) to (23) and the wrench (22), (28): equivalent control, reaching and switching part.

    tau_2 = m33/l·(dw·beam - r·w·bow + l·dr_c - dl·sigma2 - f_v - l·f_r - min(k1·S1 + eta1·sat(S1/phi1), sqrt(2·j·l·S1)))
    tau_1 = m11·(dw·bow + r·w·beam - f_u - k2·S2 - eta2·sat(S2/phi2))

    `way`: surge velocity of the reference, whose sign l has. `turn`: r_c and its rate.
    """
    r, square = motion.r, g.T_a * g.T_a
    sigma1, sigma2, dsigma1 = motion.v - n.w2, r - turn[0], f.fv - n.dw2 + r * n.w1
    c1, c2 = to_body(c[0], c[1], motion.psi)
    U1, U2 = n.w1 - c1, n.w2 - c2
    U = max(math.sqrt(U1 * U1 + U2 * U2), 1e-9)
    dU, X_v = (U1 * n.dw1 + U2 * n.dw2) / U, 0.5 * U / g.a_r
    Q, X = g.l0 * g.l0 + square * U * U, X_v * sigma1
    dQ, dX = 2.0 * square * U * dU, 0.5 * dU / g.a_r * sigma1 + X_v * dsigma1
    ahead = math.copysign((Q * Q + X * X) ** 0.25, way)
    cube = 2.0 * ahead * ahead * ahead
    dl = (Q * dQ + X * dX) / cube

    S1, S2 = sigma1 + ahead * sigma2, motion.u - n.w1
    slope = 1.0 + sigma2 * X * X_v / cube
    equivalent_2 = -dsigma1 + ahead * turn[1] - dl * sigma2 - ahead * f.fr
    reaching = clip(g.k1 * S1 + g.eta1 * clip(S1 / g.phi1, 1.0), math.sqrt(2.0 * g.j * abs(ahead * S1)))
    tau_2 = g.m33 / ahead * (equivalent_2 - reaching)
    equivalent_1 = n.dw1 + r * n.w2 - f.fu
    tau_1 = g.m11 * (equivalent_1 - g.k2 * S2 - g.eta2 * clip(S2 / g.phi2, 1.0))
    return Surfaces(sigma1, sigma2, S1, S2, ahead, slope, tau_1, tau_2)


@kernel
def step(
    motion: Motion,
    desired: Motion,
    acceleration: Acceleration,
    m: Memory,
    constants: Constants,
    age: float = 0.0,
    heading: float = math.nan,
) -> tuple[tuple[float, float], StepTerms, Memory]:
    """One period: the Euler step of the weights that the last period has left, the wrench, and the prediction for the next one.

    `m`: internal state; its arrays are written in place. `constants`: gains, neurons and the models of the actuators. `age`:
    how long ago vessel and reference were in these states, s. `heading`: measured heading; that of `motion` by default.
    """
    g, neurons, models = constants
    estimate, age = m.predicted if math.isfinite(m.predicted.x) else motion, min(age, MAX_AGE)
    adapt(m.W, m.growth, m.H, m.scratch)
    activate(estimate.u, estimate.v, estimate.r, neurons, m.H)
    f = outputs(m.W, m.H, m.scratch)
    late = min(int(age / g.T + 0.5), m.queue.shape[1] - 1 - max(g.surge.delay, g.yaw.delay))
    n_1, n_2 = g.surge.delay + late, g.yaw.delay + late
    ship, tau_1, tau_2 = ahead(estimate, f, n_1, n_2, m, g)
    goal = extrapolate(desired, acceleration, g.T * max(n_1, n_2))

    n, turn = guidance(ship, goal, acceleration, g), turn_in_current(goal, acceleration, m.c, g)
    s = control(ship, n, turn, m.c, goal.u, f, g)
    demand_1, demand_2 = clip(s.tau_1, g.tau_1max), clip(s.tau_2, g.tau_2max)
    free_1, free_2 = 1.0 if demand_1 == s.tau_1 else 0.0, 1.0 if demand_2 == s.tau_2 else 0.0
    wrench = lead(tau_1, demand_1, g.surge), lead(tau_2, demand_2, g.yaw)
    m.queue[0, m.head], m.queue[1, m.head] = wrench

    e = innovation(motion, estimate)
    adapt_weights(m, (e.u, e.v, e.r), (free_1 * s.S2, free_2 * s.slope * s.S1, free_2 * s.ahead * s.S1), g)
    tau_1 = applied(m.tau_1, arriving(m.queue, 0, m.head, n_1), g.surge)
    tau_2 = applied(m.tau_2, arriving(m.queue, 1, m.head, n_2), g.yaw)
    predicted = predict(estimate, Acceleration(f.fu + tau_1 / g.m11, f.fv, f.fr + tau_2 / g.m33), e, g)
    if models.every > 0:
        identify(m.bank, models, heading if math.isfinite(heading) else motion.psi, age, wrench[1])
    e1, e2 = to_body(motion.x - desired.x, motion.y - desired.y, motion.psi)
    terms = StepTerms(
        e1, e2, wrap(motion.psi - desired.psi), n.de1, n.de2, ship.r - goal.r, s.sigma1, s.sigma2, s.S1, s.S2, n.w1, turn[0],
        f.fu, f.fv, f.fr, 1.0 - free_1, 1.0 - free_2,
    )  # fmt: skip
    c = learned_current(estimate, desired, m.c, g)
    head = m.head + 1 if m.head + 1 < m.queue.shape[1] else 0
    return wrench, terms, Memory(m.W, m.H, m.scratch, m.growth, predicted, tau_1, tau_2, head, m.queue, c, m.bank)


@kernel
def outdated(m: Memory, constants: Constants) -> bool:
    """Whether another model of the actuators explains the motion than the one that the gains are for."""
    return int(m.bank.numbers[BEST]) != constants.bank.used


class HierarchicalController(AdaptiveLaw[HierarchicalParameters]):
    """The law with its internal state: weights, predictions, estimated current and identified actuators.

    `parameters`: numbers of the law and network.
    """

    name = "hierarchical"
    takes_age = True
    takes_heading = True
    kernel = staticmethod(step)
    outdated = staticmethod(outdated)
    terms = StepTerms
    networks = ("surge", "sway", "yaw")
    memory: Memory

    def __init__(self, parameters: HierarchicalParameters, vessel: KnownVessel, period: float) -> None:
        self._models = bank(vessel, period, soon=True)  # before super().__init__, which takes the gains for a model
        super().__init__(parameters, vessel, period)

    def retune(self, parameters: HierarchicalParameters) -> None:
        """Take new numbers and keep what is learned. Raises InstabilityError if the period is too long for the gains."""
        self.parameters = parameters
        self._use(self._models.used)

    def _use(self, model: int) -> None:
        """Take the gains for a model of the actuators."""
        known = with_model(self.vessel, model)
        found = gains(self.parameters, known, self.period)
        self._models, self._known = self._models._replace(used=model), known
        every = self._models.every if self.parameters.actuator_identification else 0
        self.constants = Constants(found, self.neurons, self._models._replace(every=every))

    @property
    def known(self) -> KnownVessel:
        """The vessel with the identified actuators."""
        return self._known

    def renew(self) -> None:
        """Take the gains for the model of the actuators that explains the motion best, and the moment that acts by it."""
        model = int(self.memory.bank.numbers[BEST])
        self._use(model)
        self.memory = self.memory._replace(tau_2=float(self.memory.bank.models[model, 0]) * self.vessel.yaw_inertia)

    def reset(self) -> None:
        """Set all weights to zero, and discard predictions, current and identified actuators."""
        self._use(0)
        n = len(self.neurons.mu)
        arrays = np.zeros((3, n)), np.zeros(n), np.zeros((3, n)), np.zeros((3, 1))
        unknown, g, models = Motion(*[math.nan] * 6), self.constants.gains, self.constants.bank
        latest = math.ceil(max(DEAD_TIMES) * models.unit / self.period) if models.every else 0
        queue = np.zeros((2, max(g.surge.delay, g.yaw.delay, latest) + math.ceil(MAX_AGE / self.period) + 1))
        self.memory = Memory(*arrays, unknown, 0.0, 0.0, 0, queue, (0.0, 0.0, 0.0), first_state(models, MAX_AGE))
