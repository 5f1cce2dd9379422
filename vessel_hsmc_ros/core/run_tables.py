"""The quantities of a run as named columns, the same for CSV, Parquet and pandas; docs/report.md lists them.

Columns are in SI units and radians. Quantities that were not recorded have no column.
"""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.metrics import body_error, heading_error, position_error

if TYPE_CHECKING:
    from vessel_hsmc_ros.core.run_data import Run

Array = NDArray[Any]
Table = dict[str, Array]

MOTION = ("x", "y", "heading", "surge_velocity", "sway_velocity", "yaw_rate")
WRENCH = ("surge_force", "yaw_moment")
ACCELERATION = ("surge_acceleration", "sway_acceleration", "yaw_acceleration")
PAPER_ERRORS = {"surge_error": "paper_z1e", "sway_error": "paper_z2e", "heading_error": "paper_z3e"}
"""Columns of z_e (11): the names in ControlState.msg would be taken for errors in the body frame, which they are not."""


def motion(run: "Run") -> Table:
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


def control(run: "Run") -> Table:
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

    Args:
        times: Sample times in any order, (n,).
        values: (n,) or (n, k).
        at: Times to evaluate at, (m,), in the unit of `times`.

    Returns:
        (m,) or (m, k).
    """
    if np.array_equal(times, at):
        return values
    order = np.argsort(times, kind="stable")  # stable: of equal times the last sample counts
    latest = np.searchsorted(times[order], at, side="right") - 1
    found: Array = values[order[np.clip(latest, 0, None)]]
    return found


def commanded(run: "Run") -> tuple[Array, Array] | None:
    """Times and values of the commanded wrench, (m,) and (m, 2); None where it was not recorded."""
    values = run.control.get("commanded")
    return None if values is None or not recorded(values) else (run.control["time"], values)
