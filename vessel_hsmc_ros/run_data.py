"""The arrays of one run, however they came about: offline loop, recorded nodes or replay."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.laws import Terms

Array = NDArray[np.float64]

WIDTHS = (1, 6, 6, 6, 2, 3, 3)
"""Columns of time, state, measured, reference, wrench, disturbance and unforced acceleration."""


@dataclass(frozen=True)
class Run:
    """What happened in a run, one row for each odometry message.

    Attributes:
        time: s since the first odometry message, (n,).
        state: x, y, psi, u, v, r as they are, (n, 6); the heading in [-pi, pi].
        measured: The same as the odometry said, (n, 6); equal to the state where the sensors are perfect.
        reference: The same of the virtual ship, (n, 6).
        wrench: Applied surge force [N] and yaw moment [N·m], (n, 2).
        disturbance: Disturbing accelerations, (n, 3), m/s², m/s², rad/s².
        unforced_acceleration: f_u, f_v, f_r as they are, (n, 3), m/s², m/s², rad/s²; NaN where nobody knows them.
        control: What the law computed, by the field names of ControlState.msg, one row for each control period;
            `time` among them, s, and where there is an observer `estimate`, its x, y, psi, u, v, r, (m, 6).
    """

    time: Array
    state: Array
    measured: Array
    reference: Array
    wrench: Array
    disturbance: Array
    unforced_acceleration: Array
    control: dict[str, Array] = field(default_factory=dict)

    @classmethod
    def from_rows(cls, rows: Array, terms: Sequence[tuple[float, Terms]], estimates: Sequence[Array] = ()) -> "Run":
        """From rows of a run's arrays side by side, WIDTHS columns each, the law's terms with their times, and estimates."""
        control = {"time": np.array([time for time, _ in terms])}
        for name in Terms._fields:
            control[name] = np.array([getattr(term, name) for _, term in terms])
        if estimates:
            control["estimate"] = np.array(estimates)
        time, state, measured, reference, wrench, disturbance, unforced = np.split(rows, np.cumsum(WIDTHS)[:-1], axis=1)
        return cls(time[:, 0], state, measured, reference, wrench, disturbance, unforced, control)
