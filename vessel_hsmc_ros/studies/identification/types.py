"""What identification takes and gives: measurements, the parameters to estimate, as a vector and as models, and the result."""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_coeffs, savgol_filter

from vessel_hsmc_ros.core.exceptions import IdentificationError, ParameterError
from vessel_hsmc_ros.core.kernel import Array, kernel
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.core.schema import suggestion
from vessel_hsmc_ros.plant.dynamics import Vessel, rk4_step
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters
from vessel_hsmc_ros.simulation.compilation import compiled


class Measurements(NamedTuple):
    """One recorded run, sampled at increasing times; `measurements` reads it from runs, bags and CSV files."""

    time: Array  # (n,), s
    pose: Array  # x, y and heading, continuous over full turns, (n, 3)
    velocity: Array  # u, v, r in the body frame, over ground, (n, 3); NaN where they are not measured
    # surge force X [N], sway force Y [N] and yaw moment N [N·m] on the hull, each from its sample to the next, (n, 3)
    wrench: Array
    name: str = "run"  # what to call the run in messages and on pages
    doubts: tuple[str, ...] = ()  # sentences about what in it may be wrong


@dataclass(frozen=True)
class Model:
    """Which numbers are estimated; all others keep their start values."""

    name: str  # `paper`, `coupled`, `linear` or `own`
    parameters: tuple[str, ...]  # names of hull parameters, as in a vessel's file
    # what is estimated beside the hull: `surge_force_gain`, `sway_force_gain`, `yaw_moment_gain` (factors on the recorded
    # wrench), `force_x`, `force_y` (a steady force in the earth frame, N) and `yaw_moment_offset` (N·m)
    inputs: tuple[str, ...] = ()


class Prediction(NamedTuple):
    """Errors of predictions over windows, each started at the smoothed state of its first sample."""

    window: float  # length of a window, s
    starts: Array  # time at which each window starts, (w,), s
    position: Array  # root mean square position error of each window, (w,), m
    heading: Array  # the same of the heading, (w,)
    velocity: Array  # the same of u, v and r, (w, 3), m/s, m/s, rad/s
    simulated: Array  # the predicted x, y, psi, u, v, r of each sample, (n, 6); NaN outside the windows
    measured: Array  # the same from the measurements, (n, 6); smoothed velocities where they are not measured
    time: Array  # (n,), s

    def rms(self) -> dict[str, float]:
        """Root mean square errors over all windows: `position`, `heading`, `surge`, `sway` and `yaw_rate`."""
        means = [np.sqrt(np.mean(np.square(errors))) for errors in (self.position, self.heading, *self.velocity.T)]
        return dict(zip(("position", "heading", "surge", "sway", "yaw_rate"), map(float, means), strict=True))


class Current(NamedTuple):
    """A steady current over ground."""

    # x, y: its components, m/s
    x: float
    y: float
    error: float  # standard error of its speed, m/s; NaN where the run shows none, and it is zero


@dataclass(frozen=True)
class Identified:
    """The result of an identification."""

    model: Model  # what was to be estimated
    values: Mapping[str, float]  # every hull parameter by its name: estimated, or held
    inputs: Mapping[str, float]  # the estimated input gains and offsets by their names
    standard_errors: Mapping[str, float]  # of the estimated parameters and inputs, in the order of `correlation`
    correlation: Array  # of their errors, (p, p)
    # names of parameters that the runs do not determine, each with the reason; they are held
    unidentifiable: tuple[tuple[str, str], ...]
    warnings: tuple[str, ...]  # sentences about the rest: strong correlations, bounds that were reached
    residuals: tuple[Array, ...]  # for each run, measured minus simulated x, y, psi, u, v, r, (n, 6); NaN where not measured
    noise: Array  # standard deviation of the residuals by column, (6,)
    predictions: tuple[Prediction, ...]  # errors on the data used, one a run
    # smallest and largest u, v, r in the data, (3, 2): where the result is valid
    ranges: Array = field(default_factory=lambda: np.zeros((3, 2)))
    currents: tuple[Current, ...] = ()  # steady current of each run used

    @property
    def parameters(self) -> dict[str, float]:
        """The estimated parameters and inputs, without those that are held."""
        return {name: {**self.values, **self.inputs}[name] for name in self.standard_errors}

    def vessel_values(self) -> dict[str, float | list[float]]:
        """The hull data for a vessel's file, with the speed ranges of the data; parameters that are zero are left out."""
        hull: dict[str, float | list[float]] = {name: value for name, value in self.values.items() if value != 0.0}
        ranges = zip(("surge_speed_range", "sway_speed_range", "yaw_rate_range"), self.ranges.tolist(), strict=True)
        return hull | dict(ranges)


