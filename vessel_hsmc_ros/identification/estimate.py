"""Identification as a whole: smoothing, refinements, uncertainties, warnings."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vessel_hsmc_ros.core.exceptions import IdentificationError
from vessel_hsmc_ros.identification import uncertainty
from vessel_hsmc_ros.identification.checks import checked, few_reversals
from vessel_hsmc_ros.identification.models import DELAY
from vessel_hsmc_ros.identification.parameter_vector import HULL, unknowns
from vessel_hsmc_ros.identification.prediction import WINDOW, predict
from vessel_hsmc_ros.identification.refinement import Shooting
from vessel_hsmc_ros.identification.smoothing import smooth
from vessel_hsmc_ros.identification.stages import Fit, Progress, covariance, largest, refined
from vessel_hsmc_ros.identification.types import Identified, Measurements, Model
from vessel_hsmc_ros.identification.windows import unrolled
from vessel_hsmc_ros.plant.dynamics import VesselParameters

UNEXPLAINED = 1.3
"""Residuals from which on a warning is given, in units of the noise of the sensors."""
COLUMNS = ("x", "y", "heading", "surge velocity", "sway velocity", "yaw rate")


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
    fit = refined(given, smoothed, unknowns(model, start), window, progress)
    progress("standard errors", 0.95)
    return _result(given, model, fit, window)


def _result(runs: list[Measurements], model: Model, fit: Fit, window: float) -> Identified:
    """The estimates with their standard errors, residuals and predictions."""
    _, shooting, vector, held = fit
    names, values = shooting.unknowns.names, shooting.unknowns.values(vector)
    matrix = covariance(fit)
    shooting.residuals(vector)
    correlation = uncertainty.correlations(matrix)
    errors = dict(zip(names, np.sqrt(np.diag(matrix)).tolist(), strict=True))
    reported = [index for index, name in enumerate(names) if name != DELAY]
    hull = {name: values[name] for name in HULL}
    inputs = {name: values[name] for name in (*model.inputs, *(name for name in names if name == DELAY))}
    lengths = [len(run.time) for run in runs]
    simulated = shooting.states(vector, shooting.starts)
    unweighted = unrolled(shooting.cut, shooting.cut.measured - simulated, sum(lengths))
    return Identified(
        replace(model),
        hull,
        inputs,
        {names[index]: errors[names[index]] for index in reported},
        correlation[np.ix_(reported, reported)],
        tuple((name, why) for name, why in held.items() if name != DELAY),
        (
            *few_reversals(runs, names),
            *_unexplained(runs, shooting),
            *_unstable(shooting.length, window),
            *uncertainty.strong_correlations(names, correlation),
        ),
        tuple(np.split(unweighted, np.cumsum(lengths)[:-1])),
        np.where(np.isfinite(shooting.cut.measured).any(axis=(0, 1)), shooting.noise, np.nan),
        tuple(predict(hull, run, window, inputs) for run in runs),
        np.column_stack([simulated[:, :, 3:].min(axis=(0, 1)), simulated[:, :, 3:].max(axis=(0, 1))]),
    )


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
