"""The guided law: one Kalman filter of ship and water, guidance through that water, a regulator of course and cross-track error.

| symbol | meaning | unit |
|---|---|---|
| psi_s, r_s | heading of the track, which is its course turned round astern, and its yaw rate | rad, 1/T |
| v_r, v_s | sway velocity through the water, and that which goes with the turn | L/T |
| r_f | r_s beyond the yaw rate of the reference, filtered | 1/T |
| r_c | commanded yaw rate | 1/T |
| s | way of the track: 1 ahead, -1 astern | - |
| K | gains of the regulator on e_c, psi, v and r | 1/(L·T²), 1/T², 1/(L·T), 1/T |
| w_t | commanded surge velocity over ground | L/T |
| tau_1, tau_2 | surge force, yaw moment | N, N·m |

    r_c = r_s + braked(psi_s - theta_c - psi - s·K_v/K_psi·(v_r - v_s)),   theta_c = K_e/K_psi·e_c, limited
    tau_2 = m33·(dr_s + braked(r_c - r) - f_r)
    tau_1 = m11·(dw_t + k_u·(w_t - u) - f_u - m·v_r·r - r·c_n)

For small errors this is the regulator alpha = -K·(e_c, psi - psi_s, v_r - v_s, r - r_s). Large ones are braked: heading by the
yaw acceleration, and yaw rate by the rate of the moment, because a moment that rises slowly falls slowly, and large turns would
oscillate indefinitely. All is computed for the time at which the command arrives at the hull. docs/guided.md has its figures.
"""

import math
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.control.guided.guidance import (
    CE,
    CN,
    FU,
    FV,
    KAPPA,
    LN_A,
    B,
    Gains,
    Integrals,
    R,
    Track,
    U,
    V,
    braked,
    correct,
    drift_in_turn,
    on_the_spot,
    predict,
    track,
    unforced,
)
from vessel_hsmc_ros.control.guided.parameters import GuidedParameters, gains, interpolate
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
from vessel_hsmc_ros.control.interface.law import NO_NETWORKS, KernelLaw
from vessel_hsmc_ros.core.kernel import Array, clip, kernel
from vessel_hsmc_ros.core.kinematics import TURN, Acceleration, Motion, extrapolate, to_body, tracking_error, transform

LONGEST_AGE = 2.0  # age of a measurement up to which the motion is predicted over it, s
LONGEST_ROLL = 12  # number of prediction steps through a delay, however many periods it has
LARGEST = 1e12  # positions are saturated at this magnitude, so that their powers stay finite
FASTEST = 30.0  # velocities are saturated at this magnitude, L/T and 1/T, so that the covariance of the filter stays positive


class Constants(NamedTuple):
    """What does not change from step to step."""

    gains: Gains
    bank: Bank


class Memory(NamedTuple):
    """Internal state of the law, in its units."""

    started: bool  # whether there has been a step
    pose: tuple[float, float, float]  # the pose predicted for the next step
    # x, P, noise: states of the filter, their covariance, and the variances of the measurements, written in place
    x: Array
    P: Array
    noise: Array
    # tau_1, tau_2: accelerations by the wrench since the last step, as modelled
    tau_1: float
    tau_2: float
    head: int  # column of the present period in `queue`
    beta: float  # drift angle of the track
    # r_f, dr_f: its turn beyond that of the reference, filtered, and the rate of change of that
    r_f: float
    dr_f: float
    xi: Integrals  # integrals of the position error
    queue: Array  # the last commands, (2, n + 1), written in place
    # K, scratch: working memory, shapes (4,) and (20, 15)
    K: Array
    scratch: Array
    bank: BankState  # what is learned of the actuators
    W: Array  # there are no networks


class StepTerms(NamedTuple):
    """The terms of a step, by their names in `Terms`."""

    surge_error: float
    sway_error: float
    heading_error: float
    yaw_surface: float
    surge_surface: float
    commanded_heading: float
    commanded_yaw_rate: float
    commanded_surge_velocity: float
    surge_estimate: float
    sway_estimate: float
    yaw_estimate: float
    surge_saturated: float
    yaw_saturated: float