DIAGONAL_INERTIA = ("surge_inertia", "sway_inertia", "yaw_inertia")
LINEAR = ("surge_damping", "sway_damping", "yaw_damping")
PAPER = (*DIAGONAL_INERTIA, *LINEAR, *(f"{name}_{power}" for name in LINEAR for power in ("quadratic", "cubic")))
"""The paper's model (6): diagonal inertia, each velocity damped by itself."""

CROSS_LINEAR = ("sway_damping_from_yaw", "yaw_damping_from_sway")
LINEAR_MODEL = (*DIAGONAL_INERTIA, "sway_yaw_inertia", *LINEAR, *CROSS_LINEAR)
CROSS = (
    "sway_damping_at_yaw",
    "sway_damping_from_yaw_at_sway",
    "sway_damping_from_yaw_quadratic",
    "yaw_damping_from_sway_quadratic",
    "yaw_damping_from_sway_at_yaw",
    "yaw_damping_at_sway",
)
"""Damping that couples sway and yaw."""

COUPLED = (*PAPER, "sway_yaw_inertia", *CROSS_LINEAR, *CROSS)
OTHERS = (
    "surge_damping_from_sway",
    "surge_damping_from_sway_yaw",
    "sway_damping_at_surge",
    "sway_damping_from_yaw_at_surge",
    "yaw_damping_from_sway_at_surge",
    "yaw_damping_at_surge",
)
MODELS = {"paper": PAPER, "linear": LINEAR_MODEL, "coupled": COUPLED}
GAINS = ("surge_force_gain", "sway_force_gain", "yaw_moment_gain")
OFFSETS = ("force_x", "force_y", "yaw_moment_offset")
DELAY = "wrench_delay"
"""By how much the wrench acts later than it is recorded, s: estimated always, as an error of it looks like inertia."""


def model(names: str | Sequence[str], inputs: Sequence[str] = ()) -> Model:
    """The parameters to estimate, by the name of a model or one by one."""
    given = MODELS.get(names) if isinstance(names, str) else tuple(names)
    if given is None:
        raise ParameterError(f"{names} is not a model: {suggestion(str(names), MODELS)}")
    for known, chosen in (((*COUPLED, *OTHERS), given), ((*GAINS, *OFFSETS), inputs)):
        for name in chosen:
            if name not in known:
                raise ParameterError(f"{name} cannot be estimated: {suggestion(name, known)}")
    return Model(names if isinstance(names, str) else "own", tuple(given), tuple(inputs))


HULL = (
    "surge_inertia",
    "sway_inertia",
    "yaw_inertia",
    "sway_yaw_inertia",
    "yaw_sway_inertia",
    "surge_damping",
    "surge_damping_quadratic",
    "surge_damping_cubic",
    "surge_damping_from_sway",
    "surge_damping_from_sway_yaw",
    "sway_damping",
    "sway_damping_quadratic",
    "sway_damping_cubic",
    "sway_damping_at_yaw",
    "sway_damping_at_surge",
    "sway_damping_from_yaw",
    "sway_damping_from_yaw_quadratic",
    "sway_damping_from_yaw_at_sway",
    "sway_damping_from_yaw_at_surge",
    "yaw_damping",
    "yaw_damping_quadratic",
    "yaw_damping_cubic",
    "yaw_damping_at_sway",
    "yaw_damping_at_surge",
    "yaw_damping_from_sway",
    "yaw_damping_from_sway_quadratic",
    "yaw_damping_from_sway_at_yaw",
    "yaw_damping_from_sway_at_surge",
)
"""All hull parameters of the equations of motion."""

