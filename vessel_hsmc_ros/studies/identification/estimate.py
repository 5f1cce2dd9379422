"""Identification as a whole: smoothing, output-error refinements, uncertainties, warnings.

The initial state of every window is estimated as well, near the smoothed one (multiple shooting). It is eliminated (variable
projection): for given parameters the best initial states follow from a few Gauss-Newton steps per window, and the parameters see
only residuals that no initial state can explain.
"""

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from vessel_hsmc_ros.core.exceptions import IdentificationError, ParameterError
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters
from vessel_hsmc_ros.studies.identification import regression
from vessel_hsmc_ros.studies.identification.measurements import checked, few_reversals
from vessel_hsmc_ros.studies.identification.regression import natural_scale, regress, regress_currents, through_water, unexcited
from vessel_hsmc_ros.studies.identification.types import (
    DELAY,
    GAINS,
    HULL,
    NOT_NEGATIVE,
    OFFSETS,
    PAPER,
    POSITIVE,
    WINDOW,
    Current,
    Identified,
    Measurements,
    Model,
    Smoothed,
    Unknowns,
    Windows,
    current_names,
    currents,
    inputs_of,
    predict,
    simulated,
    smooth,
    unknowns,
    unrolled,
    vessel,
    windows,
)

DIFFERENCE = 1e-5  # relative step of the finite differences
DIVERGED = 1e9  # residuals from which on the motion is taken to diverge, in standard deviations of the noise
MAX_DERIVATIVE = 1e100  # largest derivative: the squares of larger ones, where the motion nearly diverges, overflow
INNER = 2  # gauss-Newton steps for the initial states
MAX_EVALUATIONS = 40  # largest number of evaluations of one refinement
HEAVIER, ATTEMPTS = 4.0, 12  # factor on the inertia where a start makes the motion diverge, and how often it is applied
UNSCALED_PARAMETERS = (*NOT_NEGATIVE, *GAINS)  # what such a start keeps: it takes energy from the ship, or is a factor


