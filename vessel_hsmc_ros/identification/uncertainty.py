"""Standard errors and correlations of the estimates, and which parameters the data do not determine.

The covariance of least squares is (JᵀJ)⁻¹ for white residuals of unit variance. Model errors and environmental loads make lasting
residuals: the sandwich (JᵀJ)⁻¹ Jᵀ·G·J (JᵀJ)⁻¹ with the residuals' own autocovariance G shows by how much each variance is larger
than for white ones, and the standard errors are increased by that.
"""

from collections.abc import Collection, Sequence

import numpy as np
from scipy.linalg import toeplitz

from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.identification.windows import Windows

LASTING, BRIEF = 0.5, (0.02, 0.1)
"""Longest lags of the residuals' autocorrelation, and of their products with the derivatives, as shares of a window."""
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
    bread = inverse(rows)
    white = np.einsum("wkci,c,wkcj->ij", jacobian, variance, jacobian, optimize=True)
    meat = [np.zeros_like(white), *(_local(residuals, jacobian, share) for share in BRIEF)]
    for column in np.flatnonzero(measured.any(axis=(0, 1))):
        meat[0] += variance[column] * _coloured(residuals[:, :, column], jacobian[:, :, column])
    plain = np.diag(bread @ white @ bread)
    larger = np.max([np.diag(bread @ each @ bread) for each in meat], axis=0) / np.maximum(plain, 1e-300)
    growth = np.sqrt(np.maximum(1.0, larger))
    return np.asarray(bread @ white @ bread * np.outer(growth, growth))


def inverse(rows: Array) -> Array:
    """(JᵀJ)⁻¹ of derivatives J, (n, p): the covariance for white residuals of unit variance."""
    # Scaled to columns of norm one: the pseudo-inverse cuts off by size, and units would decide what it leaves out.
    norms = np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
    scaled = rows / norms
    return np.asarray(np.linalg.pinv(scaled.T @ scaled, rcond=1e-13, hermitian=True) / np.outer(norms, norms))


def _coloured(residuals: Array, jacobian: Array) -> Array:
    """Jᵀ·G·J for one column of the measurements, (w, k) and (w, k, p), with the autocorrelation of its residuals; (p, p)."""
    longest = residuals.shape[1]
    sums = np.sum([np.correlate(part, part, "full")[longest - 1 :] for part in residuals], axis=0)
    correlation = sums / max(sums[0], 1e-300) * bartlett(longest, LASTING)
    return np.asarray(np.einsum("wki,wkj->ij", jacobian, toeplitz(correlation) @ jacobian, optimize=True))


def _local(residuals: Array, jacobian: Array, share: float) -> Array:
    """The same from the products of the residuals, after Newey and West: some are larger where a force changes; (p, p)."""
    scores = np.einsum("wkci,wkc->wki", jacobian, residuals)
    weights = toeplitz(bartlett(scores.shape[1], share))
    return np.asarray(np.einsum("wki,wkj->ij", scores, weights @ scores, optimize=True))


def bartlett(samples: int, share: float) -> Array:
    """Bartlett's weights of the lags, which end at a share of the samples; with them the matrix stays positive, (n,)."""
    return np.maximum(0.0, 1.0 - np.arange(samples) / (share * samples))


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


def least_known(names: Sequence[str], vector: Array, matrix: Array, needed: Collection[str]) -> tuple[str, str]:
    """Name of the parameter whose standard error exceeds its value by most, and that as the reason; empty texts for none.

    Args:
        names: Of the parameters.
        vector: Their estimates, (p,).
        matrix: Covariance of their errors, (p, p).
        needed: Names of those that do not count.
    """
    errors, sizes = np.sqrt(np.maximum(np.diag(matrix), 0.0)), np.maximum(np.abs(vector), 1e-300)
    candidates = [index for index, name in enumerate(names) if name not in needed]
    worst = max(candidates, key=lambda index: errors[index] / sizes[index], default=-1)
    if worst < 0 or errors[worst] <= sizes[worst]:
        return "", ""
    return names[worst], f"its standard error {errors[worst]:.2g} exceeds its value {vector[worst]:.2g}"


def strong_correlations(names: Sequence[str], correlation: Array) -> list[str]:
    """A sentence about each pair of estimates that can hardly be separated."""
    rows, columns = np.nonzero(np.triu(np.abs(correlation) > STRONG, 1))
    return [
        f"{names[a]} and {names[b]} can hardly be separated here: the correlation of their errors is {correlation[a, b]:.3f}"
        for a, b in zip(rows.tolist(), columns.tolist(), strict=True)
    ]
