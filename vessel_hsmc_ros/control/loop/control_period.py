"""A control period as one kernel: observer, law, and the point that it controls.

`ControlLoop.step` is the same for any law and under supervision, for the nodes. Compiled loops call the kernel, which `period_of`
makes for one law. Motion and reference are transformed to the point, the tracking errors back to the origin.

| symbol | meaning | unit |
|---|---|---|
| x_p, x | distance of the centre of percussion and of the controlled point ahead of the origin | m |
| dx | rate of x | m/s |
| delta | heading of the ship minus that of the reference | rad |
| delta_f, d1, d2 | the same filtered, with its first and second derivative | rad, rad/s, rad/s² |
| b | slow rate of delta_f, the integral of the filter | rad/s |
| o | angle learned from the error that returns with the turns of the reference | rad |
| alpha, a1, a2 | delta_f + o, with its first and second derivative | rad, rad/s, rad/s² |
| omega | bandwidth of the filter, max(|nu_d|, U_0)/l | rad/s |
| l | distance within which the filter follows: MARGIN·x_p/(1 - m11/m22), from L/3 to L | m |
| q1, q2 | the point of the reference in its own axes, x·(cos alpha, sin alpha) | m |
| U_0 | speed of the reference below which x goes to 0, FROUDE·sqrt(g·L) | m/s |
| L, T | length of the hull, control period | m, s |
| e | tracking error of the origin across the reference's heading, in terms of the point's distance x | - |
| lambda | bandwidth of the regressors, max(abs(nu_d), U_0)/L | rad/s |
| a, b, c | the reference's yaw rate after one, two and three first-order lags | rad/s |
| phi1, phi2 | regressors a - b and a - 3·b + 2·c; at the frequency lambda they are a quarter of a period apart | rad/s |
| theta1, theta2 | coefficients | s |
| p0 | size of the regressors below which they are taken for noise, NOISE·lambda | rad/s |

The ship's point is x ahead along the heading of the ship, that of the reference along psi_d + alpha. Along psi_d alone, the
origin would be off by 2·x·sin(delta/2) wherever the ship has another heading than the reference, as in a side wind; along the
heading of the ship, the acceleration of the point would contain the yaw acceleration, and with it the moment that the law is to
compute. delta_f is a state: the transformed position, velocity and acceleration are consistent, contain no moment, and leave no
error of the origin in steady state. While the reference travels x = x_p; in station keeping x = 0, because there the heading is
free, and the origin is what is to be kept. docs/percussion.md derives both.

    o = theta1·phi1 + theta2·phi2,    dtheta = -SPEED·lambda·phi·e/(phi1² + phi2² + p0²)

A hull whose sway is coupled to its yaw needs another heading than the reference's, which varies as the reference turns. The
filter of the headings follows it late, and so does the law; what is late in a slalom returns with every turn, and the
angle o, which moves the origin across by x·o, cancels it. Both regressors vanish in a steady turn and on a straight path:
there nothing is learned and o = 0.
"""

import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.interface.law import KernelLaw, Terms, guarded_step, named
from vessel_hsmc_ros.control.loop.observer import ObserverConstants, ObserverState, estimate, observe
from vessel_hsmc_ros.core.exceptions import ControlError, VesselHsmcError
from vessel_hsmc_ros.core.hull import Steering, steered
from vessel_hsmc_ros.core.kernel import DelayLine, bound, clip, delayed, kernel, put
from vessel_hsmc_ros.core.kinematics import GRAVITY, Acceleration, Motion, extrapolate, magnitude, wrap

SPEED, NOISE, MAX_COEFFICIENT = 0.5, 0.1, 0.25
"""Rate of learning in terms of lambda; p0 in terms of lambda; |theta| at most this divided by p0."""

MAX_LEARNING_ERROR = 0.25  # error, in terms of x, beyond which nothing is learned: the ship is then on its way to the reference


class Turning(NamedTuple):
    """State: lagged yaw rates of the reference, and coefficients."""

    a: float = 0.0
    b: float = 0.0
    c: float = 0.0
    theta1: float = 0.0
    theta2: float = 0.0


class Offset(NamedTuple):
    """O with its first and second derivative, and the state for the next period."""

    o: float
    do: float
    ddo: float
    turning: Turning


