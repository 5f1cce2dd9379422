"""The arrays of one run, whether from the offline loop or from a bag."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Run:
    """The time series of a run, one row per odometry message.

    Attributes:
        time: Time since the first odometry message, (n,) s.
        state: True x, y, psi, u, v, r of the ship, (n, 6); the heading in [-pi, pi].
        measured: Measured x, y, psi, u, v, r, (n, 6); equal to the state where the sensors are perfect.
        reference: x, y, psi, u, v, r of the reference, (n, 6).
        wrench: Applied surge force [N] and yaw moment [N·m], (n, 2).
        disturbance: Disturbing accelerations, (n, 3), m/s², m/s², rad/s².
        unforced_acceleration: True f_u, f_v, f_r of (7), (n, 3), m/s², m/s², rad/s²; NaN where they are not recorded.
        control: Terms of the law by the field names of ControlState.msg, with one row per control period. Two more are
            `time`, (m,) s, and, where there is an observer, `estimate`, its x, y, psi, u, v, r, (m, 6).
    """

    time: Array
    state: Array
    measured: Array
    reference: Array
    wrench: Array
    disturbance: Array
    unforced_acceleration: Array
    control: dict[str, Array] = field(default_factory=dict)