@dataclass
class Shooting:
    """The residuals of all windows as a function of the parameters."""

    unknowns: Unknowns
    cut: Windows
    length: float  # their length, s
    around: Array  # initial states of the windows by the smoother, (w, 6)
    spread: Array  # how far the initial states may be from these: their standard deviation by column, (6,)
    noise: Array  # standard deviation of each column of the measurements, (6,)
    scale: Array  # a change of each parameter that matters, (p,), for finite differences

    def __post_init__(self) -> None:
        self.starts = self.around
        """The best initial states for the last parameters, (w, 6)."""

    def states(self, vector: Array, starts: Array) -> Array:
        """The simulated motion, (w, k, 6); infinite from where it diverges."""
        values = self.unknowns.values(vector)
        motion = simulated(self.cut, starts, vessel(values), *inputs_of(values), currents(values, int(self.cut.run[-1]) + 1))
        return np.where(np.isfinite(motion), motion, np.inf)

    @np.errstate(over="ignore", invalid="ignore")
    def residuals(self, vector: Array) -> Array:
        """Weighted residuals of the measurements and of the initial states, with the best initial states.

        Returns shape (w, k + 1, 6), zero where not measured; the initial states are last. All NaN where the motion diverges.
        """
        starts = self.around
        try:
            errors = self._errors(vector, starts)
            tangent = self._to_starts(vector, starts, errors)
            basis, triangle = np.linalg.qr(tangent)
            for _ in range(INNER):
                inner = np.einsum("wai,wa->wi", basis, errors.reshape(len(starts), -1))
                moved = starts - np.linalg.solve(triangle, inner[:, :, None])[:, :, 0]
                tried = self._errors(vector, moved)
                # Over long windows of an unstable ship the step can be too long.
                better = np.square(tried).sum(axis=(1, 2)) < np.square(errors).sum(axis=(1, 2))
                starts = np.where(better[:, None], moved, starts)
                errors = np.where(better[:, None, None], tried, errors)
        except (ParameterError, np.linalg.LinAlgError):  # an inertia matrix without an inverse, a motion that overflows
            errors = np.full_like(self.cut.measured[:, :1], np.inf)
        if not np.abs(errors).max() < DIVERGED:
            count, samples, columns = self.cut.measured.shape
            return np.full((count, samples + 1, columns), np.nan)
        self.starts, self._basis = starts, basis
        return errors

    @np.errstate(over="ignore", invalid="ignore")
    def jacobian(self, vector: Array) -> Array:
        """Derivatives of the last residuals by the parameters, less what initial states explain, (w, k + 1, 6, p)."""
        base, parts = self._errors(vector, self.starts), []
        for index, scale in enumerate(self.scale):
            step = DIFFERENCE * max(abs(vector[index]), scale)
            moved = vector.copy()
            moved[index] += step
            parts.append((self._errors(moved, self.starts) - base) / step)
        rows = _derivatives(parts)
        left = rows - self._basis @ (self._basis.transpose(0, 2, 1) @ rows)
        return np.asarray(left.reshape(*base.shape, len(vector)))

    @np.errstate(over="ignore", invalid="ignore")
    def turn(self, vector: Array) -> float:
        """By how much the uncertainty of its initial state turns the ship within a window, at most, rad."""
        try:
            tangent = self._to_starts(vector, self.starts, self._errors(vector, self.starts))
        except ParameterError:  # an inertia matrix without an inverse
            return np.inf
        heading = tangent.reshape(len(self.starts), -1, 6, 6)[:, :-1, 2] * self.noise[2] * self.spread
        return float(np.sqrt(np.square(heading).sum(axis=2)).max())

    def _errors(self, vector: Array, starts: Array) -> Array:
        """Weighted residuals, (w, k + 1, 6); not finite where the motion diverges."""
        measured = np.nan_to_num((self.cut.measured - self.states(vector, starts)) / self.noise, posinf=np.inf, neginf=-np.inf)
        return np.concatenate([measured, ((self.around - starts) / self.spread)[:, None]], axis=1)

    def _to_starts(self, vector: Array, starts: Array, base: Array) -> Array:
        """Derivatives of the residuals by the initial state of their own window, (w, (k + 1)·6, 6)."""
        parts = []
        for column, step in enumerate(DIFFERENCE * np.maximum(np.abs(starts).max(axis=0), self.spread)):
            moved = starts.copy()
            moved[:, column] += step
            parts.append((self._errors(vector, moved) - base) / step)
        return _derivatives(parts)


def _derivatives(parts: Sequence[Array]) -> Array:
    """Derivatives by each of p numbers, (w, k + 1, 6) each, as (w, (k + 1)·6, p); zero where the motion diverges."""
    rows = np.stack(parts, axis=-1)
    rows = np.clip(np.where(np.isfinite(rows), rows, 0.0), -MAX_DERIVATIVE, MAX_DERIVATIVE)
    return np.asarray(rows.reshape(len(rows), -1, len(parts)))


@np.errstate(over="ignore", invalid="ignore")
def refine(shooting: Shooting, start: Array, progress: Callable[[int], None] = lambda _: None, tolerance: float = 1e-7) -> Array:
    """Minimise the weighted residuals within the bounds, from a start."""
    low, high = shooting.unknowns.bounds()
    # Of bounds that are close together, like those of the delay, never more than a part of their distance.
    margin = np.minimum(1e-6 * shooting.scale, 0.25 * (high - low))
    inside = _finite(shooting, np.clip(start, low + margin, high - margin))
    iterations = itertools.count(1)

    def derivatives(vector: Array) -> Array:
        progress(next(iterations))
        return shooting.jacobian(vector).reshape(-1, len(vector))

    found = least_squares(
        lambda vector: shooting.residuals(vector).reshape(-1),
        inside,
        derivatives,
        (low, high),
        x_scale="jac",
        ftol=tolerance,
        xtol=1e-7,
        max_nfev=MAX_EVALUATIONS,
    )
    shooting.residuals(found.x)
    return np.asarray(found.x)