@kernel
def turning_offset(turning: Turning, e: float, r_d: float, dr_d: float, rate: float, T: float) -> Offset:
    """The angle and what is learned in a period.

    The derivatives are those for constant coefficients, which change slowly compared with the regressors. `e`: tracking error
    of the origin in terms of x. `r_d`, `dr_d`: yaw rate and yaw acceleration of the reference, rad/s, rad/s². `rate`: lambda,
    rad/s, below 1/T. `T`: control period, s.
    """
    a, b, c, theta1, theta2 = turning
    da, db, dc = rate * (r_d - a), rate * (a - b), rate * (b - c)
    dda, ddb, ddc = rate * (dr_d - da), rate * (da - db), rate * (db - dc)
    phi1, phi2 = a - b, a - 3.0 * b + 2.0 * c
    o = theta1 * phi1 + theta2 * phi2
    do = theta1 * (da - db) + theta2 * (da - 3.0 * db + 2.0 * dc)
    ddo = theta1 * (dda - ddb) + theta2 * (dda - 3.0 * ddb + 2.0 * ddc)
    p0 = NOISE * rate
    step = SPEED * rate * T * e / (phi1 * phi1 + phi2 * phi2 + p0 * p0) if -MAX_LEARNING_ERROR < e < MAX_LEARNING_ERROR else 0.0
    largest = MAX_COEFFICIENT / p0
    theta1, theta2 = clip(theta1 - step * phi1, largest), clip(theta2 - step * phi2, largest)
    return Offset(o, do, ddo, Turning(a + T * da, b + T * db, c + T * dc, theta1, theta2))


FROUDE = 0.06  # the speed U_0 as a Froude number; gravity, m/s²
INTEGRAL, MAX_RATE_SHARE = 0.3, 0.1  # integral gain of the filter in terms of omega², and largest slow rate in terms of omega
MARGIN = 1.5  # factor on the shortest distance l with which the heading is stable on a hull that does not damp sway
ERRORS = "surge_error", "sway_error", "surge_error_rate", "sway_error_rate"
"""The terms of a law that are transformed back to the origin."""


class Heading(NamedTuple):
    """State of the filter of the headings: delta_f, its slow rate b, and what the sideways offset has learned."""

    delta: float = 0.0
    rate: float = 0.0
    turning: Turning = Turning()


START = Heading()  # before the first period


class ControlledPoint(NamedTuple):
    """The controlled point: x_p, 1/l, U_0, T and 1/L."""

    x_p: float
    per_distance: float
    U_0: float
    T: float
    per_length: float


class AtControlledPoint(NamedTuple):
    """Inputs of the law at its point."""

    motion: Motion  # the ship
    desired: Motion  # the reference
    acceleration: Acceleration  # derivatives of the body velocities of `desired`
    back: tuple[float, float, float, float]  # what the ERRORS at the origin exceed those at the point by, m, m, m/s, m/s
    delta: Heading  # state of the filter for the next period


def controlled_point_of(vessel: KnownVessel, period: float) -> ControlledPoint:
    """The controlled point of a vessel, for a control period, s. Raises ParameterError as `KnownVessel.percussion_point`."""
    x_p, length = vessel.controlled, vessel.length
    # A faster filter would make the heading unstable: its loop is damped by 1 - m11/m22, and more on a hull that damps sway.
    share = 1.0 - vessel.surge_inertia / vessel.sway_inertia
    distance = min(length, max(length / 3.0, MARGIN * x_p / share)) if share > 0.0 else length
    return ControlledPoint(x_p, 1.0 / distance, FROUDE * math.sqrt(GRAVITY * length), period, 1.0 / length)


ORIGIN = ControlledPoint(0.0, 1.0, 0.0, 1.0, 1.0)  # no other point than the origin


@kernel
def position(desired: Motion, acceleration: Acceleration, p: ControlledPoint) -> tuple[float, float]:
    """X = x_p·s²·(3 - 2·s) with s = |nu_d|/U_0 up to 1, and dx. `acceleration`: derivatives of its body velocities."""
    s = magnitude(desired.u, desired.v) / p.U_0
    if s >= 1.0:
        return p.x_p, 0.0
    rising = (desired.u * acceleration.du + desired.v * acceleration.dv) / (p.U_0 * p.U_0)
    return p.x_p * s * s * (3.0 - 2.0 * s), p.x_p * 6.0 * (1.0 - s) * rising


