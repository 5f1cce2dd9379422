"""The motion of a hull along a curve at constant speed, after a start from rest, and the force and moment that it needs.

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
to the speed.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.guidance.curves import Curve
from vessel_hsmc_ros.guidance.drift import Drift, PeriodicDrift, samples, steady_drift, steady_load
from vessel_hsmc_ros.plant.dynamics import Vessel, unforced_acceleration

START_SAMPLES = 100  # number of instants of the start at which the demand is evaluated


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
def body_velocities(
    bend: tuple[Any, Any], direction: tuple[Any, Any], speed: float, drift: Drift, progress: Progress
) -> Velocities:
    """The body velocities along a curve, and their derivatives; numbers or arrays.

    `bend`: curvature [1/m] and its slope [1/m²]. `direction`: cosine and sine of the drift angle f·beta_s. `speed`: U, m/s.
    `progress`: where on the curve and with what share of the speed. Returns velocities and accelerations.
    """
    (kappa, kappa_slope), (c, sine) = bend, direction
    f, df, ddf = progress.f, progress.df, progress.ddf
    W, dW = f * speed, df * speed
    dbeta = df * drift.beta + f * drift.slope * W
    ddbeta = ddf * drift.beta + 2.0 * df * drift.slope * W + f * (drift.slope_rate * W * W + drift.slope * dW)
    return Velocities(
        W * c,
        W * sine,
        W * kappa - dbeta,
        dW * c - W * sine * dbeta,
        dW * sine + W * c * dbeta,
        W * W * kappa_slope + dW * kappa - ddbeta,
    )


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
    drift = float(np.max(np.abs(steady_drift(steady_load(curve, speed, vessel), speed, vessel))))
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
