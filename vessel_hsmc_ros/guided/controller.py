"""The guided law: a guidance layer above the paper's two sliding surfaces and networks, within the actuator limits.

| symbol | meaning | unit | equation |
|---|---|---|---|
| psi_c, r_c, u_c | commanded heading, yaw rate and surge speed | rad, rad/s, m/s | guidance |
| sigma2 | heading surface -c(epsilon) + r - r_w | rad/s | (17) |
| S1 | yaw surface r - r_c, that is sigma2 with the filtered yaw-rate command | rad/s | (20) |
| S2 | surge surface u - u_c | m/s | (23) |
| rho_c, zeta | states of the command filter: r_c - r_d and its integral | rad/s, rad/s² | - |
| k1, k2 | reaching gains | 1/s | (21), (27) |
| fu, fv, fr | network outputs for f_u, f_v, f_r | m/s², m/s², rad/s² | (14), (15), (25) |
| Wu, Wv, Wr | their weights, shape (l,) | as the outputs | (14), (15), (25) |
| H | activations shared by the three networks, shape (l,) | - | (2) |
| e_u, e_v, e_r | innovations: measured velocity minus predicted | m/s, m/s, rad/s | predictor |
| tau_1, tau_2 | surge force, yaw moment | N, N·m | (28), (22) |

tau_2 = m33·(dr_c - fr - k1·S1) and tau_1 = m11·(du_c - fu - k2·S2), so that dS1 = -k1·S1 and dS2 = -k2·S2 once the networks have
converged. The networks adapt to the innovations: W += (1 - z)²/T·e·H/(HᵀH). The adaptation of a network is suspended while its
actuator is saturated. The law knows m11, m33 and the limits. docs/guided.md derives it.
"""

import math

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import TURN, Acceleration, Motion, magnitude, tracking_error, transform
from vessel_hsmc_ros.core.limits import clip
from vessel_hsmc_ros.guided.actuator_identification import (
    BEST,
    DEAD_TIMES,
    bank,
    first_state,
    identify,
    with_model,
)
from vessel_hsmc_ros.guided.current_estimate import (
    MEAN_SHARE,
    MODEL_MEAN_SHARE,
    Current,
    at_rest,
    credible_part,
    current_at_rest,
    guiding_current,
    in_body,
    informative_angle,
    learn_current,
    mean,
    speed_squared,
    turn_in_water,
)
from vessel_hsmc_ros.guided.guidance import (
    approach_rate,
    course_damping,
    course_rate,
    direction_of_travel,
    filtered_rate,
    heading_error,
    integrate_error,
    resolve,
    velocity_command,
)
from vessel_hsmc_ros.guided.parameters import Gains, GuidedParameters, gains
from vessel_hsmc_ros.guided.predictor import correct, delays, forecast, learn, predict, predict_arrival
from vessel_hsmc_ros.guided.state import Command, Constants, Filter, Memory, StepTerms, initial
from vessel_hsmc_ros.guided.station_keeping import (
    count_turns,
    keeps_station,
    lever_arm,
    patient,
    pivot_ahead,
    pivoting_rate,
    spin_damping,
    undisturbed_share,
)
from vessel_hsmc_ros.guided.sway_model import learn_sway, turn_slope
from vessel_hsmc_ros.law.applied_wrench import applied, arriving, lead, slewed
from vessel_hsmc_ros.law.kernel_law import AdaptiveLaw
from vessel_hsmc_ros.law.known_vessel import KnownVessel
from vessel_hsmc_ros.law.network import Estimates, activate, output

MAX_INPUT = 1e12
"""Inputs are saturated at this magnitude, so that their powers stay finite."""

LONGEST_AGE = 2.0
"""Age of a measurement up to which the motion is predicted over it, s."""


@kernel
def bounded(m: Motion) -> Motion:
    """The motion with its heading in [-pi, pi] and no magnitude above MAX_INPUT."""
    # remainder is exact for every finite angle; it only selects the representation of the same heading.
    psi = math.remainder(m.psi, TURN)
    return Motion(
        clip(m.x, MAX_INPUT), clip(m.y, MAX_INPUT), psi, clip(m.u, MAX_INPUT), clip(m.v, MAX_INPUT), clip(m.r, MAX_INPUT)
    )