@kernel
def to_controlled_point(
    motion: Motion, desired: Motion, acceleration: Acceleration, filtered: Heading, p: ControlledPoint
) -> AtControlledPoint:
    """Transform the inputs of a law to its point; at the origin they are returned as they are.

    d1 = omega·(delta - delta_f) + b, d2 = omega·(r - r_d - d1) + db, db = INTEGRAL·omega²·(delta - delta_f)
    (u, v) of the reference's point = (u_d + dq1 - r_d·q2, v_d + dq2 + r_d·q1)

    `acceleration`: derivatives of the reference's body velocities. Returns the same at the point.
    """
    if p.x_p == 0.0:
        return AtControlledPoint(motion, desired, acceleration, (0.0, 0.0, 0.0, 0.0), filtered)
    delta, slow, turning = filtered
    x_o, y_o, psi, u, v, r = motion
    x_d, y_d, psi_d, u_d, v_d, r_d = desired
    x, dx = position(desired, acceleration, p)
    speed = magnitude(u_d, v_d)
    speed = speed if speed > p.U_0 else p.U_0
    omega, turns = speed * p.per_distance, speed * p.per_length
    omega, turns = omega if omega * p.T < 1.0 else 1.0 / p.T, turns if turns * p.T < 1.0 else 1.0 / p.T
    beyond = wrap(psi - psi_d - delta)
    d1 = omega * beyond + slow
    slower = clip(slow + p.T * INTEGRAL * omega * omega * beyond, MAX_RATE_SHARE * omega)
    d2 = omega * (r - r_d - d1) + (slower - slow) / p.T

    c, s = math.cos(psi_d), math.sin(psi_d)
    e = ((y_o - y_d) * c - (x_o - x_d) * s) / x if x != 0.0 else 1.0
    o = turning_offset(turning, e, r_d, acceleration.dr, turns, p.T)
    alpha, a1, a2 = delta + o.o, d1 + o.do, d2 + o.ddo
    cos, sin = math.cos(alpha), math.sin(alpha)
    q1, q2 = x * cos, x * sin
    dq1, dq2 = dx * cos - q2 * a1, dx * sin + q1 * a1
    ddq1, ddq2 = -dx * sin * a1 - dq2 * a1 - q2 * a2, dx * cos * a1 + dq1 * a1 + q1 * a2
    point = Motion(x_d + q1 * c - q2 * s, y_d + q1 * s + q2 * c, psi_d, u_d + dq1 - r_d * q2, v_d + dq2 + r_d * q1, r_d)
    du, dv, dr = acceleration
    rate = Acceleration(du + ddq1 - dr * q2 - r_d * dq2, dv + ddq2 + dr * q1 + r_d * dq1, dr)

    ship = Motion(x_o + x * math.cos(psi), y_o + x * math.sin(psi), psi, u + dx, v + x * r, r)
    return AtControlledPoint(ship, point, rate, (q1 - x, q2, dq1 - dx, dq2), Heading(wrap(delta + p.T * d1), slower, o.turning))


def at_origin(terms: Terms, back: tuple[float, float, float, float]) -> Terms:
    """The terms of a law with the tracking errors of the origin; what a law does not have stays NaN.

    z1e = z1e_p + q1 - x, z2e = z2e_p + q2, and their derivatives

    `back`: from `AtControlledPoint`.
    """
    e1, e2, de1, de2 = back
    return terms._replace(
        surge_error=terms.surge_error + e1,
        sway_error=terms.sway_error + e2,
        surge_error_rate=terms.surge_error_rate + de1,
        sway_error_rate=terms.sway_error_rate + de2,
    )


StepOfLaw = tuple[tuple[float, float], Any, Any]  # wrench, terms and memory


class ControlInputs(NamedTuple):
    """What a control period takes."""

    measured_at: int  # time of the measurement, ns
    age: float  # how much older than the period it is, s
    behind: int  # the same in control periods, rounded
    measured: Motion  # state of the ship as measured
    desired: Motion  # state of the reference as published
    acceleration: Acceleration  # derivatives of its body velocities


class ControlState(NamedTuple):
    """What a control period leaves to the next; arrays are written in place."""

    wrench: tuple[float, float]  # commanded surge force [N] and yaw moment [N·m]
    memory: Any  # internal state of the law
    observer: ObserverState  # state of the observer
    delta: Heading  # state of the filter of the headings of `controlled_point_of`
    commands: DelayLine  # the last commands, where there is an observer


class ControlConstants(NamedTuple):
    """Constants of the law, of the observer and of the point that the law controls."""

    law: Any
    observer: ObserverConstants
    point: ControlledPoint
    steering: Steering


class Period(NamedTuple):
    """The result of a control period."""

    state: ControlState  # what it leaves to the next one; without a finite wrench, the present command
    motion: Motion  # the motion that the law has taken
    terms: Any  # terms of the law
    back: tuple[float, float, float, float]  # what the tracking errors of the origin exceed those of the controlled point by
    is_defined: bool  # whether the law has a finite wrench
    is_outdated: bool  # whether the law needs other constants from now on


@kernel
def law_step(at: AtControlledPoint, age: float, heading: float, memory: Any, constants: Any) -> StepOfLaw:  # noqa: ARG001 - a stand-in
    """Stands for the step of a law: `plain`, `with_age` or `with_heading`."""
    return (math.nan, math.nan), (at.motion.x, at.desired.x, age + heading), memory


