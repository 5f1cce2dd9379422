"""The reference along a curve at constant speed after a start from rest: the motion of the hull, and what it takes.

| symbol | meaning | unit | equation |
|---|---|---|---|
| t, T | time, duration of the start | s | - |
| s, kappa | arc length and curvature of the curve | m, 1/m | - |
| U | speed along the curve after the start | m/s | - |
| f | share of the speed, 10·q³ - 15·q⁴ + 6·q⁵ with q = t/T, then 1 | - | - |
| W | present speed f·U | m/s | - |
| beta_s | drift angle at the constant speed U as a function of s | rad | drift.py |
| beta | drift angle f·beta_s(s) | rad | - |
| u, v, r | W·cos(beta), W·sin(beta), W·kappa - dbeta/dt | m/s, m/s, rad/s | (6) |
| tau_1, tau_2 | m11·(du - f_u), m33·(dr - f_r) + m32·(dv - f_v) | N, N·m | (6) |

The motion is a function of time and not integrated, so the position is on the curve however long the run. At constant speed it
satisfies the sway equation of (6). During the start it does so only approximately: the drift angle of a slow turn is proportional
to the speed. It is placed at the initial pose, and mirrored for turns to starboard.

Whether a ship can travel a curve is checked over a period, in calm water: what is left below the limits is available against
disturbances.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.guidance.curves import Curve, CurveConstants, angle, course, curvature, position
from vessel_hsmc_ros.guidance.drift import Drift, DriftConstants, PeriodicDrift, drift_at, samples, steady_along
from vessel_hsmc_ros.guidance.kernel_reference import KernelReference
from vessel_hsmc_ros.guidance.shapes import Shape
from vessel_hsmc_ros.guidance.timetable import TimetableMemory, move
from vessel_hsmc_ros.plant.dynamics import Vessel, unforced_acceleration

START_SAMPLES = 100  # number of instants of the start at which the demand is evaluated

LARGEST_DRIFT = math.radians(45.0)  # largest drift angle, rad: beyond it the hull would travel more sideways than ahead
BISECTIONS = 20


class Velocities(NamedTuple):
    """Body velocities and their time derivatives, numbers or arrays; m/s, m/s, rad/s and per second."""

    u: Any
    v: Any
    r: Any
    du: Any
    dv: Any
    dr: Any


class Progress(NamedTuple):
    """Arc length [m], and share of the speed with its first two time derivatives, numbers or arrays."""

    s: Any
    f: Any
    df: Any
    ddf: Any


class Pace(NamedTuple):
    """Speed along a curve U [m/s] and duration of the start T [s]."""

    speed: float
    rise_time: float


@kernel
def progress(time: float, pace: Pace) -> Progress:
    """The progress at a time, s."""
    T = pace.rise_time
    if time >= T:
        return Progress(pace.speed * (0.5 * T + (time - T)), 1.0, 0.0, 0.0)
    q = time / T
    f = q * q * q * (10.0 - 15.0 * q + 6.0 * q * q)
    df, ddf = 30.0 * q * q * (1.0 - q) * (1.0 - q) / T, 60.0 * q * (1.0 - q) * (1.0 - 2.0 * q) / (T * T)
    return Progress(pace.speed * (T * q * q * q * q * (2.5 - 3.0 * q + q * q)), f, df, ddf)


class Demand(NamedTuple):
    """Largest magnitudes along a curve: drift angle of steady turns [rad], surge force [N], yaw moment [N·m]."""

    drift: float
    surge_force: float
    yaw_moment: float


@kernel
def hull_velocities(W: Any, dW: Any, bend: tuple[Any, Any], direction: tuple[Any, Any], dbeta: Any, ddbeta: Any) -> Velocities:
    """The body velocities of a hull along a plane curve, and their derivatives; numbers or arrays.

    `W`, `dW`: speed along the curve and its rate, m/s and m/s². `bend`: curvature [1/m] and its slope [1/m²]. `direction`:
    cosine and sine of the drift angle. `dbeta`, `ddbeta`: its time derivatives, rad/s and rad/s².
    """
    (kappa, kappa_slope), (c, sine) = bend, direction
    return Velocities(
        W * c,
        W * sine,
        W * kappa - dbeta,
        dW * c - W * sine * dbeta,
        dW * sine + W * c * dbeta,
        W * W * kappa_slope + dW * kappa - ddbeta,
    )


@kernel
def body_velocities(
    bend: tuple[Any, Any], direction: tuple[Any, Any], speed: float, drift: Drift, progress: Progress
) -> Velocities:
    """`hull_velocities` with the drift angle f·beta_s.

    `speed`: U, m/s. `progress`: where on the curve and with what share of the speed.
    """
    f, df, ddf = progress.f, progress.df, progress.ddf
    W, dW = f * speed, df * speed
    dbeta = df * drift.beta + f * drift.slope * W
    ddbeta = ddf * drift.beta + 2.0 * df * drift.slope * W + f * (drift.slope_rate * W * W + drift.slope * dW)
    return hull_velocities(W, dW, bend, direction, dbeta, ddbeta)


def velocities(curve: Curve, speed: float, drift: Drift, progress: Progress) -> Velocities:
    """`body_velocities` at arrays of arc lengths.

    `speed`: U, m/s. `progress`: where on the curve and with what share of the speed. Returns velocities and accelerations.
    """
    s, beta = progress.s, progress.f * drift.beta
    bend = curve.curvature(s), curve.curvature_slope(s)
    return body_velocities(bend, (np.cos(beta), np.sin(beta)), speed, drift, progress)


def at_speed(s: Any) -> Progress:
    """The progress after the start, at arc lengths."""
    return Progress(s, 1.0, 0.0, 0.0)


def demand(curve: Curve, pace: Pace, vessel: Vessel, largest_drift: float) -> Demand:
    """The largest drift angle, surge force and yaw moment that a curve demands of a hull in calm water.

    `vessel`: coefficients of (6). `largest_drift`: drift angle above which force and moment are not computed, rad. Returns the
    demand; force and moment are infinite if the drift angle is too large.
    """
    speed = pace.speed
    drift = float(np.max(np.abs(steady_along(curve, speed, vessel))))
    if drift > largest_drift:
        return Demand(drift, math.inf, math.inf)
    solution = PeriodicDrift(curve, speed, vessel)
    times = np.linspace(0.0, pace.rise_time, START_SAMPLES)
    start = Progress(*np.array([progress(float(time), pace) for time in times]).T)
    parts = ((solution.sampled(), at_speed(samples(curve))), (solution.at(start.s), start))
    forces = [_forces(velocities(curve, speed, beta, where), vessel) for beta, where in parts]
    return Demand(drift, max(surge for surge, _ in forces), max(yaw for _, yaw in forces))


def inputs(motion: Velocities, vessel: Vessel) -> tuple[Any, Any]:
    """Surge force tau_1 [N] and yaw moment tau_2 [N·m] of motions, numbers or arrays."""
    f_u, f_v, f_r = unforced_acceleration(motion.u, motion.v, motion.r, vessel)  # element by element
    surge_force = vessel.m11 * (motion.du - f_u)
    return surge_force, vessel.m33 * (motion.dr - f_r) + vessel.m32 * (motion.dv - f_v)


def _forces(motion: Velocities, vessel: Vessel) -> tuple[float, float]:
    """Largest magnitudes of tau_1 [N] and tau_2 [N·m] over an array of motions."""
    surge_force, yaw_moment = inputs(motion, vessel)
    return float(np.max(np.abs(surge_force))), float(np.max(np.abs(yaw_moment)))


def check_feasible(owner: str, shape: Shape, pace: Pace, vessel: Vessel, limits: Demand) -> None:
    """Check that a ship can travel a curve within its limits.

    `owner`: name of the mode, for the error message. `vessel`: coefficients of (6). `limits`: largest drift angle, surge force
    and yaw moment; infinite where unknown. Raises ParameterError if a limit is exceeded; the message contains the demand, the
    limit and the largest feasible speed.
    """
    excesses = _excesses(demand(shape.curve, pace, vessel, limits.drift), limits)
    if excesses:
        remedy = _remedy(shape, pace, vessel, limits)
        raise ParameterError(f"{owner}: {shape.size} at {pace.speed:g} m/s needs {' and '.join(excesses)}; {remedy}")


def _remedy(shape: Shape, pace: Pace, vessel: Vessel, limits: Demand) -> str:
    """What is feasible instead."""
    largest = _largest_speed(shape, pace, vessel, limits)
    if not largest:
        return "no speed is feasible, it takes a larger curve"
    steady = demand(shape.curve, pace._replace(rise_time=0.0), vessel, limits.drift)
    remedy = f"the largest feasible speed is {largest:g} m/s"
    return remedy if _excesses(steady, limits) else f"with a rise_time of {pace.rise_time:g} s {remedy}, with a longer one more"


def _excesses(needed: Demand, limits: Demand) -> list[str]:
    """The exceeded limits in words; a drift angle that is too large leaves force and moment unknown."""
    if needed.drift > limits.drift:
        return [f"a drift angle of {math.degrees(needed.drift):.0f}° (the largest is {math.degrees(limits.drift):.0f}°)"]
    rows = (
        ("a surge force", "surge_force_limit", "N", needed.surge_force, limits.surge_force),
        ("a yaw moment", "yaw_moment_limit", "N·m", needed.yaw_moment, limits.yaw_moment),
    )
    return [
        f"{what} of {quantity(value, unit)} (vessel.{name} is {quantity(limit, unit)})"
        for what, name, unit, value, limit in rows
        if value > limit
    ]


def _largest_speed(shape: Shape, pace: Pace, vessel: Vessel, limits: Demand) -> float:
    """The largest feasible speed below an infeasible one by bisection, rounded down to three digits; 0 if there is none."""

    def feasible(speed: float) -> bool:
        return not _excesses(demand(shape.curve, pace._replace(speed=speed), vessel, limits.drift), limits)

    low, high = 1e-3 * pace.speed, pace.speed
    if not feasible(low):
        return 0.0
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if feasible(middle) else (low, middle)
    digits = 2 - math.floor(math.log10(low))
    return math.floor(low * 10.0**digits) / 10.0**digits


class TravelConstants(NamedTuple):
    """The curve and the drift angle along it, side of the first turn, pace, initial x, y, course, and length of a step, s."""

    curve: CurveConstants
    drift: DriftConstants
    side: float
    pace: Pace
    x: float
    y: float
    course: float
    period: float


@kernel
def read(m: TimetableMemory, c: TravelConstants) -> tuple[Motion, Acceleration]:
    """State, and the derivatives of its velocities."""
    now = progress(m.steps * c.period, c.pace)
    turned = c.drift.w * (now.s % c.curve.period)
    drift = drift_at(complex(math.cos(turned), math.sin(turned)), c.drift)
    theta, beta = angle(now.s, c.curve), now.f * drift.beta
    bend = curvature(math.cos(theta), math.sin(theta), c.curve)
    v = body_velocities(bend, (math.cos(beta), math.sin(beta)), c.pace.speed, drift, now)
    # The model is symmetric: a turn to starboard is the mirror image of the turn to port.
    p, side = position(now.s, c.curve), c.side
    cosine, sine = math.cos(c.course), math.sin(c.course)
    x, y = c.x + (p.real * cosine - side * p.imag * sine), c.y + (p.real * sine + side * p.imag * cosine)
    psi = c.course + side * (course(now.s, c.curve) - beta)
    return Motion(x, y, psi, v.u, side * v.v, side * v.r), Acceleration(v.du, side * v.dv, side * v.dr)


class CurveReference(KernelReference):
    """A motion along a curve at constant speed, after a start from rest, in discrete time.

    `shape`: the curve and the side to which it turns first. `pace`: speed along the curve and duration of the start. `start`:
    initial position x, y [m] and course. `period`: length of a step, s.
    """

    move, read = staticmethod(move), staticmethod(read)

    def __init__(self, shape: Shape, pace: Pace, vessel: Vessel, start: tuple[float, ...], period: float) -> None:
        drift = PeriodicDrift(shape.curve, pace.speed, vessel).constants
        x, y, course = map(float, start)
        self.constants = TravelConstants(shape.curve.constants, drift, shape.side, pace, x, y, course, period)
        self.reset()

    def reset(self) -> None:
        """Return to the start."""
        self.memory = TimetableMemory(0)