class Turn(NamedTuple):
    """Commands of the regulator: heading, yaw rate, yaw acceleration, and what its memory keeps."""

    psi_c: float
    r_c: float
    alpha: float
    beta: float
    r_f: float
    dr_f: float


@kernel
def bounded(m: Motion) -> Motion:
    """A motion whose position is saturated, its heading in [-pi, pi]."""
    return Motion(clip(m.x, LARGEST), clip(m.y, LARGEST), math.remainder(m.psi, TURN), m.u, m.v, m.r)


@kernel
def scaled(m: Motion, g: Gains) -> Motion:
    """A motion in units of L and T, its heading in [-pi, pi]."""
    V = g.L / g.T
    return Motion(
        clip(m.x, LARGEST) / g.L,
        clip(m.y, LARGEST) / g.L,
        math.remainder(m.psi, TURN),
        clip(m.u / V, FASTEST),
        clip(m.v / V, FASTEST),
        clip(m.r * g.T, FASTEST),
    )


@kernel
def at_present(y: Motion, lever: float, m: Memory, g: Gains) -> Motion:
    """The motion by measurement and prediction; the filter has the sway velocity of the pivot, a lever ahead."""
    x, (px, py, psi) = m.x, m.pose
    if not m.started:
        px, py, psi = y.x, y.y, y.psi
        x[U], x[V], x[R] = y.u, y.v + lever * y.r, y.r
    correct(x, m.P, m.noise, (y.u, y.v + lever * y.r, y.r), m.scratch, g)
    px, py = px + (1.0 - g.z_p) * (y.x - px), py + (1.0 - g.z_p) * (y.y - py)
    psi = math.remainder(psi + (1.0 - g.z_h) * math.remainder(y.psi - psi, TURN), TURN)
    return Motion(px, py, psi, float(x[U]), float(x[V]) - lever * float(x[R]), float(x[R]))


