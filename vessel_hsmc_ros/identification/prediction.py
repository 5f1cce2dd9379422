"""Predicts a recorded run window by window, and compares with what was measured."""

from collections.abc import Mapping

import numpy as np

from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.exceptions import IdentificationError
from vessel_hsmc_ros.identification.parameter_vector import inputs as inputs_of
from vessel_hsmc_ros.identification.parameter_vector import vessel
from vessel_hsmc_ros.identification.smoothing import smooth
from vessel_hsmc_ros.identification.types import Measurements, Prediction
from vessel_hsmc_ros.identification.windows import simulated, unrolled, windows

WINDOW = 20.0
"""Default length of a window, s."""


def predict(
    values: Mapping[str, float], measurements: Measurements, window: float = WINDOW, inputs: Mapping[str, float] | None = None
) -> Prediction:
    """Predict a run window by window, each from the smoothed state at its start.

    Args:
        values: Hull parameters by their names; those that are missing are zero.
        measurements: The run, best one that the values were not estimated from.
        window: Length of a window, s; what is left at the end of the run is not predicted.
        inputs: Input gains and offsets; None for gains of one and offsets of zero.

    Raises:
        IdentificationError: the run is shorter than a window.
    """
    duration = float(measurements.time[-1] - measurements.time[0])
    if duration < window:
        raise IdentificationError(
            f"{measurements.name} lasts {duration:.1f} s: a prediction takes at least one window of {window:g} s"
        )
    smoothed = smooth(measurements)
    cut = windows([measurements], window, exact=True)
    parts = simulated(cut, smoothed.states[cut.begin], vessel(values), *inputs_of(inputs or {}))
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
