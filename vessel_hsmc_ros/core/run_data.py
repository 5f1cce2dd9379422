"""The arrays of one run, however they came about: offline loop, recorded nodes or replay."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


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
