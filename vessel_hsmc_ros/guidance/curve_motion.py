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

The drift angle of a hull that travels along a curve at constant speed, from the sway equation of (6).

| symbol | meaning | unit | equation |
|---|---|---|---|
| s, chi, kappa | arc length, course and curvature of the curve | m, rad, 1/m | - |
| U | speed along the curve | m/s | - |
| beta | drift angle chi - psi, positive for a drift to port; ' is the derivative with respect to s | rad | - |
| u, v, r | U·cos(beta), U·sin(beta), U·(kappa - beta') | m/s, m/s, rad/s | (6) |
| Y(u, v, r) | sway force lost to damping, (D·nu)_Y of the plant | N | plant.py |

Sway has no actuator, so the hull turns into the curve only as its drift angle allows: m22·dv + m23·dr = -m11·u·r - Y with
dv = u·U·beta' and dr = U²·(kappa' - beta''). Divided by u:

    F(beta) = (m22 - m11)·U·beta' + m11·U·kappa + [Y + m23·U²·(kappa' - beta'')]/u = 0

Its periodic solution is sought on samples of a period, by steps that F linearised about the mean gives; that is diagonal in the
frequency domain. Where sway and yaw are not coupled, Y/u = (d_v + d_v2·|v| + d_v3·v²)·tan(beta) increases with beta. The periodic
solution is then the only bounded one, and exists for every hull with sway damping: for m22 > m11 it is stable forwards in time,
for m22 < m11 backwards in time (which is no obstacle, because the curve is known in advance), and for m22 = m11 the equation is
algebraic. Every step is a contraction, because the derivative is skew-symmetric and the slope is the mean of the extreme ones.
Where they are coupled, by inertia or damping, the steps precondition a Newton-Krylov method.
"""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.install_paths import require
from vessel_hsmc_ros.core.kernel import Array, kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.guidance.curves import Curve, CurveConstants, Shape, angle, course, curvature, position
from vessel_hsmc_ros.guidance.timetable import KernelReference, TimetableMemory, move_table
from vessel_hsmc_ros.plant.dynamics import Velocities, Vessel, damping_ratio, hull_velocities, inverse_dynamics, steady_drift

ComplexArray = NDArray[np.complex128]
SAMPLES_PER_BEND, LARGEST_EXPONENT = 256, 8
"""Samples of the solution along the shortest bend; at most 3^8 = 6561 in a period. An odd number has no Nyquist frequency."""

STEPS, TOLERANCE = 5000, 1e-14
"""The iteration ends when the drift angle changes by less than the tolerance, rad, or after this many steps."""

NEWTON_STEPS, NEWTON_TOLERANCE = 60, 1e-12
"""The same of a coupled hull, whose iteration then fails."""

DIFFERENCE = 1e-6  # step of the central differences, rad and rad/s
NEGLIGIBLE = 1e-10  # higher harmonics below this share of the drift angle are omitted


def sample_count(curve: Curve) -> int:
    """Number of samples of a period that resolve its shortest bend; one for a curve of constant curvature."""
    if not math.isfinite(curve.shortest_bend):
        return 1
    exponent = math.ceil(math.log(SAMPLES_PER_BEND * curve.period / curve.shortest_bend, 3.0))
    return int(3 ** min(exponent, LARGEST_EXPONENT))


def samples(curve: Curve) -> Array:
    """Arc lengths of the samples of a period, shape (n,), m."""
    n = sample_count(curve)
    return np.linspace(0.0, curve.period, n, endpoint=False)


@lru_cache(maxsize=1)  # who looks at it first goes on with the periodic solution
def steady_along(curve: Curve, speed: float, vessel: Vessel) -> Array:
    """The drift angle of steady turns with the curvatures at the samples of a period, shape (n,), rad."""
    return steady_drift(vessel.m11 * speed * curve.curvature(samples(curve)), speed, vessel)


class Drift(NamedTuple):
    """The drift angle [rad] and its first two derivatives with respect to the arc length; numbers or arrays."""

    beta: Any
    slope: Any
    slope_rate: Any


class DriftConstants(NamedTuple):
    """The drift angle as the real part of sum(a[n]·exp(i·(m - 1 - n)·w·s)): wavenumber, 1/m, and amplitudes, shape (m,), rad."""

    w: float
    a: ComplexArray


@kernel
def drift_at(z: Any, c: DriftConstants) -> Drift:
    """The drift angle and its derivatives where exp(i·w·s) is z, a number or an array.

    Horner's rule with two derivatives: p is the polynomial with these coefficients, p1 its derivative, p2 half its second one.
    """
    p = p1 = p2 = 0.0 * z
    for amplitude in c.a.tolist():
        p2 = p2 * z + p1
        p1 = p1 * z + p
        p = p * z + amplitude
    # d/ds = i·w·z·d/dz
    first = z * p1
    return Drift(p.real, -c.w * first.imag, -c.w * c.w * (first + 2.0 * z * z * p2).real)


def _solution(curve: Curve, speed: float, vessel: Vessel) -> Array:
    """The periodic drift angle at the samples of a period, shape (n,), rad."""
    s = samples(curve)
    n, kappa, kappa_slope = len(s), curve.curvature(s), curve.curvature_slope(s)
    beta = steady_along(curve, speed, vessel)
    if n == 1:
        return beta
    w: Array = np.arange(n // 2 + 1.0) * (2.0 * math.pi / curve.period)
    # Not coupled, by the maximum principle the solution stays within the extremes of the steady drift angle.
    bound = float(np.max(np.abs(beta)))
    angles, rates = (beta, speed * kappa) if vessel.coupled else (np.array([0.0, bound]), np.zeros(2))
    operator, linear = _operator(w, angles, rates, speed, vessel), 1j * w * (vessel.m22 - vessel.m11) * speed

    def step(beta: Array) -> Array:
        """What to subtract from an estimate."""
        spectrum, others = np.fft.rfft(beta), vessel.m11 * speed * kappa
        if vessel.coupled:
            slope, slope_rate = np.fft.irfft(1j * w * spectrum, n), np.fft.irfft(-w * w * spectrum, n)
            others = others + damping_ratio(beta, speed, speed * (kappa - slope), vessel)
            others += vessel.m23 * speed * (kappa_slope - slope_rate) / np.cos(beta)
        else:
            others = others + damping_ratio(beta, speed, 0.0, vessel)
        return np.fft.irfft((linear * spectrum + np.fft.rfft(others)) / operator, n)

    if vessel.coupled:
        return _zero(step, beta, speed)
    for _ in range(STEPS):
        last, beta = beta, np.clip(beta - step(beta), -bound, bound)
        if np.max(np.abs(beta - last)) < TOLERANCE:
            break
    return beta


def _operator(w: Array, beta: Array, r: Array, speed: float, vessel: Vessel) -> Any:
    """F linearised about the mean of some drift angles and yaw rates, by wavenumber."""

    def slope(beta_step: float, r_step: float) -> float:
        high = damping_ratio(beta + beta_step, speed, r + r_step, vessel)
        low = damping_ratio(beta - beta_step, speed, r - r_step, vessel)
        return float(np.mean(high - low)) / (2.0 * DIFFERENCE)

    by_angle, by_rate = slope(DIFFERENCE, 0.0), slope(0.0, DIFFERENCE)
    # r = U·(kappa - beta'), so a derivative with respect to r is one with respect to beta' times -U.
    first = (vessel.m22 - vessel.m11) * speed - by_rate * speed
    return by_angle + 1j * w * first + vessel.m23 * speed * w * w


def _zero(step: Callable[[Array], Array], start: Array, speed: float) -> Array:
    """The drift angle of which nothing is to be subtracted any more, from a first estimate on."""
    require("scipy")
    from scipy.optimize import NoConvergence, newton_krylov  # SciPy's import takes time, and few runs need it

    try:
        return np.asarray(newton_krylov(step, start, f_tol=NEWTON_TOLERANCE, maxiter=NEWTON_STEPS))
    except (NoConvergence, ValueError, FloatingPointError):
        raise ParameterError(
            f"no drift angle is found with which this hull travels the curve at {speed:g} m/s: use a larger curve or less speed"
        ) from None


class PeriodicDrift:
    """The periodic drift angle along a curve at constant speed, a Fourier series in the arc length.

    `speed`: U > 0, m/s. `vessel`: coefficients of the ship, with sway damping.
    """

    def __init__(self, curve: Curve, speed: float, vessel: Vessel) -> None:
        self._period = curve.period
        beta = _solution(curve, speed, vessel)
        self._n = len(beta)
        w: Array = np.arange(self._n // 2 + 1.0) * (2.0 * math.pi / curve.period)
        spectrum = np.fft.rfft(beta) / self._n
        modes = 1 + int(np.max(np.flatnonzero(np.abs(spectrum) > NEGLIGIBLE * np.max(np.abs(beta))), initial=0))
        amplitudes = spectrum[:modes] * np.where(w[:modes] > 0.0, 2.0, 1.0)  # the series is one-sided
        self.constants = DriftConstants(2.0 * math.pi / curve.period, amplitudes[::-1].copy())

    def at(self, s: Any) -> Drift:
        """The drift angle at an arc length or at an array of arc lengths."""
        theta = self.constants.w * (s % self._period)
        return drift_at(np.cos(theta) + 1j * np.sin(theta), self.constants)

    def sampled(self) -> Drift:
        """The drift angle at the samples of a period, arrays of shape (n,)."""
        w, a = self.constants.w, self.constants.a[::-1]
        derivative = 1j * w * np.arange(len(a))
        halved = np.where(np.arange(len(a)) > 0, 0.5 * self._n, 1.0 * self._n) * a
        return Drift(*(np.fft.irfft(derivative**order * halved, self._n) for order in range(3)))


START_SAMPLES = 100  # number of instants of the start at which the demand is evaluated
LARGEST_DRIFT = math.radians(45.0)  # largest drift angle, rad: beyond it the hull would travel more sideways than ahead
BISECTIONS = 20


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


def _forces(motion: Velocities, vessel: Vessel) -> tuple[float, float]:
    """Largest magnitudes of tau_1 [N] and tau_2 [N·m] over an array of motions."""
    surge_force, yaw_moment = inverse_dynamics(motion, vessel)
    return float(np.max(np.abs(surge_force))), float(np.max(np.abs(yaw_moment)))


def check_feasible(owner: str, shape: Shape, pace: Pace, vessel: Vessel, limits: Demand) -> None:
    """Check that a ship can travel a curve within its limits.

    `owner`: name of the mode, for the error message. `vessel`: coefficients of (6). `limits`: largest drift angle, surge force
    and yaw moment; infinite where unknown.
    """
    excesses = _excesses(demand(shape.curve, pace, vessel, limits.drift), limits)
    if excesses:
        remedy = _remedy(shape, pace, vessel, limits)
        raise ParameterError(f"{owner}: {shape.size} at {pace.speed:g} m/s needs {' and '.join(excesses)}; {remedy}")


def _remedy(shape: Shape, pace: Pace, vessel: Vessel, limits: Demand) -> str:
    """What is feasible instead."""
    largest = _largest_speed(shape, pace, vessel, limits)
    if not largest:
        return "no speed is feasible; use a larger curve"
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

    move, read = staticmethod(move_table), staticmethod(read)

    def __init__(self, shape: Shape, pace: Pace, vessel: Vessel, start: tuple[float, ...], period: float) -> None:
        drift = PeriodicDrift(shape.curve, pace.speed, vessel).constants
        x, y, course = map(float, start)
        self.constants = TravelConstants(shape.curve.constants, drift, shape.side, pace, x, y, course, period)
        self.reset()

    def reset(self) -> None:
        """Return to the start."""
        self.memory = TimetableMemory(0)