def _finite(shooting: Shooting, start: Array) -> Array:
    """A start from which no simulated motion diverges: the given one, or one with more inertia and less coupling.

    Without coupling the energy of a ship does not grow, and the heavier it is the longer it keeps its velocity.
    """
    names = shooting.unknowns.names
    factors = np.array([HEAVIER if name in POSITIVE else 1.0 if name in UNSCALED_PARAMETERS else 1.0 / HEAVIER for name in names])
    for _ in range(ATTEMPTS):
        if np.isfinite(shooting.residuals(start)).all():
            return start
        start = start * factors
    raise IdentificationError("the simulated motion diverges: choose a shorter --window, or a model with fewer parameters")


UNEXPLAINED = 1.3  # residuals from which on a warning is given, in units of the noise of the sensors
COLUMNS = ("x", "y", "heading", "surge velocity", "sway velocity", "yaw rate")


Progress = Callable[[str, float], None]  # called with what is being done and how much of it is done, 0 to 1
NEVER_HELD = (*POSITIVE, *GAINS, *OFFSETS)
STABLE = (*PAPER, *GAINS, *OFFSETS)
LENGTHS = (1 / 16, 1 / 4, 1.0)
"""Windows of the refinements, as a share of the final one: over a short time the first ship stays near the measured one."""
LARGEST_TURN = 0.5
"""Windows are shortened until the uncertainty of their initial state turns the ship by less, rad: on a hull that does not keep
its course, small errors become large ones, and residuals have many minima."""
HALVED = 3  # how often at most
SPREAD = 3.0  # standard deviation of the initial states of windows around the smoothed ones, in units of the smoother's error
EARLIEST = 0.5
"""By how much the wrench acts before its samples at most, in intervals: half of one if it is sampled while it changes, nothing if
it is held. Not after them: a lag of the actuators is not the timing of a logger."""
PERFECT = 1e-6  # noise of a perfect sensor, relative to the range of the motion: its rounding


class Fit(NamedTuple):
    """The end of the refinements."""

    full: Shooting  # the residuals as a function of all parameters that have an effect of their own
    shooting: Shooting  # the same of those that the runs determine
    vector: Array  # their estimates, (p,)
    held: dict[str, str]  # the reasons for the others, by name


def identify(
    runs: Sequence[Measurements],
    model: Model,
    start: VesselParameters | None = None,
    window: float = WINDOW,
    progress: Progress = lambda *_: None,
) -> Identified:
    """Estimate hull parameters from recorded runs. `start`: values of the parameters that are not estimated; None for zero."""
    given = [checked(run, window) for run in runs]
    if not given:
        raise IdentificationError("there is no run to identify from: give at least one")
    progress("smoothing", 0.0)
    smoothed = [smooth(run) for run in given]
    try:
        fit = refined(given, smoothed, unknowns(model, start), window, progress)
    except IdentificationError as error:
        if doubts := _doubts(given):
            raise IdentificationError(f"{doubts[0]}; {error}") from None
        raise
    progress("standard errors", 0.95)
    return _result(given, model, fit, window)


def _result(runs: list[Measurements], model: Model, fit: Fit, window: float) -> Identified:
    """The estimates with their standard errors, residuals and predictions."""
    _, shooting, vector, held = fit
    names, values = shooting.unknowns.names, shooting.unknowns.values(vector)
    matrix = covariance(fit)
    shooting.residuals(vector)
    correlation = regression.correlations(matrix)
    errors = dict(zip(names, np.sqrt(np.diag(matrix)).tolist(), strict=True))
    chosen = (*model.parameters, *model.inputs)
    reported = [index for index, name in enumerate(names) if name in chosen]
    hull = {name: values[name] for name in HULL}
    inputs = {name: values[name] for name in (*model.inputs, *(name for name in names if name == DELAY))}
    flows = _currents(len(runs), values, errors)
    lengths = [len(run.time) for run in runs]
    simulated = shooting.states(vector, shooting.starts)
    unweighted = unrolled(shooting.cut, shooting.cut.measured - simulated, sum(lengths))
    return Identified(
        replace(model),
        hull,
        inputs,
        {names[index]: errors[names[index]] for index in reported},
        correlation[np.ix_(reported, reported)],
        tuple((name, why) for name, why in held.items() if name in chosen),
        (
            *_doubts(runs),
            *few_reversals(runs, names),
            *_unexplained(runs, shooting),
            *_unstable(shooting.length, window),
            *regression.strong_correlations(names, correlation),
        ),
        tuple(np.split(unweighted, np.cumsum(lengths)[:-1])),
        np.where(np.isfinite(shooting.cut.measured).any(axis=(0, 1)), shooting.noise, np.nan),
        tuple(predict(hull, run, window, inputs, flow[:2]) for run, flow in zip(runs, flows, strict=True)),
        np.column_stack([simulated[:, :, 3:].min(axis=(0, 1)), simulated[:, :, 3:].max(axis=(0, 1))]),
        flows,
    )


