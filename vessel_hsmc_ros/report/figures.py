"""The figures of a report as PNG or SVG files, and its histograms of the intervals between control steps."""

import base64
import io
import re
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from vessel_hsmc_ros.core.quantities import quantity, scaled
from vessel_hsmc_ros.report.diagrams import LIMIT, NEUTRAL, PLANNED, PLOT, SHIP, line_colour, page_colour
from vessel_hsmc_ros.report.page_kit import writing
from vessel_hsmc_ros.report.panels import (
    DESIRED,
    JITTER,
    MAIN,
    MEASURED,
    OTHER,
    REFERENCE,
    THIRD,
    Line,
    Overlay,
    buckets,
    fences,
    overlays,
    plans,
    thin,
    thin_time,
    tracks,
)
from vessel_hsmc_ros.report.record import Limit, Mark, Record, control_intervals

mpl.use("Agg")  # files only: no display is needed

STYLES = {MAIN: "-", DESIRED: "--", OTHER: ":", THIRD: "-.", MEASURED: "-"}
VALUES = 4000  # largest number of values of a line, more than a figure can resolve
LABEL_WIDTH = 24  # longest line of an axis label, characters
Array = NDArray[np.float64]


def draw(records: Sequence[Record], directory: Path, kind: str = "png") -> list[Path]:
    """Draw the track and one figure for each group of panels.

    `records`: at least one run. `directory`: created if it does not exist.
    """
    groups: dict[str, list[Overlay]] = {}
    for overlay in overlays(records):
        groups.setdefault(overlay.panel.group, []).append(overlay)
    with mpl.rc_context(PLOT):
        pictures = {"track": track(records)}
        alone = len(records) == 1
        marks = records[0].marks if alone else ()
        for name, found in groups.items():
            pictures[re.sub(r"[^a-z0-9]+", "_", name.lower().replace("'", ""))] = group(name, found, alone, marks)
        if (jitter := jitter_histogram(records)) is not None:
            pictures["jitter"] = jitter
        with writing(f"figures in {directory}"):
            directory.mkdir(parents=True, exist_ok=True)
            for name, figure in pictures.items():
                figure.savefig(directory / f"{name}.{kind}")
    return [directory / f"{name}.{kind}" for name in pictures]