@kernel
def estimate_current(
    m: Memory, motion: Motion, v_d: float, r_d: float, v: float, sway: float, c_h: float, turned: float, g: Gains
) -> tuple[Current, tuple[float, float], float]:
    """The estimated current, its mean over the angle of turn and that of its magnitude, one period later.

    Args:
        m: Internal state with the estimates; that of a hull which declares `sway_damping_rate` is written in place.
        motion: State of the ship.
        v_d, r_d: Sway velocity and yaw rate of the reference.
        v: Sway velocity of the pivot.
        sway: Its sway acceleration through the water.
        c_h: Current ahead of the hull that the guidance reckons with.
        turned: Angle of turn of the period; 0 where it shows nothing.
        g: Gains.
    """
    current, mean_current, mean_magnitude = m.filter.current, m.filter.mean_current, m.filter.mean_magnitude
    if g.sway.a < 0.0:
        current = learn_current(current, motion, v, sway, turned, g)
        east, north, share = current.east, current.north, MEAN_SHARE * turned
    else:
        learn_sway(m.sway, motion, v, sway - motion.r * c_h, turned, g.sway)
        east, north, share = float(m.sway[0, 0]), float(m.sway[0, 1]), MODEL_MEAN_SHARE * turned
    mean_current = mean(mean_current, east, north, share)
    mean_magnitude += share * (magnitude(east, north) - mean_magnitude)
    if g.sway.a >= 0.0:
        current = Current(mean_current[0], mean_current[1], turn_slope(m.sway, v_d, r_d, g.sway))
    return current, mean_current, mean_magnitude


@kernel
def command(
    motion: Motion, desired: Motion, acceleration: Acceleration, f: Estimates, guiding: Current, x: float, m: Memory, g: Gains
) -> tuple[Command, Filter]:
    """Guidance and command filter, see `filtered_rate`, with r_goal = c(epsilon) + r_w - r_d.

    Anti-windup: rho_c is limited to the range where |S1| <= S1_max, because a larger S1 would need more than the available
    moment.

    Args:
        motion: State of the ship.
        desired: State of the reference.
        acceleration: Derivatives of the reference's body velocities.
        f: Outputs of the networks.
        guiding: The current that the guidance reckons with.
        x: Distance of the pivot ahead of the controlled point, m.
        m: Internal state of the law.
        g: Gains.

    Returns:
        The commands, and the state of the filter one period later.
    """
    rate, integral, s, xi, slow_sway, keeping, _, mean_current, mean_magnitude, slow_epsilon, spin = m.filter
    # The turn of the reference through the water takes the place of that over ground: known, it passes no filter.
    added = turn_in_water(guiding, desired, acceleration.dr, g)
    r_d, dr_d, dv_d = desired.r + added.rate, acceleration.dr + added.acceleration, acceleration.dv + added.dv
    relative = motion.r - r_d
    # Anti-windup: S1 = r - r_c = relative - rate, so this is |S1| <= S1_max.
    low, high = relative - g.S1_max, relative + g.S1_max
    rate = low if rate < low else high if rate > high else rate
    velocity = velocity_command(motion, desired, acceleration, xi, g)
    travel = speed_squared(guiding, velocity.reference_squared, g)
    c_h, c_n = in_body(guiding, motion.psi)
    w = resolve(velocity, guiding, motion.psi)
    distance = magnitude(motion.x - desired.x, motion.y - desired.y)
    lever = lever_arm(current_at_rest(mean_current, mean_magnitude, g), velocity.reference_squared, g)
    s = direction_of_travel(s, w.w_t, distance, desired.u, velocity.feedback_squared, lever, g)
    # At rest the moment accelerates the controlled point sideways; the sway that follows the ship's turns is that of the pivot.
    v, sway = motion.v - c_n + x * motion.r, f.fv + x * f.fr
    turned = informative_angle(motion.r, velocity.feedback_squared, travel, keeping, g)
    current, mean_current, mean_magnitude = estimate_current(m, motion, desired.v, desired.r, v + c_n, sway, c_h, turned, g)
    epsilon = heading_error(w, v, s, lever, g)
    # Of what changes fast in the estimated sway acceleration only a share is fed forward: the sway dynamics then have the factor
    # 1 - eta·m11/m22, which must stay positive for every ship (docs/guided.md, assumption A4). At low frequencies damping keeps
    # the sway from following the turn, and all of it is fed forward.
    beyond = sway - dv_d
    dv = dv_d + slow_sway + g.eta * (beyond - slow_sway)
    slow_sway += g.step_s * (beyond - slow_sway)
    r_w = course_rate(w, v, dv, desired.r, s, lever, g)
    turning = approach_rate(epsilon, g) + r_w
    if g.b > 0.0:
        damping, slow_epsilon = course_damping(epsilon, slow_epsilon, travel, g)
        turning += damping
    square, largest = w.w_t * w.w_t + w.w_n * w.w_n, 2.0 * g.a_max
    keeping = keeps_station(keeping, square, travel, g)
    if keeping and x > g.x_far:
        turning, largest = pivoting_rate(w.w_n, v, x, lever, g), g.dr_rest
    spin = count_turns(spin, distance, motion.r, at_rest(velocity.reference_squared, g) > 0.0, g)
    turning = patient(turning, spin, g)
    undisturbed = undisturbed_share(square, motion.v, f.fu, f.fv, g)
    alignment = clip(g.k_h * undisturbed * math.remainder(desired.psi - motion.psi, TURN), g.r_h)
    drate, integral = filtered_rate(rate, integral, turning + alignment - r_d, largest, g)
    xi = integrate_error(xi, motion, desired, travel, g)
    psi_c, r_c, u_c = motion.psi + epsilon, r_d + rate, w.w_t + c_h + (spin_damping(v, motion.r, g) if keeping else 0.0)
    command = Command(psi_c, motion.r - turning, r_c, dr_d + drate, u_c, w.dw_t + motion.r * (w.w_n + c_n))
    return command, Filter(
        rate + g.T * drate, integral, s, xi, slow_sway, keeping, current, mean_current, mean_magnitude, slow_epsilon, spin
    )


