"""The drift angle of a hull that travels along a curve at constant speed, from the sway equation of (6).

| symbol | meaning | unit | equation |
|---|---|---|---|
| s, chi, kappa | arc length, course and curvature of the curve | m, rad, 1/m | - |
| U | speed along the curve | m/s | - |
| beta | drift angle chi - psi, positive for a drift to port | rad | - |
| u, v, r | U·cos(beta), U·sin(beta), U·(kappa - dbeta/ds) | m/s, m/s, rad/s | (6) |
| m11, m22, d_v, d_v2, d_v3 | coefficients of the hull | kg, kg, kg/s, kg/m, kg·s/m² | (6) |

Sway has no actuator, so the hull turns into the curve only as its drift angle allows. With these velocities the sway equation
m22·dv = -m11·u·r - d_v·v - d_v2·|v|·v - d_v3·v³ divided by u becomes

    (m22 - m11)·U·dbeta/ds + G(beta, s) = 0,   G = m11·U·kappa + (d_v + d_v2·|v| + d_v3·v²)·tan(beta)

with G increasing in beta. Its periodic solution is the only bounded one. It exists for every hull with sway damping: for
m22 > m11 it is stable forwards in time, for m22 < m11 backwards in time (which is no obstacle, because the curve is known in
advance), and for m22 = m11 the equation is algebraic. Coupling of sway and yaw adds to it: coupled_drift.py.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.guidance import coupled_drift
from vessel_hsmc_ros.guidance.curves import Curve
from vessel_hsmc_ros.plant.dynamics import Vessel

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

SAMPLES_PER_BEND, LARGEST_EXPONENT = 256, 8
"""Samples of the solution along the shortest bend; at most 3^8 = 6561 in a period. An odd number has no Nyquist frequency."""

ITERATIONS, TOLERANCE = 5000, 1e-14
"""The fixed-point iteration ends when the drift angle changes by less than the tolerance, rad."""

NEGLIGIBLE = 1e-10  # higher harmonics below this share of the drift angle are omitted
STEEPEST = 1.55  # largest drift angle of the solution, rad; the hull then travels almost sideways


def damping_ratio(beta: Array, speed: Array | float, vessel: Vessel) -> tuple[Array, Array]:
    """Sway damping divided by surge speed, and its derivative with respect to the drift angle.

    `beta`: drift angle, rad. `speed`: U, m/s. `vessel`: coefficients of (6). Returns (d_v + d_v2·|v| + d_v3·v²)·tan(beta) and
    its derivative, both in kg/s.
    """
    v, tangent = speed * np.sin(beta), np.tan(beta)
    factor = vessel.d_v + vessel.d_v2 * np.abs(v) + vessel.d_v3 * v * v
    slope = (vessel.d_v2 * np.sign(v) + 2.0 * vessel.d_v3 * v) * speed * np.cos(beta)
    return factor * tangent, factor * (1.0 + tangent * tangent) + slope * tangent


def steady_drift(load: Array, speed: Array | float, vessel: Vessel) -> Array:
    """The drift angle of a steady turn, G(beta) = 0, by bisection.

    `load`: m11·U·kappa, shape (n,), kg/s. `speed`: U, m/s, one or shape (n,). `vessel`: coefficients of (6). Returns drift
    angle, shape (n,), rad; STEEPEST at most where the damping is too small for a smaller one.
    """
    low, high = np.full(load.shape, -STEEPEST), np.full(load.shape, STEEPEST)
    for _ in range(60):
        middle = 0.5 * (low + high)
        # A steady turn has the yaw rate U·kappa.
        lost = (
            coupled_drift.damping_ratio(middle, speed, load / vessel.m11, vessel)
            if vessel.coupled
            else damping_ratio(middle, speed, vessel)[0]
        )
        above = load + lost > 0.0
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


def steady_load(curve: Curve, speed: float, vessel: Vessel) -> Array:
    """The Coriolis force divided by surge speed, m11·U·kappa, at the samples of a period, shape (n,), kg/s."""
    return vessel.m11 * speed * curve.curvature(samples(curve))


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
    for amplitude in c.a:
        p2 = p2 * z + p1
        p1 = p1 * z + p
        p = p * z + amplitude
    # d/ds = i·w·z·d/dz
    first = z * p1
    return Drift(p.real, -c.w * first.imag, -c.w * c.w * (first + 2.0 * z * z * p2).real)


def _solution(curve: Curve, speed: float, vessel: Vessel) -> Array:
    """The periodic drift angle at the samples of a period, shape (n,), rad."""
    load = steady_load(curve, speed, vessel)
    beta, n = steady_drift(load, speed, vessel), len(load)
    if n == 1:
        return beta
    if vessel.coupled:
        return coupled_drift.periodic_drift(curve, samples(curve), beta, speed, vessel)
    # By the maximum principle the solution stays within the extremes of the steady drift angle.
    bound = float(np.max(np.abs(beta)))
    g = 0.5 * float(np.sum(damping_ratio(np.array([0.0, bound]), speed, vessel)[1]))
    w: Array = np.arange(n // 2 + 1.0) * (2.0 * math.pi / curve.period)
    operator = (vessel.m22 - vessel.m11) * speed * 1j * w + g
    for _ in range(ITERATIONS):
        last, force = beta, load + damping_ratio(beta, speed, vessel)[0]
        beta = np.clip(np.fft.irfft(np.fft.rfft(g * beta - force) / operator, n), -bound, bound)
        if np.max(np.abs(beta - last)) < TOLERANCE:
            break
    return beta


class PeriodicDrift:
    """The periodic drift angle along a curve at constant speed, a Fourier series in the arc length.

    It is the limit of ((m22 - m11)·U·d/ds + g)·beta_next = g·beta - G(beta), solved in the frequency domain. Every step is a
    contraction, because the derivative is skew-symmetric and g is the mean of the extreme slopes of G. A hull whose sway is
    coupled to its yaw takes `coupled_drift`. `speed`: U > 0, m/s. `vessel`: coefficients of the ship, with sway damping.

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