def track(records: Sequence[Record]) -> Figure:
    """Draw the tracks of ships and references, with the heading of the first ship as arrows at 11 instants."""
    figure = Figure(figsize=(6.5, 6.0))
    figure.subplots_adjust(left=0.12, right=0.97, bottom=0.09, top=0.94)
    axis = figure.add_subplot()
    for plan in plans(records):
        for points in plan.outlines:
            axis.plot(
                points.real, points.imag, color=PLANNED, lw=4.0, label="planned legs" if points is plan.outlines[0] else None
            )
        x, y = np.array([(point.real, point.imag) for point in plan.waypoints]).reshape(-1, 2).T
        axis.plot(x, y, "o", mfc="none", mec=NEUTRAL, ms=6)
    for number, ring in enumerate(fences(records)):
        x, y = np.array([(corner.real, corner.imag) for corner in (*ring, ring[0])]).T
        axis.plot(x, y, color=NEUTRAL, lw=1.2, ls="--", label=None if number else "fence")
    for each in tracks(records)[::-1]:  # ships come first in the list and are drawn last, on top of the references
        role = DESIRED if each.role == REFERENCE else MAIN
        colour = page_colour(line_colour(each.run, role, len(records) == 1))
        poses = each.poses[:: max(1, len(each.poses) // VALUES)]
        axis.plot(poses[:, 0], poses[:, 1], color=colour, lw=1.3, ls=STYLES[role], label=each.label)
        axis.plot(*each.poses[0, :2], "o", color=colour, ms=5)
        axis.plot(*each.poses[-1, :2], "s", color=colour, ms=5)
    state = records[0].run.state
    x, y, psi = state[np.linspace(0, len(state) - 1, 13).astype(int)[1:-1], :3].T
    axis.quiver(x, y, np.cos(psi), np.sin(psi), color=SHIP, width=0.004, scale=22, zorder=3)
    axis.set(xlabel="x east [m]", ylabel="y north [m]", title="Track from start (dot) to end (square)", aspect="equal")
    handles, labels = axis.get_legend_handles_labels()
    axis.legend(handles[::-1], labels[::-1], loc="best")  # in the order from top to bottom
    return figure


def group(name: str, found: Sequence[Overlay], alone: bool, marks: Sequence[Mark] = ()) -> Figure:
    """Draw the panels of a group below each other, with a common time axis.

    `found`: its panels, from top to bottom. `alone`: whether there is a single run: lines are then coloured by their role, else
    by their run.
    """
    height = 0.8 + 1.8 * len(found)
    figure = Figure(figsize=(8.0, height))
    figure.subplots_adjust(left=0.13, right=0.98, bottom=0.45 / height, top=1.0 - 0.35 / height, hspace=0.22)
    first = figure.add_subplot(len(found), 1, 1)
    axes = [first, *(figure.add_subplot(len(found), 1, i + 1, sharex=first) for i in range(1, len(found)))]
    for axis, overlay in zip(axes, found, strict=True):
        _panel(axis, overlay, alone)
        axis.tick_params(labelbottom=axis is axes[-1])
        for mark in marks:
            axis.axvline(mark.time, color=NEUTRAL, lw=0.8, ls=":")
    axes[0].set_title(name, loc="left")
    axes[-1].set(xlabel="time [s]")
    return figure


def _panel(axis: Axes, overlay: Overlay, alone: bool) -> None:
    """Draw the lines of a panel, its values with the prefix that suits them."""
    panel = overlay.panel
    drawn = [_thinned(owned.line) for owned in overlay.lines]
    values = np.concatenate([found for _, found in drawn])
    values = values[np.isfinite(values)]
    low, high, peak = _range(values)
    factor, unit = scaled(max(abs(low), abs(high)), panel.unit)
    for owned, (time, found) in zip(overlay.lines, drawn, strict=True):
        look: Any = {
            "color": page_colour(line_colour(owned.run, owned.line.role, alone)),
            "ls": STYLES[owned.line.role],
            "lw": 1.1,
        }
        axis.plot(time, factor * found, label=owned.label, drawstyle="steps-post" if panel.step else "default", **look)
    title = textwrap.fill(panel.title, LABEL_WIDTH)
    axis.set(ylabel=f"{title}\n[{unit}]" if unit else title)
    _limits(axis, panel.limits, max(abs(low), abs(high)), factor)
    if peak is not None:
        axis.set_ylim(factor * low, factor * high)
        text = f"peak {quantity(peak, panel.unit)}, beyond the scale"
        axis.text(0.02, 0.92, text, transform=axis.transAxes, va="top", fontsize=8)
    if len(axis.lines) > 1:
        # Above the panel, where it covers no line.
        axis.legend(loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=5, fontsize=7, borderaxespad=0.0)


def _thinned(line: Line) -> tuple[Array, Array]:
    chosen = buckets(len(line.time), VALUES)
    return thin_time(line.time, chosen), thin(np.asarray(line.values, dtype=float), chosen)


def _limits(axis: Axes, limits: Sequence[Limit], largest: float, factor: float) -> None:
    """Draw saturation limits if the values reach a quarter of them: more distant ones would compress the lines.

    `largest`: largest magnitude of the shown values, SI. `factor`: from SI to the unit of the axis.
    """
    for i, limit in enumerate(limits):
        if limit.value <= 4.0 * largest:
            for bound, label in ((-limit.value, None), (limit.value, f"limit: {limit.name}")):
                axis.axhline(factor * bound, color=LIMIT, lw=0.8, ls=("--", ":")[i % 2], label=label)


def _range(values: Array) -> tuple[float, float, float | None]:
    """Lower and upper end of the shown values; and a short peak beyond them that would flatten the others, if there is one."""
    if len(values) == 0:
        return 0.0, 0.0, None
    low, high = np.percentile(values, [2.0, 98.0])
    margin = high - low
    peak = float(values[np.argmax(np.abs(values))])
    if margin and not low - 4.0 * margin <= peak <= high + 4.0 * margin:
        return low - 0.5 * margin, high + 0.5 * margin, peak
    return float(values.min()), float(values.max()), None


def jitter_intervals(record: Record) -> Array | None:
    """Intervals between control steps, (n,) s; None where they are constant or the law's terms were not recorded."""
    _, found = control_intervals(record.run, record.marks)
    return found if len(found) > 1 and np.ptp(found) > JITTER else None


def jitter_histogram(records: Sequence[Record]) -> Figure | None:
    """Draw the intervals between control steps of all runs whose intervals vary; None without any."""
    uneven = [(record.name, found) for record in records if (found := jitter_intervals(record)) is not None]
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


def jitter_picture(records: Sequence[Record]) -> str:
    """The histograms as the data URI of an image; empty without any."""
    if (figure := jitter_histogram(records)) is None:
        return ""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=110)
    return "data:image/png;base64," + base64.b64encode(stream.getvalue()).decode()