def _currents(runs: int, values: Mapping[str, float], errors: Mapping[str, float]) -> tuple[Current, ...]:
    """The current of each run, from all values and the standard errors of the estimated ones."""
    found = []
    for flow, error in zip(currents(values, runs), currents(errors, runs), strict=True):
        speed = float(np.hypot(*flow))
        # A component that is held has no standard error, and is zero.
        own = float(np.hypot(*(flow * error))) / speed if speed else np.nan
        found.append(Current(float(flow[0]), float(flow[1]), own))
    return tuple(found)


def _doubts(runs: Sequence[Measurements]) -> list[str]:
    return [f"{run.name}: {doubt}" for run in runs for doubt in run.doubts]


def _unexplained(runs: list[Measurements], shooting: Shooting) -> list[str]:
    """A sentence about residuals that are larger than the noise of the sensors."""
    ratio = shooting.noise / largest([smooth(run) for run in runs], "noise")
    worst = int(np.argmax(ratio))
    if ratio[worst] < UNEXPLAINED:
        return []
    return [
        f"the residuals of {COLUMNS[worst]} are {ratio[worst]:.2g} times the noise of its sensor: something acts on the ship that"
        " is not in the wrench or the model, and the standard errors may be too small; compare predictions of held-out runs"
    ]


def _unstable(length: float, window: float) -> list[str]:
    """A sentence about windows that were shortened."""
    if length == window:
        return []
    return [
        f"this hull turns a small error into a large one within {window:g} s, as one that does not keep its course: it was"
        f" identified over windows of {length:g} s, and even true hull data fail to predict some windows of {window:g} s"
    ]


def refined(runs: list[Measurements], smoothed: list[Smoothed], free: Unknowns, window: float, progress: Progress) -> Fit:
    """Regression and refinements; parameters that the runs do not determine are held after the last window length."""
    progress("regression", 0.02)
    data = list(zip(runs, smoothed, strict=True))
    idle = _required(unexcited(free, data))
    free = _holding(free, idle)
    noise = largest(smoothed, "noise")
    flows = regress_currents(free, data)
    moving = through_water(data, flows)
    shown = current_names(len(runs)) if flows.any() else ()
    vector = np.concatenate([_start(moving, free, LENGTHS[0] * window, noise), [0.0], flows.ravel()[: len(shown)]])
    interval = max(float(np.median(np.diff(run.time))) for run in runs)
    free = replace(free, names=(*free.names, DELAY, *shown), earliest=EARLIEST * interval)
    shooting, vector, early = _lengthened(data, free, vector, noise, window, progress)
    shooting.residuals(vector)
    jacobian = shooting.jacobian(vector)
    alike = _required(regression.indistinguishable(shooting.unknowns.names, jacobian, shooting.scale))
    shooting, vector, unknown = reduced(*holding(shooting, vector, jacobian, alike), NEVER_HELD)
    vector = refine(shooting, vector, _reporting(progress, len(LENGTHS)))
    full = _shooting(data, _holding(free, alike), shooting.length, _noise(shooting, vector))
    shooting.noise = full.noise
    return Fit(full, shooting, vector, idle | early | alike | unknown)


