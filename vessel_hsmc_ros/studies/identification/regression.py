"""Linear regression for the hull parameters, and the standard errors of estimates.

M·dnu + C(nu)·nu + D(nu)·nu = wrench is linear in all parameters. Each has a column: the wrench that the ship takes when it is
one and all others are zero. Both sides are averaged over a moving window, which makes differences of velocities out of the noisy
accelerations. What noise is left biases the result, so it only starts the refinement.

The covariance of least squares is (JᵀJ)⁻¹ for white residuals of unit variance. Model errors and environmental loads make lasting
residuals: the sandwich (JᵀJ)⁻¹ Jᵀ·G·J (JᵀJ)⁻¹ with the residuals' own autocovariance G shows by how much each variance is larger
than for white ones, and the standard errors are increased by that.
"""

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
from scipy.linalg import toeplitz
from scipy.ndimage import uniform_filter1d
from scipy.optimize import least_squares, lsq_linear

from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.plant.dynamics import damping_force
from vessel_hsmc_ros.studies.identification.types import (
    DELAY,
    GAINS,
    HULL,
    OFFSETS,
    POSITIVE,
    Measurements,
    Smoothed,
    Unknowns,
    Windows,
    current_names,
    in_body_frame,
    vessel,
)

AVERAGED = 4.0  # length over which both sides are averaged, in bandwidths of the smoother
MIN_FORCE_SHARE = 1e-3  # share of the larger force below which an equation has no input
MAX_EVALUATIONS = 10  # largest number of regressions for the start of the currents, without those of finite differences
SHOWN_BY = 0.12  # share of the sum of squares left without them that currents must explain: others follow faults of the model
UNIT_INERTIA = dict.fromkeys(POSITIVE, 1.0)


def regressors(name: str, velocity: Array, acceleration: Array) -> Array:
    """The wrench that the unit value of a hull parameter takes from the ship, (n, 3).

    `velocity`: u, v, r, (n, 3). `acceleration`: du, dv, dr, (n, 3).
    """
    (u, v, r), (du, dv, dr), zero = velocity.T, acceleration.T, np.zeros(len(velocity))
    inertia = {
        "surge_inertia": (du, u * r, -u * v),
        "sway_inertia": (-v * r, dv, u * v),
        "yaw_inertia": (zero, zero, dr),
        "sway_yaw_inertia": (-0.5 * r * r, dr, 0.5 * u * r),
        "yaw_sway_inertia": (-0.5 * r * r, zero, dv + 0.5 * u * r),
    }
    if name in inertia:
        return np.column_stack(inertia[name])
    # The plant's own equation, with one coefficient of one, on arrays instead of floats.
    only: Any = damping_force
    return np.column_stack(only(u, v, r, vessel(UNIT_INERTIA | {name: 1.0})))


def columns(names: Sequence[str], run: Measurements, smoothed: Smoothed) -> Array:
    """The columns of all numbers; forces of gains and offsets count negative, (n, 3, p)."""
    found = []
    for name in names:
        if name in GAINS:
            column = -run.wrench * (np.arange(3) == GAINS.index(name))
        elif name in OFFSETS:
            offset = np.broadcast_to(np.eye(3)[OFFSETS.index(name)], run.wrench.shape)
            column = -in_body_frame(offset, smoothed.pose[:, 2])
        elif name == DELAY:
            column = np.gradient(run.wrench, run.time, axis=0)
        else:
            column = regressors(name, smoothed.velocity, smoothed.acceleration)
        found.append(column)
    return np.stack(found, axis=-1)


def regress(unknowns: Unknowns, runs: Sequence[tuple[Measurements, Smoothed]]) -> Array:
    """Least squares of all runs within the bounds, each of the three equations weighted by its input, (p,)."""
    return _solved(unknowns, runs)[0]


