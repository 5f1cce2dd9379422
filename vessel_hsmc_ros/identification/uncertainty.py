"""Standard errors and correlations of the estimates, and which parameters the data do not determine.

The covariance of least squares is (JᵀJ)⁻¹ for white residuals of unit variance. Model errors and environmental loads make lasting
residuals: the sandwich (JᵀJ)⁻¹ Jᵀ·G·J (JᵀJ)⁻¹ with the residuals' own autocovariance G shows by how much each variance is larger
than for white ones, and the standard errors are increased by that.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.linalg import toeplitz

from vessel_hsmc_ros.identification.types import Array
from vessel_hsmc_ros.identification.windows import Windows

STRONG = 0.98
"""Correlation from which on two parameters are reported."""
INDISTINGUISHABLE = 1e-6
"""Relative norm of what is left of a parameter's effect when the others have explained it, below which it is not estimated."""


def covariance(cut: Windows, residuals: Array, jacobian: Array) -> Array:
    """Covariance of the errors of the estimates, (p, p).

    Args:
        cut: The windows.
        residuals: Weighted residuals, (w, k + 1, 6), as `Shooting.residuals` gives them.
        jacobian: Their derivatives without what initial states explain, (w, k + 1, 6, p).
    """
    rows = jacobian.reshape(-1, jacobian.shape[-1])
    measured = np.isfinite(cut.measured)
    residuals, jacobian = residuals[:, :-1], jacobian[:, :-1]
    count = measured.sum(axis=(0, 1)) - len(measured) - rows.shape[1] / 6.0
    variance = np.square(residuals).sum(axis=(0, 1)) / np.maximum(count, 1.0)
    bread = np.linalg.pinv(rows.T @ rows, hermitian=True)
    white = np.einsum("wkci,c,wkcj->ij", jacobian, variance, jacobian, optimize=True)
    meat = np.zeros_like(white)
    for column in np.flatnonzero(measured.any(axis=(0, 1))):
        meat += variance[column] * _coloured(residuals[:, :, column], jacobian[:, :, column])
    plain, sandwich = bread @ white @ bread, bread @ meat @ bread
    growth = np.sqrt(np.maximum(1.0, np.diag(sandwich) / np.maximum(np.diag(plain), 1e-300)))
    return np.asarray(plain * np.outer(growth, growth))


def _coloured(residuals: Array, jacobian: Array) -> Array:
    """Jᵀ·G·J for one column of the measurements, (w, k) and (w, k, p), with the autocorrelation of its residuals; (p, p)."""
    longest = residuals.shape[1]
    sums = np.sum([np.correlate(part, part, "full")[longest - 1 :] for part in residuals], axis=0)
    # Bartlett's weights: few products contribute to long lags, and the matrix stays positive.
    correlation = sums / max(sums[0], 1e-300) * np.maximum(0.0, 1.0 - np.arange(longest) / (0.5 * longest))
    return np.asarray(np.einsum("wki,wkj->ij", jacobian, toeplitz(correlation) @ jacobian, optimize=True))


def correlations(matrix: Array) -> Array:
    """Correlation matrix of a covariance matrix, (p, p)."""
    errors = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    return np.asarray(matrix / np.outer(errors, errors))


def indistinguishable(names: Sequence[str], jacobian: Array, scale: Array) -> dict[str, str]:
    """Names of parameters without an effect of their own on the motion, with the reason.

    Args:
        names: Of the parameters.
        jacobian: Derivatives of the residuals by them, (n + w, 6, p).
        scale: A change of each that matters, (p,).
    """
    rows: Array = np.linalg.qr(jacobian.reshape(-1, len(names)) * scale).R
    norms = np.linalg.norm(rows, axis=0)
    largest = max(float(norms.max(initial=0.0)), 1e-300)
    found: dict[str, str] = {}
    kept: list[int] = []
    # From the strongest effect to the weakest: of several alike, the strongest is kept.
    for index in np.argsort(-norms, kind="stable"):
        basis = np.linalg.qr(rows[:, kept])[0] if kept else np.zeros((len(rows), 0))
        left = rows[:, index] - basis @ (basis.T @ rows[:, index])
        if norms[index] < INDISTINGUISHABLE * largest:
            found[names[index]] = "nothing in the runs depends on it"
        elif np.linalg.norm(left) < INDISTINGUISHABLE * norms[index]:
            found[names[index]] = "its effect is the same as that of other parameters"
        else:
            kept.append(int(index))
    return found


def uninformed(
    names: Sequence[str], vector: Array, matrix: Array, fixed: Mapping[str, float], needed: Sequence[str]
) -> dict[str, str]:
    """Names of parameters whose standard error exceeds their value, with the reason: the least certain first, and so on.

    A parameter that is held changes the estimates of all others, and makes their errors smaller; both follow from the covariance.

    Args:
        names: Of the parameters.
        vector: Their estimates, (p,).
        matrix: Covariance of their errors, (p, p).
        fixed: The values at which they would be held.
        needed: Names of those that are never held.
    """
    found: dict[str, str] = {}
    vector, matrix = vector.copy(), matrix.copy()
    held = np.array([fixed.get(name, 0.0) for name in names])
    candidates = [index for index, name in enumerate(names) if name not in needed]
    while candidates:
        errors = np.sqrt(np.maximum(np.diag(matrix), 0.0))
        sizes = np.maximum(np.abs(vector), 1e-300)
        worst = max(candidates, key=lambda index: errors[index] / sizes[index])
        if errors[worst] <= sizes[worst]:
            return found
        found[names[worst]] = f"its standard error {errors[worst]:.2g} exceeds its value {vector[worst]:.2g}"
        gain = matrix[:, worst] / matrix[worst, worst]
        vector = vector - gain * (vector[worst] - held[worst])
        matrix = matrix - np.outer(gain, matrix[worst])
        candidates.remove(worst)
    return found


def strong_correlations(names: Sequence[str], correlation: Array) -> list[str]:
    """A sentence about each pair of estimates that can hardly be separated."""
    rows, columns = np.nonzero(np.triu(np.abs(correlation) > STRONG, 1))
    return [
        f"{names[a]} and {names[b]} can hardly be separated here: the correlation of their errors is {correlation[a, b]:.3f}"
        for a, b in zip(rows.tolist(), columns.tolist(), strict=True)
    ]
