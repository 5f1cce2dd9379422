"""The arrays of one run, whether from the offline loop or from a bag."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core import run_tables
from vessel_hsmc_ros.core.exceptions import InstallationError

if TYPE_CHECKING:
    from pandas import DataFrame

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]


@dataclass(frozen=True)
class Run:
    """The time series of a run, one row per odometry message.

    Attributes:
        time: Time since the first odometry message, (n,) s.
        state: True x, y, psi, u, v, r of the ship, (n, 6); the heading in [-pi, pi].
        measured: x, y, psi, u, v, r as odometry shows them at the time, late or not, (n, 6); equal to the state where the
            sensors are perfect.
        reference: x, y, psi, u, v, r of the reference, (n, 6).
        wrench: Applied surge force [N] and yaw moment [N·m], (n, 2).
        disturbance: Disturbing accelerations, (n, 3), m/s², m/s², rad/s².
        unforced_acceleration: True f_u, f_v, f_r of (7), (n, 3), m/s², m/s², rad/s²; NaN where they are not recorded.
        control: Terms of the law by the field names of ControlState.msg, with one row per control period. Three more are
            `time`, (m,) s, `commanded`, the commanded wrench, (m, 2), and, where there is an observer, `estimate`, its
            x, y, psi, u, v, r, (m, 6). Weights are (m, k), NaN where the law was not computed.
    """

    time: Array
    state: Array
    measured: Array
    reference: Array
    wrench: Array
    disturbance: Array
    unforced_acceleration: Array
    control: dict[str, Array] = field(default_factory=dict)

    def to_dataframe(self) -> "DataFrame":
        """The motion as a pandas data frame, a row for each odometry message, indexed by time.

        Raises:
            InstallationError: pandas is not installed.
        """
        return _data_frame(run_tables.motion(self))

    def control_dataframe(self) -> "DataFrame":
        """The terms of the law as a pandas data frame, a row for each of its updates, indexed by time.

        Raises:
            InstallationError: pandas is not installed.
        """
        return _data_frame(run_tables.control(self))


def _data_frame(table: Mapping[str, Array]) -> "DataFrame":
    """Columns as a data frame with the index `time`, s."""
    try:
        from pandas import DataFrame
    except ModuleNotFoundError:
        raise InstallationError("data frames need pandas, which is not installed: pip install pandas") from None
    return DataFrame({"time": np.empty(0), **table}).set_index("time")


@dataclass(frozen=True)
class Published:
    """The content of all messages that plant, reference ship and controller publish in a run, unrounded and not wrapped.

    Attributes:
        stamp: Of the plant's other messages and of the commands, (n,) ns.
        measured_at: Of the odometry, (n,) ns: the times of its measurements.
        odometry: Measured x, y, psi, u, v, r, (n, 6).
        truth: The true ones, (n, 6); None where the sensors are perfect.
        command: Surge force [N] and yaw moment [N·m] of the controller, (n, 2).
        applied: Surge force, sway force [N] and yaw moment [N·m] of the actuators, (n, 3).
        disturbance: Surge and sway force [N] and yaw moment [N·m], (n, 3).
        unforced_acceleration: f_u, f_v, f_r of (7), (n, 3), m/s², m/s², rad/s².
        reference_stamp: Of the reference, (m,) ns.
        reference, reference_acceleration: Its x, y, psi, u, v, r, (m, 6), and accelerations, (m, 3).
        control_stamp: Of the updates of the law, (k,) ns.
        control: Its terms by the field names of ControlState.msg, k rows each.
        estimate: x, y, psi, u, v, r of the observer, (k, 6); None without one.
    """

    stamp: Stamps
    measured_at: Stamps
    odometry: Array
    truth: Array | None
    command: Array
    applied: Array
    disturbance: Array
    unforced_acceleration: Array
    reference_stamp: Stamps
    reference: Array
    reference_acceleration: Array
    control_stamp: Stamps
    control: Mapping[str, Array]
    estimate: Array | None
