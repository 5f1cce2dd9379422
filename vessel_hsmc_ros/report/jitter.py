"""How evenly the law ran: a histogram of the time between its steps, for runs in which that is not always the same."""

import base64
import io
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.report.tables import Record

Array = NDArray[np.float64]

EVEN = 1e-6
"""Intervals that differ by less are the same: lockstep, s."""


def intervals(record: Record) -> Array | None:
    """Time between the law's steps, (n - 1,) s; None where it is always the same, or nothing was recorded of the law."""
    taken = record.signals.control.get("compute_time")
    if taken is None or len(taken.time) < 3:
        return None
    found: Array = np.diff(taken.time)
    return found if np.ptp(found) > EVEN else None


def histogram(records: Sequence[Record]) -> Any:
    """The histograms of all runs that have one, as a matplotlib Figure; None where none has."""
    from matplotlib.figure import Figure  # takes longer to load than the rest of the page takes to write

    uneven = [(record.name, found) for record in records if (found := intervals(record)) is not None]
    if not uneven:
        return None
    figure = Figure(figsize=(8.0, 2.6 * len(uneven)), layout="constrained")
    for i, (name, found) in enumerate(uneven):
        axis = figure.add_subplot(len(uneven), 1, i + 1)
        period = round(float(np.median(found)), 4)
        deviation = 1e3 * (found - period)
        low, high = np.percentile(deviation, [0.1, 99.9])
        pad = 0.1 * (high - low) or 1.0
        axis.hist(np.clip(deviation, low - pad, high + pad), bins=60, color="#0072B2")
        axis.set_title(f"{name}: smallest {deviation.min():.3g} ms, largest {deviation.max():.3g} ms", fontsize=9)
        axis.set(xlabel=f"control interval minus {1e3 * period:.4g} ms [ms]", ylabel="count", yscale="log")
    return figure


def picture(records: Sequence[Record]) -> str:
    """The histograms as the source of an HTML image; empty where there are none."""
    if all(intervals(record) is None for record in records):
        return ""
    stream = io.BytesIO()
    histogram(records).savefig(stream, format="png", dpi=110)
    return "data:image/png;base64," + base64.b64encode(stream.getvalue()).decode()
