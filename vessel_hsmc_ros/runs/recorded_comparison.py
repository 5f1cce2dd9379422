"""Comparison of recorded runs: one page that overlays them, and a table of their metrics."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from vessel_hsmc_ros.report.making import Wanted, read, write
from vessel_hsmc_ros.report.tables import metrics_table
from vessel_hsmc_ros.scenario.run_folder import RunFolder


class Compared(NamedTuple):
    """Recorded runs side by side.

    Attributes:
        head: The names of the runs, after an empty one for the labels.
        table: Label and value for each run; MISSING where a run lacks it.
        files: The written files by kind.
    """

    head: list[str]
    table: list[list[str]]
    files: dict[str, Path]


def compare_bags(bags: Sequence[Path], folder: RunFolder) -> Compared:
    """Compare the metrics of recorded runs, and write their common page and figures into a run folder.

    Raises:
        BagError: a bag cannot be read or has no odometry.
        ReportError: the page or a figure cannot be written.
    """
    records = read(bags)
    made = write(records, Wanted(page=folder.report, figures="png"))
    table = [[row.label, *(row.text(run) for run in range(len(records)))] for row in metrics_table(records)]
    return Compared(["", *(record.name for record in records)], table, made.files)
