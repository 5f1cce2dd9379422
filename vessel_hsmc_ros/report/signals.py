"""What a report shows of one run, as plain arrays; a simulated run and a recorded one fill it alike."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.run_data import Run

Array = NDArray[np.float64]


class Signal(NamedTuple):
    """Samples over time.

    Attributes:
        time: s since the start of the run, (n,), never falling.
        values: (n,) or (n, k).
    """

    time: Array
    values: Array

    def at(self, time: Array) -> Array:
        """The last values not after each of the times, the first ones before that; (len(time),) or (len(time), k)."""
        if self.time is time or np.array_equal(self.time, time):
            return self.values
        held: Array = self.values[np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, None)]
        return held


@dataclass(frozen=True)
class Signals:
    """The signals of a run; what was not recorded is None.

    Attributes:
        state: x, y, psi, u, v, r of the ship, (n, 6), the truth where it is known.
        measured: The same as the sensors said, where that is something else, (n, 6).
        reference: The same of the virtual ship, (n, 6).
        wrench: Applied surge force [N] and yaw moment [N·m], (n, 2).
        commanded: What the controller asked for, (n, 2).
        disturbance: Disturbing accelerations, m/s², m/s², rad/s², (n, 3).
        unforced: The ship's own accelerations f_u, f_v, f_r, in the same units, (n, 3).
        control: What the law computed, by the field names of ControlState.msg, (n,) or (n, k) each.
    """

    state: Signal
    measured: Signal | None = None
    reference: Signal | None = None
    wrench: Signal | None = None
    commanded: Signal | None = None
    disturbance: Signal | None = None
    unforced: Signal | None = None
    control: Mapping[str, Signal] = field(default_factory=dict)

    @property
    def duration(self) -> float:
        """Time from the first to the last state, s."""
        return float(self.state.time[-1] - self.state.time[0])


def of_run(run: Run) -> Signals:
    """The signals of a run's arrays."""

    def signal(name: str) -> Signal | None:
        values = getattr(run, name)
        return None if np.isnan(values).all() else Signal(run.time, values)

    times = run.control.get("time", np.empty(0))
    control = {name: Signal(times, values) for name, values in run.control.items() if name != "time" and len(times)}
    perfect = np.array_equal(run.measured, run.state)
    return Signals(
        state=Signal(run.time, run.state),
        measured=None if perfect else signal("measured"),
        reference=signal("reference"),
        wrench=signal("wrench"),
        disturbance=signal("disturbance"),
        unforced=signal("unforced_acceleration"),
        control=control,
    )
