"""The arrays of one run, however they came about: offline loop, recorded nodes or replay."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.laws import Terms

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Run:
    """What happened in a run, one row for each odometry message.

    Attributes:
        time: s since the first odometry message, (n,).
        state: x, y, psi, u, v, r as published, (n, 6); the heading in [-pi, pi].
        reference: The same of the virtual ship, (n, 6).
        wrench: Applied surge force [N] and yaw moment [N·m], (n, 2).
        disturbance: Disturbing accelerations, (n, 3), m/s², m/s², rad/s².
        control: What the law computed, by the field names of ControlState.msg, one row for each control period;
            `time` among them, s.
    """

    time: Array
    state: Array
    reference: Array
    wrench: Array
    disturbance: Array
    control: dict[str, Array] = field(default_factory=dict)

    @classmethod
    def from_rows(cls, rows: Array, terms: Sequence[tuple[float, Terms]]) -> "Run":
        """From rows of time, state, reference, wrench and disturbance, and the law's terms with their times."""
        control = {"time": np.array([time for time, _ in terms])}
        for name in Terms._fields:
            control[name] = np.array([getattr(term, name) for _, term in terms])
        return cls(rows[:, 0], rows[:, 1:7], rows[:, 7:13], rows[:, 13:15], rows[:, 15:18], control)