def regress_currents(unknowns: Unknowns, runs: Sequence[tuple[Measurements, Smoothed]]) -> Array:
    """The current of each run along x and y, (runs, 2), with which least squares leave least: for each, the hull follows.

    Zero where they explain less than SHOWN_BY of what is left without them: then they follow faults of the model.
    """
    speed = rms_speed(runs)

    def left(shares: Array) -> Array:
        return _solved(unknowns, through_water(runs, speed * (shares - 1.0).reshape(-1, 2)))[1]

    # In shares of the speed from 1 on, so that the finite differences have a scale.
    found = least_squares(left, np.ones(2 * len(runs)), diff_step=1e-3, max_nfev=MAX_EVALUATIONS)
    if np.sum(np.square(found.fun)) > (1.0 - SHOWN_BY) * np.sum(np.square(left(np.ones(2 * len(runs))))):
        return np.zeros((len(runs), 2))
    return np.asarray(speed * (found.x - 1.0).reshape(-1, 2))


def through_water(runs: Sequence[tuple[Measurements, Smoothed]], currents: Array) -> list[tuple[Measurements, Smoothed]]:
    """The runs with their velocities through the water: nu - R(psi)ᵀ·current, in whose frame the current turns at -r."""
    found = []
    for (run, smoothed), current in zip(runs, currents, strict=True):
        flow = in_body_frame(np.broadcast_to([*current, 0.0], smoothed.velocity.shape), smoothed.pose[:, 2])
        turning = flow[:, [1, 0, 2]] * smoothed.velocity[:, 2:] * (1.0, -1.0, 0.0)
        moved = smoothed._replace(velocity=smoothed.velocity - flow, acceleration=smoothed.acceleration - turning)
        found.append((run, moved))
    return found


def rms_speed(runs: Sequence[tuple[Measurements, Smoothed]]) -> float:
    """Root mean square speed over ground, or 1 for a ship at rest, m/s."""
    squares = np.concatenate([np.square(smoothed.velocity[:, :2]).sum(axis=1) for _, smoothed in runs])
    return float(np.sqrt(np.mean(squares))) or 1.0


def _solved(unknowns: Unknowns, runs: Sequence[tuple[Measurements, Smoothed]]) -> tuple[Array, Array]:
    """The estimates of the regression, (p,), and the weighted wrench that they leave, (m,)."""
    everything = (*HULL, *GAINS, *OFFSETS)
    fixed = unknowns.values(np.zeros(len(unknowns.names)))
    free = [everything.index(name) for name in unknowns.names]
    rest = np.array([0.0 if name in unknowns.names else fixed[name] for name in everything])
    full = np.concatenate([averaged(columns(everything, *run), *run) for run in runs])
    m23, m32 = everything.index("sway_yaw_inertia"), everything.index("yaw_sway_inertia")
    if rest[m32] == 0.0:
        # m32 = m23: one number with both columns.
        full[:, :, m23] += full[:, :, m32]
    matrix, target = full[:, :, free] / input_size(runs)[:, None], -full @ rest / input_size(runs)
    rows = matrix.reshape(-1, len(free))
    scale = np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
    low, high = unknowns.bounds()
    found = lsq_linear(rows / scale, target.reshape(-1), (low * scale, high * scale))
    return np.asarray(found.x / scale), np.asarray(found.fun)


