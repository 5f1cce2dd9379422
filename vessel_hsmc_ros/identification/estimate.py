"""Identification as a whole: smoothing, regression, output-error refinement, uncertainties."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from vessel_hsmc_ros.core.exceptions import IdentificationError
from vessel_hsmc_ros.identification import uncertainty
from vessel_hsmc_ros.identification.checks import checked
from vessel_hsmc_ros.identification.models import GAINS, OFFSETS
from vessel_hsmc_ros.identification.parameter_vector import HULL, POSITIVE, Unknowns, unknowns
from vessel_hsmc_ros.identification.prediction import WINDOW, predict
from vessel_hsmc_ros.identification.refinement import Shooting, refine
from vessel_hsmc_ros.identification.regression import natural_scale, regress, unexcited
from vessel_hsmc_ros.identification.smoothing import Smoothed, smooth
from vessel_hsmc_ros.identification.types import Array, Identified, Measurements, Model
from vessel_hsmc_ros.identification.windows import unrolled, windows
from vessel_sim_node.plant import VesselParameters

Progress = Callable[[str, float], None]
"""Called with what is being done and how much of it is done, 0 to 1."""

NEVER_HELD = (*POSITIVE, *GAINS, *OFFSETS)
LENGTHS = (1 / 16, 1 / 4, 1.0)
"""Windows of the refinements, as a share of the final one: over a short time the first ship stays near the measured one."""
LARGEST_TURN = 0.5
"""Windows are shortened until the uncertainty of their initial state turns the ship by less, rad: on a hull that does not keep
its course, small errors become large ones, and residuals have many minima."""
HALVED = 3
"""How often at most."""
ROUGH = 1e-4
"""Tolerance of all refinements but the last."""
SPREAD = 3.0
"""Standard deviation of the initial states of windows around the smoothed ones, in units of the smoother's error."""
PERFECT = 1e-6
"""Noise of a perfect sensor, relative to the range of the motion: its rounding."""


def identify(
    runs: Sequence[Measurements],
    model: Model,
    start: VesselParameters | None = None,
    window: float = WINDOW,
    progress: Progress = lambda *_: None,
) -> Identified:
    """Estimate hull parameters from recorded runs.

    Args:
        runs: At least one run.
        model: What is estimated.
        start: Values of the parameters that are not estimated; None for zero.
        window: Length of the windows of output-error refinement and of prediction, s.
        progress: Called as the work goes on.

    Raises:
        IdentificationError: the runs are too short, not excited, or not those of a ship.
    """
    given = [checked(run, window) for run in runs]
    if not given:
        raise IdentificationError("there is no run to identify from: give at least one")
    progress("smoothing", 0.0)
    smoothed = [smooth(run) for run in given]
    shooting, vector, held = _refined(given, smoothed, unknowns(model, start), window, progress)
    progress("standard errors", 0.95)
    return _result(given, model, shooting, vector, held, window)


def _refined(
    runs: list[Measurements], smoothed: list[Smoothed], free: Unknowns, window: float, progress: Progress
) -> tuple[Shooting, Array, dict[str, str]]:
    """Regression and refinements; parameters that the runs do not determine are held after the last window length."""
    progress("regression", 0.02)
    data = list(zip(runs, smoothed, strict=True))
    idle = _required(unexcited(free, data))
    free = _holding(free, idle)
    vector, noise = regress(free, data), _largest(smoothed, "noise")
    for number, share in enumerate(LENGTHS):
        shooting = _fitting(data, free, vector, share * window, noise)
        vector = refine(shooting, vector, _reporting(progress, number), ROUGH)
        noise = _noise(shooting, vector)
    held = _to_hold(shooting, vector)
    if held:
        vector = vector[[name not in held for name in free.names]]
        free = _holding(free, held)
    shooting = _shooting(data, free, shooting.length, noise)
    vector = refine(shooting, vector, _reporting(progress, len(LENGTHS)))
    shooting.noise = _noise(shooting, vector)
    return shooting, vector, idle | held


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
    spread = SPREAD * _largest([each for _, each in data], "error")
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


def _largest(smoothed: list[Smoothed], what: str) -> Array:
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


def _to_hold(shooting: Shooting, vector: Array) -> dict[str, str]:
    """Parameters that the runs do not determine, with the reasons."""
    names, jacobian = shooting.unknowns.names, shooting.jacobian(vector)
    found = _required(uncertainty.indistinguishable(names, jacobian, shooting.scale))
    rest = [index for index, name in enumerate(names) if name not in found]
    matrix = uncertainty.covariance(shooting.cut, shooting.residuals(vector), jacobian[..., rest])
    chosen = [names[index] for index in rest]
    return found | uncertainty.uninformed(chosen, vector[rest], matrix, shooting.unknowns.fixed, NEVER_HELD)


def _result(
    runs: list[Measurements], model: Model, shooting: Shooting, vector: Array, held: dict[str, str], window: float
) -> Identified:
    """The estimates with their standard errors, residuals and predictions."""
    names, values = shooting.unknowns.names, shooting.unknowns.values(vector)
    residuals = shooting.residuals(vector)
    matrix = uncertainty.covariance(shooting.cut, residuals, shooting.jacobian(vector))
    correlation = uncertainty.correlations(matrix)
    hull = {name: values[name] for name in HULL}
    inputs = {name: values[name] for name in model.inputs}
    lengths = [len(run.time) for run in runs]
    simulated = shooting.states(vector, shooting.starts)
    unweighted = unrolled(shooting.cut, shooting.cut.measured - simulated, sum(lengths))
    return Identified(
        replace(model),
        hull,
        inputs,
        dict(zip(names, np.sqrt(np.diag(matrix)).tolist(), strict=True)),
        correlation,
        tuple(held.items()),
        (*_unstable(shooting.length, window), *uncertainty.strong_correlations(names, correlation)),
        tuple(np.split(unweighted, np.cumsum(lengths)[:-1])),
        np.where(np.isfinite(shooting.cut.measured).any(axis=(0, 1)), shooting.noise, np.nan),
        tuple(predict(hull, run, window, inputs) for run in runs),
        np.column_stack([simulated[:, :, 3:].min(axis=(0, 1)), simulated[:, :, 3:].max(axis=(0, 1))]),
    )


def _unstable(length: float, window: float) -> list[str]:
    """A sentence about windows that were shortened."""
    if length == window:
        return []
    return [
        f"this hull turns a small error into a large one within {window:g} s, as one that does not keep its course: it was"
        f" identified over windows of {length:g} s, and even true hull data fail to predict some windows of {window:g} s"
    ]
