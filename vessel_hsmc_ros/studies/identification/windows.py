"""Smooths recorded runs, and simulates them window by window on the plant's own kernel, for output-error refinement.

Local cubic polynomials give pose, body velocities and their derivatives at every sample. Their bandwidth is chosen from the data:
the longest window whose residuals are hardly larger than the noise of the sensors, which the third differences of neighbouring
samples show. Velocities are differentiated from the pose where they are not measured.
"""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_coeffs, savgol_filter

from vessel_hsmc_ros.core.exceptions import IdentificationError
from vessel_hsmc_ros.core.kernel import Array, kernel
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.plant.dynamics import Vessel, rk4_step
from vessel_hsmc_ros.simulation.compilation import compiled
from vessel_hsmc_ros.studies.identification.types import Measurements, Prediction, vessel
from vessel_hsmc_ros.studies.identification.types import inputs as inputs_of

ORDER = 3
SHORTEST = 7  # window in samples: the shortest that still averages
TOLERANCE = 1.1  # largest ratio of the residuals of smoothing to the noise


class Smoothed(NamedTuple):
    """A smoothed run."""

    # pose, velocity, acceleration: x, y, heading; u, v, r; du, dv, dr: (n, 3) each
    pose: Array
    velocity: Array
    acceleration: Array
    noise: Array  # standard deviation of the measured x, y, heading, u, v, r, (6,); NaN where not measured
    error: Array  # the same of the smoothed ones, (6,), as far as it comes from noise
    bandwidth: float  # length of the polynomials' window, s

    @property
    def states(self) -> Array:
        """x, y, psi, u, v, r, (n, 6)."""
        return np.hstack([self.pose, self.velocity])


def smooth(run: Measurements) -> Smoothed:
    """Smooth a run; u = R(psi)ᵀ·dp, and du = R(psi)ᵀ·ddp + (r·v, -r·u), where the velocities are not measured."""
    step = float(np.median(np.diff(run.time)))
    measured = np.isfinite(run.velocity).all()
    columns = np.hstack([run.pose, run.velocity]) if measured else run.pose
    noise = _noise(columns)
    width = _width(columns, noise)
    pose, rate, second = (savgol_filter(run.pose, width, ORDER, deriv, step, axis=0) for deriv in range(3))
    if measured:
        velocity, acceleration = (savgol_filter(run.velocity, width, ORDER, deriv, step, axis=0) for deriv in range(2))
    else:
        velocity = in_body_frame(rate, pose[:, 2])
        turning = velocity[:, [1, 0]] * velocity[:, 2:] * (1.0, -1.0)
        acceleration = in_body_frame(second, pose[:, 2]) + np.column_stack([turning, np.zeros(len(pose))])
    # A smoothed value is a weighted sum of samples, so its standard deviation is that of the noise times the norm of the weights.
    norms = [float(np.linalg.norm(savgol_coeffs(width, ORDER, deriv, step))) for deriv in range(2)]
    error = np.append(norms[0] * noise[:3], norms[0] * noise[3:] if measured else norms[1] * noise)
    return Smoothed(pose, velocity, acceleration, np.append(noise, [np.nan] * 3)[:6], error, width * step)


def in_body_frame(vectors: Array, heading: Array) -> Array:
    """Rotate horizontal vectors from the earth-fixed into the body frame; third components, (n, 3), stay."""
    c, s = np.cos(heading), np.sin(heading)
    return np.column_stack([c * vectors[:, 0] + s * vectors[:, 1], c * vectors[:, 1] - s * vectors[:, 0], vectors[:, 2]])


def _noise(columns: Array) -> Array:
    """Standard deviation of the noise of each column; third differences have 20 times its variance and hardly any motion."""
    return np.asarray(np.sqrt(np.mean(np.square(np.diff(columns, 3, axis=0)), axis=0) / 20.0))


