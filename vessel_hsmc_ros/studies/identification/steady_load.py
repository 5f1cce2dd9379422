"""The steady load that would explain why a run is predicted badly: a wind or a current that the other runs did not have.

    min over L of the sum over the windows of |p(L) - p_measured|², by Gauss-Newton steps from L = 0

p(L) are the predicted positions with a constant force in the earth frame beside the recorded wrench, or in a constant current.
"""

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.studies.identification.types import Measurements, Prediction
from vessel_hsmc_ros.studies.identification.windows import predict

COMPONENTS = ("force_x", "force_y")

PROBE_SHARE = 0.01  # load by which the linearisation is made, as a share of the rms surge force or the rms speed of the run
ITERATIONS = 4  # largest number of Gauss-Newton steps: drag is not linear in the current
EXPLAINED = 0.5  # a load explains a run if it reduces the position error to this share or less


class SteadyLoad(NamedTuple):
    """A steady force or a steady current in the earth frame."""

    kind: str  # `force` or `current`
    # x, y: its components, N or m/s
    x: float
    y: float
    # before, after: rms position errors of the prediction without and with it, m
    before: float
    after: float

    @property
    def explains(self) -> bool:
        """Whether the prediction with it is much better."""
        return self.after <= EXPLAINED * self.before

    def sentence(self, run: str) -> str:
        """What the load means for a run, in words."""
        before, after = quantity(self.before, "m"), quantity(self.after, "m")
        if not self.explains:
            return f"{run}: no steady force or current explains the position error of {before} (the best leaves {after})"
        unit, remedy = ("N", ": look for wind that the other runs did not have") if self.kind == "force" else ("m/s", "")
        size = towards(self.x, self.y, unit)
        return f"{run}: a steady {self.kind} of {size} from x explains the position error of {before} ({after} with it){remedy}"


def towards(x: float, y: float, unit: str) -> str:
    """Size and direction of a horizontal vector, such as `0.3 m/s towards 90°`."""
    return f"{quantity(math.hypot(x, y), unit)} towards {round(math.degrees(math.atan2(y, x)))}°"


def steady_load(values: Mapping[str, float], run: Measurements, window: float, inputs: Mapping[str, float]) -> SteadyLoad:
    """Find the steady force or the steady current with which a run is predicted best, whichever predicts it better.

    `run`: the run, which the values were not estimated from. Raises IdentificationError if the run is shorter than a window.
    """

    def pushed(x: float, y: float) -> Prediction:
        added = {name: inputs.get(name, 0.0) + more for name, more in zip(COMPONENTS, (x, y), strict=True)}
        return predict(values, run, window, {**inputs, **added})

    def drifting(x: float, y: float) -> Prediction:
        return predict(values, run, window, inputs, (x, y))

    plain = drifting(0.0, 0.0)
    speed = np.hypot(plain.measured[:, 3], plain.measured[:, 4])
    force, current = (
        _fitted(kind, predicted, PROBE_SHARE * float(np.sqrt(np.mean(np.square(size)))) or PROBE_SHARE, plain)
        for kind, predicted, size in (("force", pushed, run.wrench[:, 0]), ("current", drifting, speed))
    )
    return min(force, current, key=lambda load: load.after)


def _fitted(kind: str, predicted: Callable[[float, float], Prediction], probe: float, plain: Prediction) -> SteadyLoad:
    """The load of one kind that predicts best."""
    error = plain.rms()["position"]
    best, there = SteadyLoad(kind, 0.0, 0.0, error, error), plain
    for _ in range(ITERATIONS):
        base = _positions(there)
        probes = ((best.x + probe, best.y), (best.x, best.y + probe))
        slopes = np.column_stack([(_positions(predicted(*each)) - base) / probe for each in probes])
        residual = there.measured[:, :2].ravel() - base
        known = np.isfinite(residual) & np.isfinite(slopes).all(axis=1)
        x, y = np.linalg.lstsq(slopes[known], residual[known], rcond=None)[0].tolist()
        there = predicted(best.x + x, best.y + y)
        if not (after := there.rms()["position"]) < best.after:
            break
        best = SteadyLoad(kind, best.x + x, best.y + y, error, after)
    return best


def _positions(prediction: Prediction) -> Array:
    """Predicted x and y in one column; NaN outside the windows."""
    return prediction.simulated[:, :2].ravel()