@kernel
def law_outdated(memory: Any, constants: Any) -> bool:  # noqa: ARG001 - a stand-in
    """Stands for `KernelLaw.outdated` of a law."""
    return False


@kernel
def unobserved(
    stamp: int,  # noqa: ARG001 - instead of `observe`
    pose: Any,  # noqa: ARG001
    wrench: Any,  # noqa: ARG001
    state: ObserverState,
    constants: ObserverConstants,  # noqa: ARG001
) -> ObserverState:
    """Takes the place of `observe` where the observer is switched off, which halves the time of compilation."""
    return state


@kernel
def law_inputs(motion: Motion, given: ControlInputs, delta: Heading, point: ControlledPoint) -> AtControlledPoint:
    """The inputs of the law: the reference at the time of the measurement, both at the controlled point.

    `motion`: state of the ship, measured or estimated. `given`: inputs of the period.
    """
    return to_controlled_point(
        motion, extrapolate(given.desired, given.acceleration, -given.age), given.acceleration, delta, point
    )


@kernel
def control_period(given: ControlInputs, last: ControlState, c: ControlConstants) -> Period:
    """Estimate the motion, and step the law at its point.

    `given`: inputs of the period. `last`: what the last period has left; its arrays are written.
    """
    wrench, memory, observed, delta, commands = last
    motion = given.measured
    if c.observer.enabled:
        pose = (motion.x, motion.y, motion.psi)
        then = delayed(commands, given.behind, 0), delayed(commands, given.behind, 1)
        observed = observe(given.measured_at, pose, then, observed, c.observer)
        motion = estimate(observed)
    at = law_inputs(motion, given, delta, c.point)
    demand, terms, memory = law_step(at, given.age, given.measured.psi, memory, c.law)
    if not (math.isfinite(demand[0]) and math.isfinite(demand[1])):
        return Period(ControlState(wrench, memory, observed, delta, commands), motion, terms, at.back, False, False)
    demand = steered(demand, motion.u, c.steering)
    if c.observer.enabled:
        put(commands, demand)
    is_outdated = law_outdated(memory, c.law)
    return Period(ControlState(demand, memory, observed, at.delta, commands), motion, terms, at.back, True, is_outdated)


@kernel
def step(*_inputs: Any) -> StepOfLaw:
    """Stands for the kernel of a law."""
    return (math.nan, math.nan), (), ()


@kernel
def plain(at: AtControlledPoint, age: float, heading: float, memory: Any, constants: Any) -> StepOfLaw:  # noqa: ARG001 - as `law_step`
    """The step of a law that takes no age."""
    return step(at.motion, at.desired, at.acceleration, memory, constants)


@kernel
def with_age(at: AtControlledPoint, age: float, heading: float, memory: Any, constants: Any) -> StepOfLaw:  # noqa: ARG001 - as `law_step`
    """The step of a law that takes the age, s."""
    return step(at.motion, at.desired, at.acceleration, memory, constants, age)


@kernel
def with_heading(at: AtControlledPoint, age: float, heading: float, memory: Any, constants: Any) -> StepOfLaw:
    """The step of a law that takes the age, s, and the measured heading."""
    return step(at.motion, at.desired, at.acceleration, memory, constants, age, heading)


@functools.cache
def period_of(law: type[KernelLaw[Any]], observed: bool) -> Callable[..., Period]:
    """`control_period` with a law, with the observer or without: the kernel that a compiled loop calls by that name."""
    step_of_law = bound(with_heading if law.takes_heading else with_age if law.takes_age else plain, step=law.kernel)
    kernels: dict[str, Callable[..., Any]] = {"law_step": kernel(step_of_law), "law_outdated": law.outdated}
    made = bound(control_period, **kernels | ({} if observed else {"observe": unobserved}))
    # By which its machine code is kept.
    made.__module__, made.__qualname__ = law.kernel.__module__, law.kernel.__qualname__ + "_observed" * observed
    return kernel(made)


def cause(law: KernelLaw[Any], given: ControlInputs, last: ControlState, c: ControlConstants) -> VesselHsmcError:
    """The error of a law in a period in which its kernel has no finite wrench: the interpreted law finds its cause.

    `law`: the law, with the memory that the periods before have left. `given`: inputs of the period. `last`: what the period
    has left.
    """
    motion = estimate(last.observer) if c.observer.enabled else given.measured
    at = law_inputs(motion, given, last.delta, c.point)
    try:
        guarded_step(law, at.motion, at.desired, at.acceleration, given.age, given.measured.psi)
    except VesselHsmcError as error:
        return error
    return ControlError(f"law {named(law)} commanded a wrench that is not finite")
