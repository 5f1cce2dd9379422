"""The drift angle of a hull that travels along a curve at constant speed, from the sway equation of (6).

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
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.guidance.curves import Curve
from vessel_hsmc_ros.plant.dynamics import Vessel, sway_damping

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

SAMPLES_PER_BEND, LARGEST_EXPONENT = 256, 8
"""Samples of the solution along the shortest bend; at most 3^8 = 6561 in a period. An odd number has no Nyquist frequency."""

STEPS, TOLERANCE = 5000, 1e-14
"""The iteration ends when the drift angle changes by less than the tolerance, rad, or after this many steps."""

NEWTON_STEPS, NEWTON_TOLERANCE = 60, 1e-12
"""The same of a coupled hull, whose iteration then fails."""

DIFFERENCE = 1e-6  # step of the central differences, rad and rad/s
NEGLIGIBLE = 1e-10  # higher harmonics below this share of the drift angle are omitted
STEEPEST = 1.55  # largest drift angle of the solution, rad; the hull then travels almost sideways


def damping_ratio(beta: Any, speed: Any, r: Any, vessel: Vessel) -> Any:
    """Y(u, v, r)/u at a drift angle and a yaw rate, numbers or arrays, kg/s·(m/s).

    `beta`: drift angle, rad. `speed`: U, m/s. `r`: yaw rate, rad/s.
    """
    u = speed * np.cos(beta)
    return sway_damping(u, speed * np.sin(beta), r, vessel) / u


def steady_drift(load: Array, speed: Array | float, vessel: Vessel) -> Array:
    """The drift angle of a steady turn, F(beta) = 0 with beta' = kappa' = 0, by bisection.

    `load`: m11·U·kappa, shape (n,), kg/s. `speed`: U, m/s, one or shape (n,). `vessel`: coefficients of (6). Returns drift
    angle, shape (n,), rad; STEEPEST at most where the damping is too small for a smaller one.
    """
    low, high = np.full(load.shape, -STEEPEST), np.full(load.shape, STEEPEST)
    for _ in range(60):
        middle = 0.5 * (low + high)
        # A steady turn has the yaw rate U·kappa.
        above = load + damping_ratio(middle, speed, load / vessel.m11, vessel) > 0.0
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    return np.where(load == 0.0, 0.0, 0.5 * (low + high))


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
    """The drift angle of which nothing is to be subtracted any more, from a first estimate on.

    Raises ParameterError if there is none, or the iteration does not find it; InstallationError if SciPy is missing.
    """
    require("scipy")
    from scipy.optimize import NoConvergence, newton_krylov  # SciPy's import takes time, and few runs need it

    try:
        return np.asarray(newton_krylov(step, start, f_tol=NEWTON_TOLERANCE, maxiter=NEWTON_STEPS))
    except (NoConvergence, ValueError, FloatingPointError):
        raise ParameterError(
            f"no drift angle is found with which this hull travels the curve at {speed:g} m/s:"
            " it takes a larger curve or less speed"
        ) from None


class PeriodicDrift:
    """The periodic drift angle along a curve at constant speed, a Fourier series in the arc length.

    `speed`: U > 0, m/s. `vessel`: coefficients of the ship, with sway damping.

    Raises:
        ParameterError: a coupled hull has no drift angle that is found.
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