@kernel
def within_limits(demand_1: float, demand_2: float, tau_1: float, tau_2: float, m: Memory, g: Gains) -> tuple[float, float]:
    """The command by the lead, within the limits of magnitude and slew rate, which becomes the latest of the queue.

    Args:
        demand_1, demand_2: The demanded surge force and yaw moment.
        tau_1, tau_2: What acts on the hull just before the command arrives.
        m: Internal state with the queue.
        g: Gains.
    """
    last_1, last_2 = arriving(m.queue, 0, m.head, 1), arriving(m.queue, 1, m.head, 1)
    wrench = (
        slewed(lead(tau_1, clip(demand_1, g.surge.limit), g.surge), last_1, g.slew_1),
        slewed(lead(tau_2, clip(demand_2, g.yaw.limit), g.yaw), last_2, g.slew_2),
    )
    m.queue[0, m.head], m.queue[1, m.head] = wrench
    return wrench


@kernel
def step(
    motion: Motion, desired: Motion, acceleration: Acceleration, m: Memory, constants: Constants, age: float = 0.0
) -> tuple[tuple[float, float], StepTerms, Memory]:
    """One period: correct the prediction, adapt the networks, predict through the dead time, compute commands and wrench.

    Args:
        motion, desired, acceleration: Measured ship, reference, and derivatives of the reference's velocities.
        m: Internal state; its arrays are written in place.
        constants: Gains and neurons.
        age: How long ago ship and reference were in these states, s.

    Returns:
        The wrench, its terms, and the internal state.
    """
    g, neurons, models = constants
    measured, desired = bounded(motion), bounded(desired)
    du, dv, dr = acceleration
    acceleration = Acceleration(clip(du, MAX_INPUT), clip(dv, MAX_INPUT), clip(dr, MAX_INPUT))
    expected = m.predicted if m.started else measured
    motion = correct(expected, measured, g.z_p, g.z_h, g.z_u, g.z_v, g.z_r)
    # The innovation compares this measurement with the last prediction, so the networks adapt before they are evaluated.
    activate(motion.u, motion.v, motion.r, neurons, m.H)
    HH = output(m.H, m.H, m.scratch)
    f = learn(measured, expected, HH, m, g)
    at_arrival = forecast(f, m, g)
    # The networks learn what the turn of the hull in a current does not explain.
    guiding = guiding_current(
        credible_part(m.filter.current, g), m.filter.mean_current, m.filter.mean_magnitude, motion, desired, g
    )
    c_h, c_n = in_body(guiding, motion.psi)
    by_turn = motion.r * c_n
    f_ground = Estimates(f.fu + by_turn, f.fv - motion.r * c_h, f.fr)
    n_1, n_2 = delays(age, m, g)
    x = pivot_ahead(speed_squared(guiding, desired.u * desired.u + desired.v * desired.v, g), g)
    later, tau_1, tau_2 = predict_arrival(motion, f_ground, n_1, n_2, x, m, g)
    goal = desired
    if max(n_1, n_2) > 0:
        goal = predict(desired, acceleration.du, acceleration.dv, acceleration.dr, g.T * max(n_1, n_2))
    c, filtered = command(later, goal, acceleration, f, guiding, x, m, g)

    S1, S2 = later.r - c.r_c, later.u - c.u_c
    demand_1, demand_2 = g.m11 * (c.du_c - at_arrival.fu - by_turn - g.k2 * S2), g.m33 * (c.dr_c - at_arrival.fr - g.k1 * S1)
    # Only the limit of the magnitude counts as saturation, which suspends the adaptation; the slew limit is transient.
    saturated_1, saturated_2 = abs(demand_1) > g.surge.limit, abs(demand_2) > g.yaw.limit
    wrench = within_limits(demand_1, demand_2, tau_1, tau_2, m, g)
    if models.every > 0:
        identify(m.bank, models, measured.psi, age, wrench[1])
    tau_1 = applied(m.tau_1, arriving(m.queue, 0, m.head, n_1), g.surge)
    tau_2 = applied(m.tau_2, arriving(m.queue, 1, m.head, n_2), g.yaw)
    head = m.head + 1 if m.head + 1 < m.queue.shape[1] else 0
    turning = tau_2 / g.m33
    predicted = predict(motion, f_ground.fu + tau_1 / g.m11, f_ground.fv - x * turning, f.fr + turning, g.T)
    z_e = tracking_error(transform(measured), transform(desired))
    terms = StepTerms(
        z_e.z1, z_e.z2, z_e.z3, c.sigma2, S1, S2, math.remainder(c.psi_c, TURN), c.r_c, c.u_c, f.fu, f.fv, f.fr,
        1.0 if saturated_1 else 0.0, 1.0 if saturated_2 else 0.0,
    )  # fmt: skip
    following = Memory(
        True, predicted, filtered, tau_1, tau_2, saturated_1, saturated_2, head, m.W, m.H, m.scratch, m.growth, m.slow, m.queue,
        m.sway, m.bank,
    )  # fmt: skip
    return wrench, terms, following