def _width(columns: Array, noise: Array) -> int:
    """Window in samples, odd: doubled in steps of a half until smoothing changes a column by more than its noise."""
    width, longest = SHORTEST, max(SHORTEST, len(columns) // 4)
    while (wider := int(1.5 * width) // 2 * 2 + 1) <= longest:
        residuals = columns - savgol_filter(columns, wider, ORDER, axis=0)
        if np.any(np.sqrt(np.mean(np.square(residuals), axis=0)) > TOLERANCE * noise + 1e-12):
            break
        width = wider
    return width


Integers = NDArray[np.int64]

BEYOND = 60.0  # how long the first and the last wrench of a run are taken to act, s: longer than any delay
LARGEST_STEP = 0.25  # samples that are further apart are bridged by several steps, s


class Windows(NamedTuple):
    """Windows of runs, with one row each, padded at their ends to the same number of samples."""

    times: Array  # time from each sample to the next, zero in the padding, (w, k), s
    wrench: Array  # (w, k, 3)
    measured: Array  # x, y, psi, u, v, r, (w, k, 6); NaN where not measured and in the padding
    # begin, end: the samples of each window among those of all runs, (w,) each
    begin: Integers
    end: Integers
    steps: int  # steps of integration from a sample to the next
    at: Array  # times of the samples, runs one after the other with a gap, (w, k), s
    # knots, impulse: times and integral of the wrench of all runs, (m,), s, and (m, 3)
    knots: Array
    impulse: Array
    run: Integers  # index of the run of each window, (w,)

    def delayed(self, delay: float) -> Array:
        """The mean wrench from each sample to the next, (w, k, 3), if it acts later than it is recorded.

        `delay`: by how much, s. A force that is sampled while it changes, instead of held, has half an interval less than 0.
        """
        if delay == 0.0:
            return self.wrench
        ends = self.at - delay + self.times
        columns = [np.interp(ends, self.knots, each) - np.interp(self.at - delay, self.knots, each) for each in self.impulse.T]
        return np.asarray(np.stack(columns, axis=-1) / np.where(self.times > 0.0, self.times, 1.0)[:, :, None])


def windows(runs: Sequence[Measurements], length: float, exact: bool = False) -> Windows:
    """Cut runs into windows of about one length.

    `exact`: exactly this length, without what is left at the end of a run, instead of equal parts.
    """
    edges, index, at = [], [], 0
    for number, run in enumerate(runs):
        samples = max(2, round(length / float(np.median(np.diff(run.time)))))
        count = max(1, len(run.time) // samples if exact else round(len(run.time) / samples))
        stop = min(count * samples, len(run.time)) if exact else len(run.time)
        bounds = np.linspace(0, stop, count + 1).round().astype(np.int64) + at
        edges.append(np.stack([bounds[:-1], bounds[1:]]))
        index.append(np.full(count, number))
        at += len(run.time)
    begin, end = np.concatenate(edges, axis=1)
    rows = begin[:, None] + np.arange(int(np.max(end - begin)))
    inside = rows < end[:, None]
    rows = np.where(inside, rows, begin[:, None])
    times = np.concatenate([np.append(np.diff(run.time), run.time[-1] - run.time[-2]) for run in runs])
    measured = np.concatenate([np.hstack([run.pose, run.velocity]) for run in runs])[rows]
    measured[~inside] = np.nan
    clock, knots, impulse = _impulses(runs)
    steps = max(1, math.ceil(float(np.median(times)) / LARGEST_STEP - 1e-6))
    wrench = np.concatenate([run.wrench for run in runs])[rows]
    times = np.where(inside, times[rows], 0.0)
    return Windows(times, wrench, measured, begin, end, steps, clock[rows], knots, impulse, np.concatenate(index))


def _impulses(runs: Sequence[Measurements]) -> tuple[Array, Array, Array]:
    """Times of all samples, (n,), and the integral of the wrench with its times; the first and last wrench of a run go on."""
    at, knots, impulse, first = [], [], [], 0.0
    for run in runs:
        last = run.time[-1] - run.time[-2]
        time = first + BEYOND + np.append(run.time, run.time[-1] + last) - run.time[0]
        edges = np.concatenate([[first], time, [time[-1] + BEYOND]])
        wrench = np.concatenate([run.wrench[:1], run.wrench, run.wrench[-1:]])
        at.append(time[:-1])
        knots.append(edges)
        impulse.append(np.concatenate([np.zeros((1, 3)), np.cumsum(wrench * np.diff(edges)[:, None], axis=0)]))
        first = edges[-1] + 1.0
    return np.concatenate(at), np.concatenate(knots), np.concatenate(impulse)


def unrolled(cut: Windows, values: Array, samples: int) -> Array:
    """Values by window, (w, k, c), as those of all runs one after the other, (n, c); NaN outside of the windows."""
    result = np.full((samples, values.shape[2]), np.nan)
    for begin, end, part in zip(cut.begin, cut.end, values, strict=True):
        result[begin:end] = part[: end - begin]
    return result


def simulated(
    cut: Windows,
    starts: Array,
    vessel: Vessel,
    gains: Array,
    offsets: Array,
    delay: float = 0.0,
    currents: Array | None = None,
) -> Array:
    """The motion in all windows, (w, k, 6).

    Args:
        starts: State at the first sample of each, (w, 6).
        gains: Factors on surge force, sway force and yaw moment, (3,).
        offsets: Steady forces in the earth-fixed frame and yaw moment, (3,).
        delay: By how much the wrench acts later than it is recorded, s.
        currents: Steady current of each run along x and y, over ground, (runs, 2), m/s; None for still water.

    Returns:
        States at the samples of each window, (w, k, 6); not finite where the motion diverges.
    """
    states = np.full(cut.measured.shape, np.nan)
    flow = np.zeros((len(starts), 2)) if currents is None else currents[cut.run]
    with suppress(ValueError):  # interpreted, the cosine of an infinite heading ends it; compiled, it is not finite either
        compiled(simulate_windows, allocates=False)(
            cut.times, cut.delayed(delay), starts, vessel, gains, offsets, flow, cut.steps, states
        )
    return states


@kernel
def simulate_windows(
    times: Array,
    wrench: Array,
    starts: Array,
    vessel: Vessel,
    gains: Array,
    offsets: Array,
    flow: Array,
    steps: int,
    states: Array,
) -> None:
    """`simulated` into an array; the wrench is constant from each sample to the next.

    `times`, `wrench`, `steps`: as in `Windows`. `starts`, `vessel`, `gains`, `offsets`: as in `simulated`. `flow`: current of
    each window, (w, 2). `states`: array for the result, (w, k, 6).
    """
    for window in range(len(starts)):
        first = starts[window].tolist()
        motion = Motion(first[0], first[1], first[2], first[3], first[4], first[5])
        current = (flow[window, 0], flow[window, 1])
        for row in range(times.shape[1]):
            states[window, row, 0], states[window, row, 1], states[window, row, 2] = motion.x, motion.y, motion.psi
            states[window, row, 3], states[window, row, 4], states[window, row, 5] = motion.u, motion.v, motion.r
            for _ in range(steps):
                force = total_wrench(motion.psi, wrench[window, row], gains, offsets)
                motion = rk4_step(motion, force, (0.0, 0.0, 0.0), vessel, times[window, row] / steps, current)


@kernel
def total_wrench(psi: float, wrench: Array, gains: Array, offsets: Array) -> tuple[float, float, float]:
    """The wrench on the hull: the recorded one times its gains, and the steady forces in the body frame.

    `wrench`: (3,). `gains`, `offsets`: as in `simulated`.
    """
    c, s = math.cos(psi), math.sin(psi)
    return (
        gains[0] * wrench[0] + c * offsets[0] + s * offsets[1],
        gains[1] * wrench[1] + c * offsets[1] - s * offsets[0],
        gains[2] * wrench[2] + offsets[2],
    )


WINDOW = 20.0  # default length of a window, s
FEWEST_IN_WINDOW = 10  # samples that a window needs at least


def require_rate(run: Measurements, window: float) -> None:
    """Check that a window has enough samples, and so that time is in seconds. Raises IdentificationError if it has not."""
    step = float(np.median(np.diff(run.time)))
    if window and step > window / FEWEST_IN_WINDOW:
        text = f"a window of {window:g} s needs {FEWEST_IN_WINDOW} samples or more: time must be in s, not in ms or ns"
        raise IdentificationError(f"{run.name}: the samples are {step:.3g} s apart, and {text}")


def predict(
    values: Mapping[str, float],
    measurements: Measurements,
    window: float = WINDOW,
    inputs: Mapping[str, float] | None = None,
    current: tuple[float, float] = (0.0, 0.0),
) -> Prediction:
    """Predict a run window by window, each from the smoothed state at its start.

    `values`: hull parameters by their names; those that are missing are zero. `measurements`: the run, best one that the values
    were not estimated from. `current`: steady current of the run along x and y, over ground, m/s. Raises IdentificationError if
    the run is shorter than a window.
    """
    require_rate(measurements, window)
    duration = float(measurements.time[-1] - measurements.time[0])
    if duration < window:
        raise IdentificationError(
            f"{measurements.name} lasts {duration:.1f} s: a prediction needs at least one window of {window:g} s"
        )
    smoothed = smooth(measurements)
    cut = windows([measurements], window, exact=True)
    parts = simulated(cut, smoothed.states[cut.begin], vessel(values), *inputs_of(inputs or {}), np.array([current]))
    states = unrolled(cut, parts, len(measurements.time))
    measured = np.hstack(
        [measurements.pose, np.where(np.isfinite(measurements.velocity), measurements.velocity, smoothed.velocity)]
    )
    errors = np.stack([(states - measured)[begin:end] for begin, end in zip(cut.begin, cut.end, strict=True)])
    return Prediction(
        window,
        measurements.time[cut.begin],
        _rms(np.hypot(errors[:, :, 0], errors[:, :, 1])),
        _rms(errors[:, :, 2]),
        _rms(errors[:, :, 3:]),
        states,
        measured,
        measurements.time,
    )


def _rms(errors: Array) -> Array:
    """Root mean square over the samples of each window, axis 1."""
    return np.asarray(np.sqrt(np.mean(np.square(errors), axis=1)))
