"""The arrays of one run, whether from the offline loop or from a bag, and as tables: named columns for CSV, Parquet and pandas.

The columns of tables are in SI units and radians; docs/report.md lists them. Quantities that were not recorded have no column.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.exceptions import InstallationError
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.metrics import body_error, heading_error, position_error

if TYPE_CHECKING:
    from pandas import DataFrame


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
        return _data_frame(motion_table(self))

    def control_dataframe(self) -> "DataFrame":
        """The terms of the law as a pandas data frame, a row for each of its updates, indexed by time.

        Raises:
            InstallationError: pandas is not installed.
        """
        return _data_frame(control_table(self))


def _data_frame(table: Mapping[str, Array]) -> "DataFrame":
    """Columns as a data frame with the index `time`, s."""
    try:
        from pandas import DataFrame
    except ModuleNotFoundError:
        raise InstallationError("data frames need pandas, which is not installed: pip install pandas") from None
    return DataFrame({"time": np.empty(0), **table}).set_index("time")


@dataclass(frozen=True)
class Published:
    """The content of all messages that plant, reference ship and controller publish in a run, unrounded and not wrapped."""

    stamp: Stamps  # of the plant's other messages and of the commands, (n,) ns
    measured_at: Stamps  # of the odometry, (n,) ns: the times of its measurements
    odometry: Array  # measured x, y, psi, u, v, r, (n, 6)
    truth: Array | None  # the true ones, (n, 6); None where the sensors are perfect
    command: Array  # surge force [N] and yaw moment [N·m] of the controller, (n, 2)
    applied: Array  # surge force, sway force [N] and yaw moment [N·m] of the actuators, (n, 3)
    disturbance: Array  # surge and sway force [N] and yaw moment [N·m], (n, 3)
    unforced_acceleration: Array  # f_u, f_v, f_r of (7), (n, 3), m/s², m/s², rad/s²
    reference_stamp: Stamps  # of the reference, (m,) ns
    # reference, reference_acceleration: its x, y, psi, u, v, r, (m, 6), and accelerations, (m, 3)
    reference: Array
    reference_acceleration: Array
    control_stamp: Stamps  # of the updates of the law, (k,) ns
    control: Mapping[str, Array]  # its terms by the field names of ControlState.msg, k rows each
    estimate: Array | None  # x, y, psi, u, v, r of the observer, (k, 6); None without one


Table = dict[str, NDArray[Any]]

MOTION = ("x", "y", "heading", "surge_velocity", "sway_velocity", "yaw_rate")
WRENCH = ("surge_force", "yaw_moment")
ACCELERATION = ("surge_acceleration", "sway_acceleration", "yaw_acceleration")
PAPER_ERRORS = {"surge_error": "paper_z1e", "sway_error": "paper_z2e", "heading_error": "paper_z3e"}
"""Columns of z_e (11): the names in ControlState.msg would be taken for errors in the body frame, which they are not."""


def motion_table(run: Run) -> Table:
    """A row for each state: time, state, measurement, reference, wrenches, accelerations, errors."""
    command = commanded(run)
    # Without sensor noise the measurements are the states: a second set of columns would only repeat them.
    noisy = not np.array_equal(run.measured, run.state)
    groups = (
        ("measured_", MOTION, run.measured if noisy else None),
        ("reference_", MOTION, run.reference),
        ("", WRENCH, run.wrench),
        ("commanded_", WRENCH, held(*command, run.time) if command else None),
        ("disturbance_", ACCELERATION, run.disturbance),
        ("unforced_", ACCELERATION, run.unforced_acceleration),
    )
    table: Table = {"time": run.time, **_columns("", MOTION, run.state)}
    for prefix, names, values in groups:
        if values is not None and recorded(values):
            table |= _columns(prefix, names, values)
    if recorded(run.reference):
        table["position_error"] = position_error(run.state, run.reference)
        table |= _columns("body_error_", ("x", "y"), body_error(run.state, run.reference))
        table["heading_error"] = heading_error(run.state, run.reference)
    return table


def control_table(run: Run) -> Table:
    """A row for each update of the law: the terms that it computes, but for the network weights, and the observer's estimate."""
    table: Table = {}
    for name, values in run.control.items():
        if name == "estimate":
            table |= _columns("estimated_", MOTION, values)
        elif values.ndim == 1 and recorded(values):
            error = name.removesuffix("_rate")
            table[PAPER_ERRORS.get(error, error) + name.removeprefix(error)] = values
    return table


def _columns(prefix: str, names: tuple[str, ...], values: Array) -> Table:
    return {prefix + name: column for name, column in zip(names, values.T, strict=True)}


def recorded(values: Array | None) -> bool:
    """Whether a quantity of a run was recorded, that is, contains anything but NaN."""
    return values is not None and bool(len(values)) and not np.isnan(values).all()


def held(times: Array, values: Array, at: Array) -> Array:
    """Sample-and-hold: the latest value at each of some times, the first value before that.

    `times`: sample times in any order, (n,). `values`: (n,) or (n, k). `at`: times to evaluate at, (m,), in the unit of
    `times`. Returns (m,) or (m, k).
    """
    if np.array_equal(times, at):
        return values
    order = np.argsort(times, kind="stable")  # stable: of equal times the last sample counts
    latest = np.searchsorted(times[order], at, side="right") - 1
    found: Array = values[order[np.clip(latest, 0, None)]]
    return found


def commanded(run: Run) -> tuple[Array, Array] | None:
    """Times and values of the commanded wrench, (m,) and (m, 2); None where it was not recorded."""
    values = run.control.get("commanded")
    return None if values is None or not recorded(values) else (run.control["time"], values)