def _start(data: list[tuple[Measurements, Smoothed]], free: Unknowns, length: float, noise: Array) -> Array:
    """Estimates by regression, (p,); without cross terms if the motion with them diverges within a window of a length, s.

    Without cross terms the ship never gains energy: the refinement adds them, if the runs show them.
    """
    found = regress(free, data)
    if np.isfinite(_shooting(data, free, length, noise).residuals(found)).all():
        return found
    plain = free.without({name: free.fixed.get(name, 0.0) for name in free.names if name not in STABLE})
    values = plain.values(regress(plain, data))
    return np.array([values[name] for name in free.names])


def _lengthened(
    data: list[tuple[Measurements, Smoothed]], free: Unknowns, vector: Array, noise: Array, window: float, progress: Progress
) -> tuple[Shooting, Array, dict[str, str]]:
    """Refinements over longer and longer windows; the last residuals, their estimates, and what is held before its end.

    Parameters that short windows do not determine are held at once where they make the ship unstable: from there, longer windows
    find nothing.
    """
    held: dict[str, str] = {}
    before: Shooting | None = None
    for number, share in enumerate(LENGTHS):
        shooting = _fitting(data, free, vector, share * window, noise)
        moved = refine(shooting, vector, _reporting(progress, number), ROUGH)
        if before and shooting.turn(moved) > LARGEST_TURN:
            smaller, vector, early = reduced(before, vector, NEVER_HELD)
            free, held = smaller.unknowns, held | early
            shooting = _fitting(data, free, vector, share * window, noise)
            moved = refine(shooting, vector, _reporting(progress, number), ROUGH)
        noise = _noise(shooting, moved)
        shooting.noise = noise
        vector, before = moved, shooting
    return shooting, vector, held


def _holding(free: Unknowns, held: dict[str, str]) -> Unknowns:
    """The unknowns with some of them held at their start values, or zero."""
    return free.without({name: free.fixed.get(name, 0.0) for name in held})


def _required(found: dict[str, str]) -> dict[str, str]:
    """Parameters to hold, with the reasons, if none of them is one without which there is no ship."""
    for name in found:
        if name in NEVER_HELD:
            raise IdentificationError(f"the runs do not determine {name}: {found[name]}; excite it, or give it by a start vessel")
    return found


def _shooting(data: list[tuple[Measurements, Smoothed]], free: Unknowns, window: float, noise: Array) -> Shooting:
    """The residuals over windows of one length, in s."""
    cut = windows([run for run, _ in data], window)
    states = np.concatenate([each.states for _, each in data])
    spread = SPREAD * largest([each for _, each in data], "error")
    return Shooting(free, cut, window, states[cut.begin], spread, noise, natural_scale(free, data))


def _fitting(data: list[tuple[Measurements, Smoothed]], free: Unknowns, vector: Array, length: float, noise: Array) -> Shooting:
    """The residuals over windows of a length, s, halved until the motion does not depend too much on their initial states."""
    shooting = _shooting(data, free, length, noise)
    for _ in range(HALVED):
        if shooting.turn(vector) < LARGEST_TURN:
            break
        length /= 2.0
        shooting = _shooting(data, free, length, noise)
    return shooting


def largest(smoothed: list[Smoothed], what: str) -> Array:
    """Noise or error by column, (6,), of the run with the largest; that of perfect sensors is the rounding of the motion."""
    values = np.fmax.reduce([getattr(each, what) for each in smoothed])
    size = np.ptp(np.concatenate([each.states for each in smoothed]), axis=0)
    return np.where(np.isfinite(values), np.fmax(values, PERFECT * np.maximum(size, PERFECT)), 1.0)


def _noise(shooting: Shooting, vector: Array) -> Array:
    """Standard deviation of the residuals of each column, (6,), from those weighted by the noise assumed so far."""
    # Residuals are zero where nothing is measured.
    count = np.isfinite(shooting.cut.measured).sum(axis=(0, 1))
    size = np.sqrt(np.square(shooting.residuals(vector)[:, :-1]).sum(axis=(0, 1)) / np.maximum(count, 1))
    return np.asarray(shooting.noise * np.where(size > 0.0, size, 1.0))


