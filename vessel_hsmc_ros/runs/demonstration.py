"""The demonstration: case 2 of the paper under the paper's law and under the guided law, compared in one page."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from vessel_hsmc_ros.core.metrics import Metrics, position_error
from vessel_hsmc_ros.report.making import Wanted, read, write
from vessel_hsmc_ros.report.record import Record

SCENARIO = "case2_tracking"
LAWS = ("hierarchical", "guided")
DURATION = 150.0
"""Simulated time, s: long enough to show which law converges, and short enough to wait for."""

CONVERGED = 0.5
"""A law with a smaller rms position error over the last quarter of the run counts as converged, m."""

TITLES = {"hierarchical": "The paper's law (hierarchical)", "guided": "The guided law"}
CAUSES = {
    "hierarchical": "the sway and heading terms of its sliding surface S1 cancel each other without vanishing (equation 46)",
}
"""Why a law fails to converge, where the analysis in docs/paper.md explains it."""


class Comparison(NamedTuple):
    """The runs of the demonstration, a sentence on each, and the written files by kind."""

    records: list[Record]
    conclusions: tuple[str, ...]
    files: dict[str, Path]


def compare_bags(bags: Sequence[Path], page: Path) -> Comparison:
    """Write a page that overlays the runs of the demonstration.

    Args:
        bags: One bag for each of LAWS.
        page: The page's file; its figures go beside it.

    Raises:
        BagError: a bag cannot be read.
        ReportError: the page or a figure cannot be written.
    """
    records = read(bags)
    notes = conclusions(records)
    made = write(records, Wanted(page=page, title=f"{SCENARIO}: {' and '.join(LAWS)}", figures="png", notes=notes))
    return Comparison(records, notes, made.files)


def conclusions(records: Sequence[Record]) -> tuple[str, ...]:
    """One sentence on each run: whether its law converges, by the position errors of its metrics."""
    return tuple(_conclusion(record, record.metrics) for record in records if record.metrics)


def _conclusion(record: Record, metrics: Metrics) -> str:
    run = record.run
    law = TITLES.get(record.name, record.name)
    late = f"{metrics.position_error_rms_last_quarter:.2g} m rms over the last quarter of {record.duration:g} s"
    initial = float(position_error(run.state[:1], run.reference[:1])[0])
    if metrics.position_error_rms_last_quarter < CONVERGED:
        return f"{law} converges to the reference: the position error falls from {initial:.3g} m to {late}."
    heading = f"while the heading error is {abs(metrics.heading_error_final_deg):.1g}° at the end"
    cause = f": {CAUSES[record.name]}" if record.name in CAUSES else ""
    return f"{law} does not converge: the position error is {late}, {heading}{cause}."
