"""The drift angle along a curve of a hull whose sway is coupled to its yaw, by inertia or damping; `drift` has the plain case.

| symbol | meaning | unit | equation |
|---|---|---|---|
| s, kappa | arc length and curvature of the curve | m, 1/m | - |
| U, beta | speed along the curve, drift angle; ' is the derivative with respect to s | m/s, rad | - |
| u, v, r | U·cos(beta), U·sin(beta), U·(kappa - beta') | m/s, m/s, rad/s | (6) |
| Y(u, v, r) | sway force lost to damping, (D·nu)_Y of the plant | N | plant.py |

No force acts on the sway, so m22·dv + m23·dr = -m11·u·r - Y with dv = u·U·beta' and dr = U²·(kappa' - beta''). Divided by u:

    F(beta) = (m22 - m11)·U·beta' + m11·U·kappa + [Y + m23·U²·(kappa' - beta'')]/u = 0

The periodic solution is found by a Newton-Krylov method on samples of a period. Its preconditioner is F linearised about the
mean, which is diagonal in the frequency domain.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.install_paths import require
from vessel_hsmc_ros.guidance.curves import Curve
from vessel_hsmc_ros.plant.dynamics import Vessel, damping_force

Array = NDArray[np.float64]

TOLERANCE, ITERATIONS = 1e-12, 60
"""The iteration ends when the preconditioned residual is smaller, rad; and it fails after this many steps."""

DIFFERENCE = 1e-6  # step of the central differences, rad and rad/s


def damping_ratio(beta: Any, speed: Any, r: Any, vessel: Vessel) -> Any:
    """Y(u, v, r)/u at a drift angle and a yaw rate, numbers or arrays, kg/s·(m/s).

    `beta`: drift angle, rad. `speed`: U, m/s. `r`: yaw rate, rad/s.
    """
    u = speed * np.cos(beta)
    return damping_force(u, speed * np.sin(beta), r, vessel)[1] / u


def periodic_drift(curve: Curve, s: Array, start: Array, speed: float, vessel: Vessel) -> Array:
    """The periodic solution of F(beta) = 0 at samples of a period, rad.

    `s`: arc lengths of the samples, shape (n,), m. `start`: a first estimate, such as the drift angle of steady turns, shape
    (n,), rad. `speed`: U > 0, m/s. Returns the drift angle, shape (n,). Raises ParameterError if there is none, or the
    iteration does not find it; InstallationError if SciPy is missing.
    """
    require("scipy")
    from scipy.optimize import NoConvergence, newton_krylov  # SciPy's import takes time, and few runs need it

    n, kappa, kappa_slope = len(s), curve.curvature(s), curve.curvature_slope(s)
    w = np.arange(n // 2 + 1.0) * (2.0 * math.pi / curve.period)
    operator = _operator(w, start, speed * kappa, speed, vessel)

    def residual(beta: Array) -> Array:
        spectrum = np.fft.rfft(beta)
        slope, slope_rate = np.fft.irfft(1j * w * spectrum, n), np.fft.irfft(-w * w * spectrum, n)
        lost = damping_ratio(beta, speed, speed * (kappa - slope), vessel)
        coupled = vessel.m23 * speed * (kappa_slope - slope_rate) / np.cos(beta)
        F = (vessel.m22 - vessel.m11) * speed * slope + vessel.m11 * speed * kappa + lost + coupled
        return np.fft.irfft(np.fft.rfft(F) / operator, n)

    try:
        return np.asarray(newton_krylov(residual, start, f_tol=TOLERANCE, maxiter=ITERATIONS))
    except (NoConvergence, ValueError, FloatingPointError):
        raise ParameterError(
            f"no drift angle is found with which this hull travels the curve at {speed:g} m/s: use a larger curve or less speed"
        ) from None


def _operator(w: Array, beta: Array, r: Array, speed: float, vessel: Vessel) -> Any:
    """F linearised about mean drift angle and yaw rate, by wavenumber."""

    def slope(beta_step: float, r_step: float) -> float:
        high = damping_ratio(beta + beta_step, speed, r + r_step, vessel)
        low = damping_ratio(beta - beta_step, speed, r - r_step, vessel)
        return float(np.mean(high - low)) / (2.0 * DIFFERENCE)

    by_angle, by_rate = slope(DIFFERENCE, 0.0), slope(0.0, DIFFERENCE)
    # r = U·(kappa - beta'), so a derivative with respect to r is one with respect to beta' times -U.
    first = (vessel.m22 - vessel.m11) * speed - by_rate * speed
    return by_angle + 1j * w * first + vessel.m23 * speed * w * w
