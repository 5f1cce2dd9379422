"""Identification as a whole: smoothing, regression, output-error refinement, uncertainties."""

from collections.abc import Callable, Mapping, Sequence

from vessel_hsmc_ros.identification.types import Identified, Measurements, Model, Prediction
from vessel_sim_node.plant import VesselParameters

WINDOW = 20.0
"""Default length of a window, s."""

Progress = Callable[[str, float], None]
"""Called with what is being done and how much of it is done, 0 to 1."""


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
        IdentificationError: the runs are too short or say nothing about the ship.
    """
    raise NotImplementedError


def predict(
    values: Mapping[str, float], measurements: Measurements, window: float = WINDOW, inputs: Mapping[str, float] | None = None
) -> Prediction:
    """Predict a run window by window, each from the smoothed state at its start.

    Args:
        values: Hull parameters by their names; those that are missing are zero.
        measurements: The run, best one that the values were not estimated from.
        window: Length of a window, s.
        inputs: Input gains and offsets; None for gains of one and offsets of zero.
    """
    raise NotImplementedError
