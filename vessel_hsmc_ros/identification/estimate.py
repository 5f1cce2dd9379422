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
from vessel_hsmc_ros.identification.regression import natural_scale, regress
from vessel_hsmc_ros.identification.smoothing import Smoothed, smooth
from vessel_hsmc_ros.identification.types import Array, Identified, Measurements, Model
from vessel_hsmc_ros.identification.windows import windows
from vessel_sim_node.plant import VesselParameters

Progress = Callable[[str, float], None]
"""Called with what is being done and how much of it is done, 0 to 1."""

NEVER_HELD = (*POSITIVE, *GAINS, *OFFSETS)
PASSES = 2
"""Refinements: the first shows which parameters the runs do not determine and how large the noise is."""


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
    """Regression and refinements; parameters that the runs do not determine are held after the first one."""
    progress("regression", 0.02)
    data = list(zip(runs, smoothed, strict=True))
    held: dict[str, str] = {}
    states = np.concatenate([each.states for each in smoothed])
    cut = windows(runs, window)
    # The worst sensor of a column counts; a perfect one gets the rounding of a millionth of the motion.
    noise = np.fmax(np.nanmax([each.noise for each in smoothed], axis=0), 1e-6 * np.maximum(np.ptp(states, axis=0), 1e-6))
    noise = np.where(np.isfinite(noise), noise, 1.0)
    shooting = Shooting(free, cut, states[cut.first[:, 0]], noise)
    vector = regress(free, data)
    for number in range(PASSES):
        shooting.scale = natural_scale(shooting.unknowns, data)
        vector = refine(shooting, vector, _reporting(progress, number))
        residuals = shooting.residuals(vector)
        size = np.sqrt(np.mean(np.square(residuals), axis=0))
        shooting.noise = shooting.noise * np.where(size > 0.0, size, 1.0)
        if number < PASSES - 1:
            new = _to_hold(shooting, vector)
            held |= new
            fixed = {name: shooting.unknowns.fixed.get(name, 0.0) for name in new}
            keep = [name not in new for name in shooting.unknowns.names]
            shooting.unknowns, vector = shooting.unknowns.without(fixed), vector[keep]
    shooting.scale = natural_scale(shooting.unknowns, data)
    return shooting, vector, held


def _reporting(progress: Progress, number: int) -> Callable[[int], None]:
    """Progress of one refinement by its iterations, of which there are some five to ten."""
    return lambda k: progress(f"refinement {number + 1}, iteration {k}", 0.05 + 0.45 * (number + k / (k + 5.0)))


def _to_hold(shooting: Shooting, vector: Array) -> dict[str, str]:
    """Parameters that the runs do not determine, with the reasons."""
    names, jacobian = shooting.unknowns.names, shooting.jacobian(vector)
    found = uncertainty.indistinguishable(names, jacobian, shooting.scale)
    missing = [name for name in found if name in NEVER_HELD]
    if missing:
        raise IdentificationError(
            f"the runs do not determine {missing[0]}: {found[missing[0]]}; excite it, or give it by a start vessel"
        )
    rest = [index for index, name in enumerate(names) if name not in found]
    matrix = uncertainty.covariance(shooting.cut, shooting.residuals(vector), jacobian[:, :, rest])
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
    missing = np.where(np.isfinite(shooting.cut.measured), 0.0, np.nan)
    unweighted = residuals * shooting.noise + missing
    ends = np.cumsum([len(run.time) for run in runs])[:-1]
    simulated = shooting.states(vector, shooting.starts)
    return Identified(
        replace(model),
        hull,
        inputs,
        dict(zip(names, np.sqrt(np.diag(matrix)).tolist(), strict=True)),
        correlation,
        tuple(held.items()),
        tuple(uncertainty.strong_correlations(names, correlation)),
        tuple(np.split(unweighted, ends)),
        np.sqrt(np.nanmean(np.square(unweighted), axis=0)) if len(runs) else np.zeros(6),
        tuple(predict(hull, run, window, inputs) for run in runs),
        np.column_stack([simulated[:, 3:].min(axis=0), simulated[:, 3:].max(axis=0)]),
    )
