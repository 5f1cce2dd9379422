"""Output-error refinement: the hull parameters with which simulated windows come closest to the measured ones.

The initial state of every window is free (multiple shooting). It is eliminated (variable projection): for given parameters the
best initial states follow from a few Gauss-Newton steps per window, and the parameters see only residuals that no initial state
can explain.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import least_squares

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.identification.parameter_vector import Unknowns, inputs, vessel
from vessel_hsmc_ros.identification.types import Array
from vessel_hsmc_ros.identification.windows import Windows, simulated

DIFFERENCE = 1e-5
"""Relative step of the finite differences."""
INNER = 2
"""Gauss-Newton steps for the initial states."""


@dataclass
class Shooting:
    """The residuals of all windows as a function of the parameters.

    Attributes:
        unknowns: What is estimated.
        cut: The windows.
        starts: Initial states, (w, 6); the best ones for the last parameters.
        noise: Standard deviation of each column of the measurements, (6,).
        scale: A change of each parameter that matters, (p,), for finite differences.
    """

    unknowns: Unknowns
    cut: Windows
    starts: Array
    noise: Array
    scale: Array = field(default_factory=lambda: np.empty(0))

    def states(self, vector: Array, starts: Array) -> Array:
        """The simulated motion, (n, 6)."""
        values = self.unknowns.values(vector)
        return simulated(self.cut, starts, vessel(values), *inputs(values))

    def residuals(self, vector: Array) -> Array:
        """Weighted residuals with the best initial states, (n, 6), zero where not measured; NaN where the ship is impossible."""
        try:
            for _ in range(INNER):
                errors, tangent = self._errors(vector), self._to_starts(vector)
                self.starts = self.starts + _solved(self.cut, tangent, errors)
            return self._errors(vector)
        except ParameterError:
            return np.full_like(self.cut.measured, np.nan)

    def jacobian(self, vector: Array) -> Array:
        """Derivatives of the weighted residuals by the parameters, without what initial states explain, (n, 6, p)."""
        base, parts = self._errors(vector), []
        for index, scale in enumerate(self.scale):
            step = DIFFERENCE * max(abs(vector[index]), scale)
            moved = vector.copy()
            moved[index] += step
            parts.append((self._errors(moved) - base) / step)
        return projected(self.cut, self._to_starts(vector), np.stack(parts, axis=-1))

    def _errors(self, vector: Array, starts: Array | None = None) -> Array:
        states = self.states(vector, self.starts if starts is None else starts)
        return np.nan_to_num((self.cut.measured - states) / self.noise, nan=0.0, posinf=np.inf, neginf=-np.inf)

    def _to_starts(self, vector: Array) -> Array:
        """Derivatives of the weighted residuals by the initial state of their own window, (n, 6, 6)."""
        base, parts = self._errors(vector), []
        sizes = np.maximum(np.abs(self.starts).max(axis=0), 1e-3)
        for column in range(6):
            moved = self.starts.copy()
            moved[:, column] += DIFFERENCE * sizes[column]
            parts.append((self._errors(vector, moved) - base) / (DIFFERENCE * sizes[column]))
        return np.stack(parts, axis=-1)


def _solved(cut: Windows, tangent: Array, errors: Array) -> Array:
    """The change of each window's initial state that removes most of the errors, (w, 6)."""
    changes = []
    for begin, end in cut.first:
        matrix, right = tangent[begin:end].reshape(-1, 6), errors[begin:end].reshape(-1)
        changes.append(-np.linalg.lstsq(matrix, right, rcond=None)[0])
    return np.array(changes)


def projected(cut: Windows, tangent: Array, derivatives: Array) -> Array:
    """Derivatives, (n, 6, p), less what lies in the span of the tangents, (n, 6, 6), of their window."""
    result = np.empty_like(derivatives)
    for begin, end in cut.first:
        basis = np.linalg.qr(tangent[begin:end].reshape(-1, 6))[0]
        rows = derivatives[begin:end].reshape(-1, derivatives.shape[2])
        result[begin:end] = (rows - basis @ (basis.T @ rows)).reshape(derivatives[begin:end].shape)
    return result


def refine(shooting: Shooting, start: Array, progress: Callable[[int], None] = lambda _: None, most: int = 30) -> Array:
    """Minimise the weighted residuals within the bounds, from a start.

    Args:
        shooting: The residuals; its initial states are the best ones afterwards.
        start: Parameters, (p,).
        progress: Called with the number of each iteration.
        most: Largest number of iterations.

    Returns:
        Parameters, (p,).
    """
    low, high = shooting.unknowns.bounds()
    inside = np.where(np.isfinite(low), np.maximum(start, low + 1e-6 * shooting.scale), start)
    count = 0

    def derivatives(vector: Array) -> Array:
        nonlocal count
        count += 1
        progress(count)
        return shooting.jacobian(vector).reshape(-1, len(vector))

    found = least_squares(
        lambda vector: shooting.residuals(vector).reshape(-1),
        inside,
        derivatives,
        (low, high),
        x_scale="jac",
        ftol=1e-7,
        xtol=1e-7,
        max_nfev=most,
    )
    shooting.residuals(found.x)
    return np.asarray(found.x)