@kernel
def ahead(motion: Motion, lever: float, n_1: int, n_2: int, m: Memory, g: Gains) -> tuple[Motion, float, float]:
    """The motion at which the later of the present commands arrives at the hull, and what acts just before each of them arrives.

    `motion`: of the controlled point, at the time of the measurement. `n_1`, `n_2`: periods until commands of force and moment
    arrive. `lever`: distance of the pivot ahead of that point.
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
            du, dv, dr = unforced(motion.u, motion.v + lever * motion.r, motion.r, motion.psi, m.x, g)
            turning = dr + sum_2 / count
            motion = extrapolate(motion, Acceleration(du + sum_1 / count, dv - lever * turning, turning), g.h * count)
            count, sum_1, sum_2 = 0, 0.0, 0.0
    return motion, before_1, before_2


@kernel
def turn(t: Track, ship: Motion, of_reference: tuple[float, float], c_n: float, lever: float, m: Memory, g: Gains) -> Turn:
    """The yaw acceleration of the track.

    `ship`: the motion of its controlled point. `of_reference`: yaw rate r_d of the reference, and its rate of change. `lever`:
    distance of the pivot ahead of that point. `c_n`: current across its hull.
    """
    a, K, q, psi, (r_d, dr_d) = math.exp(float(m.x[LN_A])), m.K, g.q, ship.psi, of_reference
    kappa, v_p = float(m.x[KAPPA]) - a * g.x_d / t.W, ship.v + lever * ship.r
    beta, dbeta = drift_in_turn(m.beta, t, a, kappa, float(m.x[FV]), g.h)
    turning, v_s = t.dchi - clip(dbeta, 1.0 / q), t.way * t.W * math.sin(beta)
    # Its derivative is that of a filter, because the turn of the track may jump; of the reference it is known.
    r_f = m.r_f + g.step_f * (turning - r_d - m.r_f)
    dr_f = m.dr_f + g.step_f * ((r_f - m.r_f) / g.h - m.dr_f)
    interpolate(t.W * q, a * q, kappa, g.table, K)
    of = K.tolist()
    K_e, K_psi, K_v, K_r = of[0] / (q * q), of[1] / (q * q), of[2] / q, of[3] / q
    psi_c = t.chi + (0.0 if t.way > 0.0 else math.pi) - beta - clip(K_e / K_psi * t.e_c, g.theta)
    slip = t.way * K_v / K_psi * clip(v_p - c_n - v_s, 0.5 * t.W)
    r_c = turning + braked(math.remainder(psi_c - psi, TURN) - slip, K_psi / K_r, g.a_max, g.r_max)
    if lever > 0.0:
        share, pivoting = on_the_spot(t, v_p, a, lever, m.x, g)
        r_c += share * (pivoting - r_c)
    alpha = dr_d + dr_f + braked(r_c - ship.r, K_r, g.a_r, LARGEST)
    return Turn(psi_c, r_c, alpha, beta, r_f, dr_f)


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
    """One period: correct the filter, predict through the dead time, compute track, turn and wrench, predict the next period.

    `motion`, `desired`, `acceleration`: measured ship, reference, and derivatives of the reference's velocities. `m`: internal
    state; its arrays are written in place. `age`: how long ago ship and reference were in these states, s; at most LONGEST_AGE
    counts. `heading`: measured heading; that of `motion` by default.
    """
    g, models = constants
    age, x, V_0 = clip(age, LONGEST_AGE), m.x, g.L / g.T
    d, per = scaled(desired, g), g.T / V_0
    dd = Acceleration(clip(acceleration.du, LARGEST) * per, clip(acceleration.dv, LARGEST) * per, acceleration.dr * g.T * g.T)
    ratio = (d.u * d.u + d.v * d.v) / (g.U_s * g.U_s)
    lever = g.x_p / (1.0 + ratio * ratio)
    now = at_present(scaled(motion, g), lever, m, g)
    n_1, n_2 = delays(age, m, g)
    ship, tau_1, tau_2 = ahead(now, lever, n_1, n_2, m, g)
    goal = extrapolate(d, dd, g.h * max(n_1, n_2))

    slope, settling = float(m.K[0]) / max(float(m.K[1]), 1e-9), math.exp(float(x[LN_A])) / max(float(x[KAPPA]), 0.1)
    t = track(ship, goal, dd, float(x[CE]), float(x[CN]), m.xi, slope, settling, g)
    v_p = ship.v + lever * ship.r
    c = turn(t, ship, (goal.r, dd.dr), to_body(float(x[CE]), float(x[CN]), ship.psi)[1], lever, m, g)
    du, dv, dr = unforced(ship.u, v_p, ship.r, ship.psi, x, g)
    demand_1, demand_2 = t.dw_t + g.k_u * (t.w_t - ship.u) - du, c.alpha - dr
    command_1 = lead(tau_1, clip(demand_1, g.surge.limit), g.surge)
    command_2 = lead(tau_2, clip(demand_2, g.yaw.limit), g.yaw)
    m.queue[0, m.head], m.queue[1, m.head] = command_1, command_2
    wrench = (command_1 * g.force, command_2 * g.moment)
    if models.every > 0:
        identify(m.bank, models, heading if math.isfinite(heading) else motion.psi, age, wrench[1])

    tau_1 = applied(m.tau_1, arriving(m.queue, 0, m.head, n_1), g.surge)
    tau_2 = applied(m.tau_2, arriving(m.queue, 1, m.head, n_2), g.yaw)
    later = extrapolate(now, Acceleration(0.0, 0.0, 0.0), g.h)
    predict(x, m.P, now.psi, tau_1, tau_2, m.scratch, g)
    z_e = tracking_error(transform(bounded(motion)), transform(bounded(desired)))
    terms = StepTerms(
        z_e.z1, z_e.z2, z_e.z3, (ship.r - c.r_c) / g.T, (ship.u - t.w_t) * V_0, math.remainder(c.psi_c, TURN), c.r_c / g.T,
        t.w_t * V_0, du / per, dv / per, dr / (g.T * g.T),
        1.0 if abs(demand_1) > g.surge.limit else 0.0, 1.0 if abs(demand_2) > g.yaw.limit else 0.0,
    )  # fmt: skip
    head = m.head + 1 if m.head + 1 < m.queue.shape[1] else 0
    left = Memory(
        True, (later.x, later.y, later.psi), x, m.P, m.noise, tau_1, tau_2, head, c.beta, c.r_f, c.dr_f, t.xi, m.queue, m.K,
        m.scratch, m.bank, m.W,
    )  # fmt: skip
    return wrench, terms, left


@kernel
def delays(age: float, m: Memory, g: Gains) -> tuple[int, int]:
    """The periods from a measurement until the present commands of force and moment arrive; its age counts as dead time, s."""
    late = min(int(age / (g.h * g.T) + 0.5), m.queue.shape[1] - 1 - max(g.surge.delay, g.yaw.delay))
    return g.surge.delay + late, g.yaw.delay + late


@kernel
def outdated(memory: Memory, constants: Constants) -> bool:
    """Whether another model of the actuators explains the motion than the one that the gains are for."""
    return int(memory.bank.numbers[BEST]) != constants.bank.used


class GuidedController(KernelLaw[GuidedParameters]):
    """The law with its internal state. `vessel`: the known inertia and limits, and what is declared beyond them."""

    name = "guided"
    takes_age = True
    takes_heading = True
    kernel = staticmethod(step)
    outdated = staticmethod(outdated)
    terms = StepTerms
    memory: Memory

    def __init__(self, parameters: GuidedParameters, vessel: KnownVessel, period: float) -> None:
        self._models = bank(vessel, period)  # before super().__init__, which takes the gains for a model
        super().__init__(parameters, vessel, period)
        self._prepare()

    def retune(self, parameters: GuidedParameters) -> None:
        """Take new numbers and keep the internal state."""
        self.parameters = parameters
        self._prepare()
        self._use(self._models.used)

    def _prepare(self) -> None:
        """Compute the tables of the regulator for declared and identified actuators: a period is too short for one."""
        for model in (0, 1):
            gains(self.parameters, with_model(self.vessel, model), self.period, identified=model > 0)

    def _use(self, model: int) -> None:
        """Take the gains for a model of the actuators."""
        self._models, self._known = self._models._replace(used=model), with_model(self.vessel, model)
        every = self._models.every if self.parameters.actuator_identification else 0
        found = gains(self.parameters, self._known, self.period, identified=model > 0)
        self.constants = Constants(found, self._models._replace(every=every))

    @property
    def known(self) -> KnownVessel:
        """The vessel with the identified actuators."""
        return self._known

    @property
    def water(self) -> tuple[complex, float, float, float]:
        """The estimates of the filter, in SI units; the doubt is two standard deviations."""
        x, P, g = self.memory.x, self.memory.P, self.constants.gains
        speed, variance = g.L / g.T, max(0.0, float(P[CE, CE] + P[CN, CN]))
        return complex(x[CE], x[CN]) * speed, 2.0 * math.sqrt(variance) * speed, float(x[B]) / g.T, float(x[FU]) * speed / g.T

    def renew(self) -> None:
        """Take the gains for the model of the actuators that explains the motion best, and the moment that acts by it."""
        model = int(self.memory.bank.numbers[BEST])
        self._use(model)
        moment = float(self.memory.bank.models[model, 0]) * self.vessel.yaw_inertia
        self.memory = self.memory._replace(tau_2=moment / self.constants.gains.moment)

    def reset(self) -> None:
        """Discard all that is learned: the next state is taken as measured."""
        self._use(0)
        g, models = self.constants.gains, self.constants.bank
        latest = math.ceil(max(DEAD_TIMES) * models.unit / self.period) if models.every else 0
        places = max(g.surge.delay, g.yaw.delay, latest) + math.ceil(LONGEST_AGE / self.period)
        arrays = np.zeros((2, places + 1)), np.zeros(4), np.zeros((20, 15))
        at_start = (0.0, 0.0, 0.0), g.x_0.copy(), np.diag(g.P_0), np.array([g.R_u, g.R_r]), 0.0, 0.0, 0, 0.0, 0.0, 0.0
        self.memory = Memory(
            False, *at_start, Integrals(0.0, 0.0, 0.0, 0.0), *arrays, first_state(models, LONGEST_AGE), NO_NETWORKS
        )
