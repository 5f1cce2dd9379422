"""A run as tables for other programs: CSV, or Parquet where pyarrow is installed."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.exceptions import ReportError
from vessel_hsmc_ros.core.metrics import heading_error, position_error
from vessel_hsmc_ros.report.signals import Signals

Array = NDArray[np.float64]
Table = dict[str, Array]

MOTION = ("x", "y", "heading", "surge_velocity", "sway_velocity", "yaw_rate")
WRENCH = ("surge_force", "yaw_moment")
ACCELERATION = ("surge_acceleration", "sway_acceleration", "yaw_acceleration")
COLUMNS = (
    ("measured", "measured_", MOTION),
    ("reference", "reference_", MOTION),
    ("wrench", "", WRENCH),
    ("commanded", "commanded_", WRENCH),
    ("disturbance", "disturbance_", ACCELERATION),
    ("unforced", "unforced_", ACCELERATION),
)
ROWS = 10_000
"""Rows that are turned into text at a time."""


def tables(signals: Signals) -> dict[str, Table]:
    """`motion`, a row for each state, and `control`, a row for each update of the law; SI units and radians.

    What has other times than the state is held until its next sample.
    """
    time, state = signals.state
    motion: Table = {"time": time, **dict(zip(MOTION, state.T, strict=True))}
    for name, prefix, columns in COLUMNS:
        signal = getattr(signals, name)
        if signal is not None:
            motion |= {prefix + column: values for column, values in zip(columns, signal.at(time).T, strict=True)}
    if signals.reference is not None:
        desired = signals.reference.at(time)
        motion |= {"position_error": position_error(state, desired), "heading_error": heading_error(state, desired)}
    return {"motion": motion, "control": _control(signals)} if signals.control else {"motion": motion}


def _control(signals: Signals) -> Table:
    """The law's own terms but for the weights, and what an observer made of the measurements."""
    columns: Table = {"time": next(iter(signals.control.values())).time}
    for name, signal in signals.control.items():
        if name == "estimate":
            columns |= {f"estimated_{column}": values for column, values in zip(MOTION, signal.values.T, strict=True)}
        elif signal.values.ndim == 1:
            columns[name] = signal.values
    return columns


def write_csv(signals: Signals, directory: Path) -> list[Path]:
    """Write `motion.csv` and `control.csv`; every number reads back as the same bits.

    Raises:
        ReportError: a file cannot be written.
    """

    def write(table: Table, path: Path) -> None:
        with path.open("w", encoding="utf-8") as stream:
            stream.write(",".join(table) + "\n")
            stream.writelines(_lines(table))

    return _write(signals, directory, "csv", write)


def write_parquet(signals: Signals, directory: Path) -> list[Path]:
    """Write `motion.parquet` and `control.parquet`.

    Raises:
        ReportError: pyarrow is not installed, or a file cannot be written.
    """
    try:
        import pyarrow
        from pyarrow import parquet
    except ModuleNotFoundError:
        raise ReportError("Parquet needs pyarrow, which is not installed: pip install pyarrow, or take --csv") from None
    return _write(signals, directory, "parquet", lambda table, path: parquet.write_table(pyarrow.table(table), path))


def _write(signals: Signals, directory: Path, kind: str, write: Callable[[Table, Path], None]) -> list[Path]:
    paths = []
    try:
        directory.mkdir(parents=True, exist_ok=True)
        for name, table in tables(signals).items():
            paths.append(directory / f"{name}.{kind}")
            write(table, paths[-1])
    except OSError as error:
        raise ReportError(f"tables in {directory} cannot be written: {error.strerror}") from None
    return paths


def _lines(table: Table) -> Iterator[str]:
    columns = list(table.values())
    for first in range(0, len(columns[0]), ROWS):
        part = [column[first : first + ROWS].tolist() for column in columns]
        yield from (",".join(map(_text, row)) + "\n" for row in zip(*part, strict=True))


def _text(value: float | bool) -> str:
    return repr(value) if value is not True and value is not False else str(int(value))
