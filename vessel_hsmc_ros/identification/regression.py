"""Linear regression for the hull parameters: M·dnu + C(nu)·nu + D(nu)·nu = wrench is linear in all of them.

Each parameter has a column: the wrench that the ship takes with this parameter one and all others zero. Both sides are averaged
over a moving window, which makes differences of velocities out of the noisy accelerations. What noise is left biases the result,
so it only starts the refinement.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.optimize import lsq_linear

from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.identification.parameter_vector import HULL, POSITIVE, Unknowns, vessel
from vessel_hsmc_ros.identification.smoothing import Smoothed, in_body_frame
from vessel_hsmc_ros.identification.types import DELAY, GAINS, OFFSETS, Measurements
from vessel_hsmc_ros.plant.dynamics import damping_force

AVERAGED = 4.0
"""Length over which both sides are averaged, in bandwidths of the smoother."""
SMALL = 1e-3
"""Share of the larger force below which an equation has no input."""
UNIT_INERTIA = dict.fromkeys(POSITIVE, 1.0)


def regressors(name: str, velocity: Array, acceleration: Array) -> Array:
    """The wrench that the unit value of a hull parameter takes from the ship, (n, 3).

    Args:
        name: Of the parameter.
        velocity: u, v, r, (n, 3).
        acceleration: du, dv, dr, (n, 3).
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
    return np.asarray(lsq_linear(rows / scale, target.reshape(-1), (low * scale, high * scale)).x / scale)


def averaged(values: Array, run: Measurements, smoothed: Smoothed) -> Array:
    """Moving averages over `AVERAGED` bandwidths of the smoother, without those that reach beyond the run.

    Args:
        values: One for each sample, (n, ...).
        run, smoothed: The run.
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
    return np.array([surge if surge > SMALL * force else force, sway if sway > SMALL * force else force, yaw or force])


def natural_scale(unknowns: Unknowns, runs: Sequence[tuple[Measurements, Smoothed]]) -> Array:
    """For each number, the value with which its force is about as large as the recorded one, (p,)."""
    matrix = np.concatenate([columns(unknowns.names, *run) for run in runs])
    sizes = np.sqrt(np.mean(np.square(matrix), axis=0))
    wrench = np.concatenate([run.wrench for run, _ in runs])
    force = np.sqrt(np.mean(np.square(wrench), axis=0))
    # An equation without an input of its own, such as sway, has the forces of the others' inertia.
    force = np.maximum(force, 1e-3 * force.max() + 1e-300)
    return np.asarray(np.min(force[:, None] / np.maximum(sizes, 1e-9 * sizes.max() + 1e-300), axis=0))


def unexcited(unknowns: Unknowns, runs: Sequence[tuple[Measurements, Smoothed]]) -> dict[str, str]:
    """Names of parameters whose force is zero in all runs, with that as the reason."""
    matrix = np.concatenate([columns(unknowns.names, *run) for run in runs])
    return {
        name: "nothing in the runs depends on it"
        for name, column in zip(unknowns.names, matrix.T, strict=True)
        if not column.any()
    }
