"""Output-error refinement: the hull parameters with which simulated windows come closest to the measured ones.

The initial state of every window is estimated as well, near the smoothed one (multiple shooting). It is eliminated (variable
projection): for given parameters the best initial states follow from a few Gauss-Newton steps per window, and the parameters see
only residuals that no initial state can explain.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from vessel_hsmc_ros.core.exceptions import IdentificationError, ParameterError
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.studies.identification.types import GAINS, NOT_NEGATIVE, POSITIVE, Unknowns, currents, inputs, vessel
from vessel_hsmc_ros.studies.identification.windows import Windows, simulated

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
        motion = simulated(self.cut, starts, vessel(values), *inputs(values), currents(values, int(self.cut.run[-1]) + 1))
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
    """Minimise the weighted residuals within the bounds, from a start.

    `shooting`: the residuals; its initial states are the best ones afterwards. `tolerance`: relative change of the sum of
    squares at which it ends. Raises IdentificationError if the motion diverges, whatever the start.
    """
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