def averaged(values: Array, run: Measurements, smoothed: Smoothed) -> Array:
    """Moving averages over `AVERAGED` bandwidths of the smoother, without those that reach beyond the run.

    `values`: one for each sample, (n, ...).
    """
    samples = round(AVERAGED * smoothed.bandwidth / float(np.median(np.diff(run.time))))
    samples = min(samples, len(values) // 4)
    filtered: Array = uniform_filter1d(values, samples, axis=0)
    return filtered[samples // 2 : len(values) - samples // 2]


def input_size(runs: Sequence[tuple[Measurements, Smoothed]]) -> Array:
    """Root mean square wrench, (3,); a force without an input has the size of the other one.

    An equation without an input has nothing but unknowns: weighted by its own residuals, it would make all of them zero.
    """
    surge, sway, yaw = np.sqrt(np.mean(np.square(np.concatenate([run.wrench for run, _ in runs])), axis=0)).tolist()
    # Without any force, or without a moment, as by a lever of 1 m.
    force = max(surge, sway) or yaw
    return np.array(
        [surge if surge > MIN_FORCE_SHARE * force else force, sway if sway > MIN_FORCE_SHARE * force else force, yaw or force]
    )


def natural_scale(unknowns: Unknowns, runs: Sequence[tuple[Measurements, Smoothed]]) -> Array:
    """For each number, the value with which its force is about as large as the recorded one; for currents the rms speed, (p,)."""
    flows = current_names(len(runs))
    names = [name for name in unknowns.names if name not in flows]
    matrix = np.concatenate([columns(names, *run) for run in runs])
    sizes = np.sqrt(np.mean(np.square(matrix), axis=0))
    wrench = np.concatenate([run.wrench for run, _ in runs])
    force = np.sqrt(np.mean(np.square(wrench), axis=0))
    # An equation without an input of its own, such as sway, has the forces of the others' inertia.
    force = np.maximum(force, 1e-3 * force.max() + 1e-300)
    scale = np.min(force[:, None] / np.maximum(sizes, 1e-9 * sizes.max() + 1e-300), axis=0)
    return np.append(scale, np.full(len(unknowns.names) - len(names), rms_speed(runs)))  # currents are the last of the unknowns


def unexcited(unknowns: Unknowns, runs: Sequence[tuple[Measurements, Smoothed]]) -> dict[str, str]:
    """Names of parameters whose force is zero in all runs, with that as the reason."""
    matrix = np.concatenate([columns(unknowns.names, *run) for run in runs])
    return {
        name: "nothing in the runs depends on it"
        for name, column in zip(unknowns.names, matrix.T, strict=True)
        if not column.any()
    }


LASTING, BRIEF = 0.5, (0.02, 0.1)
"""Longest lags of the residuals' autocorrelation, and of their products with the derivatives, as shares of a window."""
STRONG = 0.98  # correlation from which on two parameters are reported
INDISTINGUISHABLE = 1e-6
"""Relative norm of what is left of a parameter's effect when the others have explained it, below which it is not estimated."""


def covariance(cut: Windows, residuals: Array, jacobian: Array) -> Array:
    """Covariance of the errors of the estimates, (p, p).

    `residuals`: weighted residuals, (w, k + 1, 6), as `Shooting.residuals` gives them. `jacobian`: their derivatives without
    what initial states explain, (w, k + 1, 6, p).
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

    `jacobian`: derivatives of the residuals by them, (n + w, 6, p). `scale`: a change of each that matters, (p,).
    """
    rows: Array = np.linalg.qr(jacobian.reshape(-1, len(names)) * scale).R
    norms = np.linalg.norm(rows, axis=0)
    largest = max(float(norms.max(initial=0.0)), 1e-300)
    found: dict[str, str] = {}
    kept: list[int] = []
    # From the strongest effect to the weakest: of several alike, the strongest is kept.
    for index in np.argsort(-norms, kind="stable"):
        basis = np.linalg.qr(rows[:, kept])[0] if kept else np.zeros((len(rows), 0))
        residual = rows[:, index] - basis @ (basis.T @ rows[:, index])
        if norms[index] < INDISTINGUISHABLE * largest:
            found[names[index]] = "nothing in the runs depends on it"
        elif np.linalg.norm(residual) < INDISTINGUISHABLE * norms[index]:
            found[names[index]] = "its effect is the same as that of other parameters"
        else:
            kept.append(int(index))
    return found


def least_known(names: Sequence[str], vector: Array, matrix: Array, needed: Collection[str]) -> tuple[str, str]:
    """Name of the parameter whose standard error exceeds its value by most, and that as the reason; empty texts for none.

    `vector`: their estimates, (p,). `matrix`: covariance of their errors, (p, p). `needed`: names of those that do not count.
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
