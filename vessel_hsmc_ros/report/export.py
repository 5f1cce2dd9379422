"""Export of a run as tables for other programs: CSV, or Parquet if pyarrow is installed."""

import csv
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.exceptions import ReportError
from vessel_hsmc_ros.core.metrics import body_error, heading_error, position_error
from vessel_hsmc_ros.core.run_data import Run
from vessel_hsmc_ros.report.record import commanded, held, recorded

Array = NDArray[np.float64]
Table = dict[str, Array]

MOTION = ("x", "y", "heading", "surge_velocity", "sway_velocity", "yaw_rate")
WRENCH = ("surge_force", "yaw_moment")
ACCELERATION = ("surge_acceleration", "sway_acceleration", "yaw_acceleration")
PAPER_ERRORS = {"surge_error": "paper_z1e", "sway_error": "paper_z2e", "heading_error": "paper_z3e"}
"""Columns of z_e (11): the names in ControlState.msg would be taken for errors in the body frame, which they are not."""
ROWS = 10_000
"""Rows that are converted to Python numbers at a time: those of a long run would not fit into memory."""


def tables(run: Run) -> dict[str, Table]:
    """The tables of a run: `motion` with a row for each state, `control` with a row for each update of the law.

    Columns are in SI units and radians. Quantities that were not recorded have no column.
    """
    control = _control(run)
    return {"motion": _motion(run), "control": control} if len(control) > 1 else {"motion": _motion(run)}


def _motion(run: Run) -> Table:
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


def _control(run: Run) -> Table:
    """The terms of the law that it computes, except for the network weights, and the estimate of the observer."""
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


def write_csv(run: Run, directory: Path) -> list[Path]:
    """Write `motion.csv` and `control.csv`; every number reads back bit-identical.

    Raises:
        ReportError: a file cannot be written.
    """

    def write(table: Table, path: Path) -> None:
        # Flags as 0 and 1: True and False are not numbers to most programs that read CSV.
        columns = [values.astype(int) if values.dtype == bool else values for values in table.values()]
        with path.open("w", encoding="utf-8", newline="") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(table)
            for first in range(0, len(columns[0]), ROWS):
                writer.writerows(zip(*(column[first : first + ROWS].tolist() for column in columns), strict=True))

    return _write(run, directory, "csv", write)


def write_parquet(run: Run, directory: Path) -> list[Path]:
    """Write `motion.parquet` and `control.parquet`.

    Raises:
        ReportError: pyarrow is not installed, or a file cannot be written.
    """
    try:
        import pyarrow
        from pyarrow import parquet
    except ModuleNotFoundError:
        raise ReportError("Parquet needs pyarrow, which is not installed: pip install pyarrow, or take --csv") from None
    return _write(run, directory, "parquet", lambda table, path: parquet.write_table(pyarrow.table(table), path))


def _write(run: Run, directory: Path, kind: str, write: Callable[[Table, Path], None]) -> list[Path]:
    paths = []
    try:
        directory.mkdir(parents=True, exist_ok=True)
        for name, table in tables(run).items():
            paths.append(directory / f"{name}.{kind}")
            write(table, paths[-1])
    except OSError as error:
        raise ReportError(f"tables in {directory} cannot be written: {error.strerror}") from None
    return paths
