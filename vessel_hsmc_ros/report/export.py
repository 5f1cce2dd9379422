"""Export of a run as tables for other programs: CSV, or Parquet if pyarrow is installed."""

import csv
from collections.abc import Callable
from pathlib import Path

from vessel_hsmc_ros.core.exceptions import ReportError
from vessel_hsmc_ros.core.run_data import Run, Table, control_table, motion_table

ROWS = 10_000
"""Rows that are converted to Python numbers at a time: those of a long run would not fit into memory."""


def tables(run: Run) -> dict[str, Table]:
    """The tables of a run: `motion` with a row for each state, `control` with a row for each update of the law.

    Columns are in SI units and radians. Quantities that were not recorded have no column.
    """
    found = {"motion": motion_table(run), "control": control_table(run)}
    return {name: table for name, table in found.items() if len(table) > 1}


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