POSITIVE = ("surge_inertia", "sway_inertia", "yaw_inertia")
NOT_NEGATIVE = PAPER[3:]  # the damping of each velocity by itself: with these, and without others, the ship never gains energy
NEUTRAL = dict.fromkeys(GAINS, 1.0) | dict.fromkeys((*OFFSETS, DELAY), 0.0)


@dataclass(frozen=True)
class Unknowns:
    """The free numbers of an identification, in order, and the values of all the others."""

    names: tuple[str, ...]  # of the free numbers
    # values of all hull parameters and inputs; those of free numbers are not used
    fixed: Mapping[str, float] = field(default_factory=dict)
    earliest: float = 0.0  # by how much the wrench may act before it is recorded, s

    def values(self, vector: Array) -> dict[str, float]:
        """All numbers by their names."""
        return {**NEUTRAL, **dict.fromkeys(HULL, 0.0), **self.fixed, **dict(zip(self.names, map(float, vector), strict=True))}

    def without(self, held: Mapping[str, float]) -> "Unknowns":
        """The unknowns with some of them held at values."""
        return replace(self, names=tuple(name for name in self.names if name not in held), fixed={**self.fixed, **held})

    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds: inertia and gains are positive, the damping of a velocity by itself is not negative."""
        low = [0.0 if name in (*POSITIVE, *NOT_NEGATIVE, *GAINS) else -np.inf for name in self.names]
        delay = np.array(self.names) == DELAY
        return np.where(delay, -self.earliest, low), np.where(delay, 0.0, np.inf)


def unknowns(model: Model, start: VesselParameters | None) -> Unknowns:
    """The unknowns of a model; all other hull parameters as in a ship, or zero."""
    fixed = {} if start is None else {name: float(getattr(start, name)) for name in HULL}
    if "sway_yaw_inertia" in model.parameters:
        fixed["yaw_sway_inertia"] = 0.0  # the estimate is symmetric
    return Unknowns((*model.parameters, *model.inputs), fixed)


def vessel(values: Mapping[str, float]) -> Vessel:
    """The plant's coefficients; hull parameters that are missing are zero."""
    hull: dict[str, Any] = {name: float(values.get(name, 0.0)) for name in HULL}
    return VesselParameters(**hull).coefficients()


def inputs_of(values: Mapping[str, float]) -> tuple[Array, Array, float]:
    """Gains of surge force, sway force and yaw moment, (3,), offsets of earth-fixed forces and yaw moment, (3,), and delay."""
    chosen: Sequence[Sequence[str]] = (GAINS, OFFSETS)
    gains, offsets = (np.array([float(values.get(name, NEUTRAL[name])) for name in names]) for names in chosen)
    return gains, offsets, float(values.get(DELAY, 0.0))


def current_names(runs: int) -> tuple[str, ...]:
    """Names of the components of the current of each run, which are estimated with the hull."""
    return tuple(f"current_{axis}_{number}" for number in range(1, runs + 1) for axis in "xy")


def currents(values: Mapping[str, float], runs: int) -> Array:
    """The steady current of each run along x and y, over ground, (runs, 2), m/s; zero where it is not among the values."""
    return np.array([float(values.get(name, 0.0)) for name in current_names(runs)]).reshape(runs, 2)


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
    # Third differences have 20 times the variance of the noise and hardly any motion.
    noise = np.sqrt(np.mean(np.square(np.diff(columns, 3, axis=0)), axis=0) / 20.0)
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
    """Cut runs into windows of about one length."""
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
    cut: Windows, starts: Array, vessel: Vessel, gains: Array, offsets: Array, delay: float = 0.0, currents: Array | None = None
) -> Array:
    """The motion in all windows, (w, k, 6).

    `starts`: State at the first sample of each, (w, 6). `gains`: Factors on surge force, sway force and yaw moment, (3,).
    `offsets`: Steady forces in the earth-fixed frame and yaw moment, (3,). `currents`: Steady current of each run along x and
    y, over ground, (runs, 2), m/s; None for still water.

    Returns states at the samples of each window, (w, k, 6); not finite where the motion diverges.
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

    `flow`: current of each window, (w, 2). `states`: array for the result, (w, k, 6).
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
    """The wrench on the hull: the recorded one times its gains, and the steady forces in the body frame. `wrench`: (3,)."""
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
    """Predict a run window by window, each from the smoothed state at its start."""
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