def _reporting(progress: Progress, number: int) -> Callable[[int], None]:
    """Progress of one refinement by its iterations, of which there are some five to ten."""
    share = 0.9 / (len(LENGTHS) + 1)
    return lambda k: progress(f"refinement {number + 1}, iteration {k}", 0.05 + share * (number + k / (k + 5.0)))


def covariance(fit: Fit) -> Array:
    """Covariance of the errors of the estimates, (p, p), as if the parameters that the runs do not determine were estimated too.

    They are held because they are not known, and what is wrong about their values goes into the others.
    """
    values = fit.shooting.unknowns.values(fit.vector)
    vector = np.array([values[name] for name in fit.full.unknowns.names])
    residuals = fit.full.residuals(vector)
    matrix = regression.covariance(fit.full.cut, residuals, fit.full.jacobian(vector))
    chosen = [fit.full.unknowns.names.index(name) for name in fit.shooting.unknowns.names]
    return matrix[np.ix_(chosen, chosen)]


ROUGH = 1e-4  # tolerance of refinements that are followed by others
MOST_RISE = 9.0  # largest rise of the sum of squares by a parameter that is held: as of a deviation of three standard errors


def reduced(shooting: Shooting, vector: Array, needed: tuple[str, ...]) -> tuple[Shooting, Array, dict[str, str]]:
    """Hold each parameter whose standard error exceeds its value at its start value, or zero: the least certain first.

    `vector`: their estimates, (p,). Returns the residuals as a function of the remaining parameters, their estimates, and the
    reasons for the others by name.
    """
    found: dict[str, str] = {}
    refused = set(needed)
    while True:
        residuals, jacobian = shooting.residuals(vector), shooting.jacobian(vector)
        matrix = regression.covariance(shooting.cut, residuals, jacobian)
        name, reason = regression.least_known(shooting.unknowns.names, vector, matrix, refused)
        if not name:
            return shooting, vector, found
        smaller, moved = holding(shooting, vector, jacobian, {name: reason})
        index = shooting.unknowns.names.index(name)
        white = regression.inverse(jacobian.reshape(-1, len(vector)))[index, index]
        allowed = np.square(residuals).sum() + MOST_RISE * matrix[index, index] / white
        try:
            moved = refine(smaller, moved, tolerance=ROUGH)
            explained = np.square(smaller.residuals(moved)).sum() <= allowed
        except IdentificationError:  # without this parameter the motion diverges
            explained = False
        if explained:
            shooting, vector = smaller, moved
            found[name] = reason
        else:
            refused.add(name)


def holding(shooting: Shooting, vector: Array, jacobian: Array, held: Mapping[str, str]) -> tuple[Shooting, Array]:
    """The residuals with some parameters held at their start values, or zero, and the estimates of the others, moved along.

    `shooting`, `vector`: the residuals, and the estimates of their parameters, (p,). `jacobian`: derivatives of the residuals,
    (w, k + 1, 6, p). `held`: what is to be held, by name.
    """
    names, fixed = shooting.unknowns.names, shooting.unknowns.fixed
    stays = np.array([name not in held for name in names])
    values = {name: fixed.get(name, 0.0) for name in held}
    change = vector[~stays] - np.array([values[name] for name in names if name in held])
    rows = jacobian.reshape(-1, len(names))
    scale = 1.0 / np.maximum(np.linalg.norm(rows[:, stays], axis=0), 1e-300)
    step = scale * np.linalg.lstsq(rows[:, stays] * scale, rows[:, ~stays] @ change, rcond=1e-9)[0]
    low, high = shooting.unknowns.bounds()
    moved = np.clip(vector[stays] + step, low[stays], high[stays])
    return replace(shooting, unknowns=shooting.unknowns.without(values), scale=shooting.scale[stays]), moved
