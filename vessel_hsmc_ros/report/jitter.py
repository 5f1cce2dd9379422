"""Jitter of the control period: histograms of the intervals between control steps of real-time runs."""

import base64
import io
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.quantities import quantity, scaled
from vessel_hsmc_ros.report.record import Record, control_intervals
from vessel_hsmc_ros.report.style import SHIP

Array = NDArray[np.float64]

CONSTANT = 1e-6
"""Intervals whose spread is below this are constant, as in lockstep, s."""


def intervals(record: Record) -> Array | None:
    """Intervals between control steps, (n,) s; None where they are constant or the law's terms were not recorded."""
    _, found = control_intervals(record)
    return found if len(found) > 1 and np.ptp(found) > CONSTANT else None


def histogram(records: Sequence[Record]) -> Any:
    """Draw the histograms of all runs whose intervals vary, as a matplotlib Figure; None without any."""
    from matplotlib.figure import Figure  # loading it takes longer than writing the rest of the page

    uneven = [(record.name, found) for record in records if (found := intervals(record)) is not None]
    if not uneven:
        return None
    figure = Figure(figsize=(8.0, 2.6 * len(uneven)), layout="constrained")
    for i, (name, found) in enumerate(uneven):
        axis = figure.add_subplot(len(uneven), 1, i + 1)
        period = round(float(np.median(found)), 4)  # the median: late steps do not shift it
        deviation = found - period
        # Outliers are counted in the outermost bins; the title shows their values.
        low, high = np.percentile(deviation, [0.1, 99.9])
        factor, unit = scaled(max(-low, high), "s")
        pad = 0.1 * (high - low) or 1e-3
        axis.hist(factor * np.clip(deviation, low - pad, high + pad), bins=60, color=SHIP)
        smallest, largest = quantity(deviation.min(), "s", sign=True), quantity(deviation.max(), "s", sign=True)
        axis.set_title(f"{name}: smallest {smallest}, largest {largest}", fontsize=9)
        axis.set(xlabel=f"control interval minus {quantity(period, 's')} [{unit}]", ylabel="count", yscale="log")
    return figure


def picture(records: Sequence[Record]) -> str:
    """The histograms as the data URI of an image; empty without any."""
    if all(intervals(record) is None for record in records):
        return ""
    stream = io.BytesIO()
    histogram(records).savefig(stream, format="png", dpi=110)
    return "data:image/png;base64," + base64.b64encode(stream.getvalue()).decode()