@kernel
def outdated(memory: Memory, constants: Constants) -> bool:
    """Whether another model of the actuators explains the motion than the one that the gains are for."""
    return int(memory.bank.numbers[BEST]) != constants.bank.used


class GuidedController(AdaptiveLaw[GuidedParameters]):
    """The law with its internal state: weights, predicted motion and command filter.

    Args:
        parameters: Gains and network.
        vessel: The known inertia and limits.
        period: Control period, s.

    Raises:
        ParameterError: the number of listed centres is not a multiple of three.
    """

    name = "guided"
    takes_age = True
    kernel = staticmethod(step)
    outdated = staticmethod(outdated)
    terms = StepTerms
    networks = ("surge", "sway", "yaw")
    memory: Memory

    def __init__(self, parameters: GuidedParameters, vessel: KnownVessel, period: float) -> None:
        self._models = bank(vessel, period)  # before super().__init__, which takes the gains for a model
        super().__init__(parameters, vessel, period)

    def retune(self, parameters: GuidedParameters) -> None:
        """Take new gains and keep the internal state; the size of the network stays as constructed."""
        self.parameters = parameters
        self._use(self._models.used)

    def _use(self, model: int) -> None:
        """Take the gains for a model of the actuators."""
        self._models, self._known = self._models._replace(used=model), with_model(self.vessel, model)
        every = self._models.every if self.parameters.actuator_identification else 0
        self.constants = Constants(
            gains(self.parameters, self._known, self.period), self.neurons, self._models._replace(every=every)
        )

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
        """Set all weights to zero and discard the prediction: the next state is taken as measured."""
        self._use(0)
        g, models = self.constants.gains, self.constants.bank
        latest = math.ceil(max(DEAD_TIMES) * models.unit / g.T) if models.every else 0
        places = max(g.surge.delay, g.yaw.delay, latest) + math.ceil(LONGEST_AGE / g.T)
        self.memory = initial(len(self.neurons.mu), places, g.sway, first_state(models, LONGEST_AGE))
