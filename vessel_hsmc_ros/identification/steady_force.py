"""The steady force that would explain why a run is predicted badly: wind or a current that the other runs did not have.

    min over F of the sum over the windows of |p(F) - p_measured|², with p(F) linearised about F = 0

p(F) are the predicted positions with a constant force F in the earth frame beside the recorded wrench.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.identification.types import Measurements, Prediction
from vessel_hsmc_ros.identification.windows import predict

COMPONENTS = ("force_x", "force_y")

PROBE_SHARE = 0.01
"""Force by which the linearisation is made, as a share of the rms surge force of the run."""

EXPLAINED = 0.5
"""A force explains a run if it reduces the position error to this share or less."""


class SteadyForce(NamedTuple):
    """A steady force in the earth frame.

    Attributes:
        east, north: Its components along x and y, N.
        before, after: Rms position errors of the prediction without and with it, m.
    """

    east: float
    north: float
    before: float
    after: float

    @property
    def explains(self) -> bool:
        """Whether the prediction with it is much better."""
        return self.after <= EXPLAINED * self.before

    def sentence(self, run: str) -> str:
        """What the force means for a run, in words."""
        before, after = quantity(self.before, "m"), quantity(self.after, "m")
        if not self.explains:
            return f"{run}: no steady force explains the position error of {before} (the best leaves {after})"
        force, bearing = quantity(math.hypot(self.east, self.north), "N"), math.degrees(math.atan2(self.north, self.east))
        return (
            f"{run}: a steady force of {force} towards {bearing:.0f}° from x would explain the position error of {before}"
            f" ({after} with it): look for wind or a current that the other runs did not have"
        )


def steady_force(values: Mapping[str, float], run: Measurements, window: float, inputs: Mapping[str, float]) -> SteadyForce:
    """Find the steady force with which a run is predicted best.

    Args:
        values: Hull parameters by their names.
        run: The run, which the values were not estimated from.
        window: Length of a window, s.
        inputs: Input gains and offsets that were identified.

    Raises:
        IdentificationError: the run is shorter than a window.
    """
    size = PROBE_SHARE * float(np.sqrt(np.mean(np.square(run.wrench[:, 0])))) or 1.0

    def predicted(east: float, north: float) -> Prediction:
        added = {name: inputs.get(name, 0.0) + more for name, more in zip(COMPONENTS, (east, north), strict=True)}
        return predict(values, run, window, {**inputs, **added})

    plain = predicted(0.0, 0.0)
    base = _positions(plain)
    slopes = np.column_stack([(_positions(predicted(*probe)) - base) / size for probe in ((size, 0.0), (0.0, size))])
    residual = plain.measured[:, :2].ravel() - base
    there = np.isfinite(residual)
    east, north = np.linalg.lstsq(slopes[there], residual[there], rcond=None)[0]
    return SteadyForce(float(east), float(north), plain.rms()["position"], predicted(east, north).rms()["position"])


def _positions(prediction: Prediction) -> Array:
    """Predicted x and y in one column; NaN outside the windows."""
    return prediction.simulated[:, :2].ravel()
