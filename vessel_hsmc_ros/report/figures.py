"""The figures of a report: its panels, the track and the intervals between control steps, and files of them."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.quantities import quantity, scaled
from vessel_hsmc_ros.report import diagrams
from vessel_hsmc_ros.report.diagrams import (
    LIMIT_DASHES,
    Axis,
    Figure,
    histogram,
    layout,
    level,
    line,
    look,
    moment,
    numbers,
    points,
    signal,
    text,
)
from vessel_hsmc_ros.report.page_kit import writing
from vessel_hsmc_ros.report.panels import DESIRED, JITTER, MAIN, REFERENCE, Overlay, fences, overlays, plans, tracks
from vessel_hsmc_ros.report.record import Mark, Record, control_intervals

STRIP, SQUARE = (8.0, 1.8), (6.5, 6.0)  # width and height of a panel and of the track, inches
ARROWS, BINS = 11, 60  # headings along the track, and bins of a histogram


def draw(records: Sequence[Record], directory: Path, kind: str = "png") -> list[Path]:
    """Draw the track, one picture for each group of panels, and the intervals between control steps where they vary.

    `records`: at least one run. `directory`: created if it does not exist.
    """
    alone = len(records) == 1
    groups: dict[str, list[Figure]] = {}
    for overlay in overlays(records):
        of_group = groups.setdefault(overlay.panel.group, [])
        drawn = of_panel(overlay, alone, records[0].marks if alone else ())
        of_group.append({**drawn, "title": "" if of_group else overlay.panel.group})
    with writing(f"figures in {directory}"):
        directory.mkdir(parents=True, exist_ok=True)
        files = [diagrams.draw(directory / f"track.{kind}", [track(records)], SQUARE)]
        for name, found in groups.items():
            file = re.sub(r"[^a-z0-9]+", "_", name.lower().replace("'", ""))
            files.append(diagrams.draw(directory / f"{file}.{kind}", found, STRIP, stacked=True))
        if uneven := jitter(records):
            files.append(diagrams.draw(directory / f"jitter.{kind}", uneven))
    return files


def track(records: Sequence[Record]) -> Figure:
    """The tracks of ships and references, with the heading of the first ship as arrows."""
    traces: list[Figure] = []
    for plan in plans(records):
        for number, legs in enumerate(plan.outlines):
            traces.append(line(legs.real, legs.imag, "" if number else "planned legs", "--plan", width=5.0))
        waypoints = np.array(plan.waypoints)
        empty = {"color": "--card", "line": {"color": "--shared", "width": 1.3}}
        traces.append(_with_marker(points(waypoints.real, waypoints.imag, "", "--shared", size=8.0), empty))
    for number, ring in enumerate(fences(records)):
        corners = np.array((*ring, ring[0]))
        traces.append(line(corners.real, corners.imag, "" if number else "fence", "--shared", width=1.6, dash="dash"))
    for each in tracks(records)[::-1]:  # ships come first in the list and are drawn last, on top of the references
        drawn = look(each.run, DESIRED if each.role == REFERENCE else MAIN, len(records) == 1)
        x, y = each.poses[:, :2].T
        traces += [
            line(x, y, each.label, **drawn),
            points(x[:1], y[:1], "", drawn["colour"], size=7.0),
            points(x[-1:], y[-1:], "", drawn["colour"], "square", 7.0),
        ]
    state = records[0].run.state
    x, y, psi = state[np.linspace(0, len(state) - 1, ARROWS + 2).astype(int)[1:-1], :3].T
    heading = {"symbol": "arrow", "angle": numbers(90.0 - np.degrees(psi))}
    traces.append(_with_marker(points(x, y, "", "--ship", size=10.0), heading))
    drawn = layout(Axis("x east [m]"), Axis("y north [m]"), 560, legend=True)
    drawn["yaxis"] |= {"scaleanchor": "x"}
    return {"title": "Track from start (dot) to end (square)", "traces": traces, "layout": drawn}


def _with_marker(trace: Figure, marker: Figure) -> Figure:
    return {**trace, "marker": {**trace["marker"], **marker}}


def of_panel(overlay: Overlay, alone: bool, marks: Sequence[Mark] = ()) -> Figure:
    """A panel with its values, with the prefix that suits them, the limits near them, and the events of a single run.

    `alone`: whether there is a single run: lines are then coloured by their role, else by their run.
    """
    panel = overlay.panel
    values = np.concatenate([one.line.values for one in overlay.lines]).astype(float)
    low, high, peak = _range(values[np.isfinite(values)])
    largest = max(abs(low), abs(high))
    factor, unit = scaled(largest, panel.unit)
    shape = "hv" if panel.step else "linear"
    traces = [
        signal(one.line.time, factor * one.line.values, one.label, **look(one.run, one.line.role, alone), shape=shape)
        for one in overlay.lines
    ]
    drawn = layout(Axis("time [s]"), Axis(f"{panel.title} [{unit}]" if unit else panel.title), legend=len(traces) > 1)
    drawn["shapes"] = [moment(mark.time, "--shared", "dot") for mark in marks]
    for i, limit in enumerate(panel.limits):
        if limit.value <= 4.0 * largest:  # more distant ones would compress the lines
            for bound, name in ((-limit.value, ""), (limit.value, f"limit: {limit.name}")):
                drawn["shapes"].append(level(factor * bound, dash=LIMIT_DASHES[i % len(LIMIT_DASHES)], name=name))
    if peak is not None:
        drawn["yaxis"] |= {"range": [factor * low, factor * high]}
        words = f"peak {quantity(peak, panel.unit)}, beyond the scale"
        drawn["annotations"] = [text(0.02, 0.92, words, xref="paper", yref="paper", xanchor="left", yanchor="top")]
    return {"title": panel.title, "traces": traces, "layout": drawn}


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


def jitter(records: Sequence[Record]) -> list[Figure]:
    """Histograms of the intervals between control steps, of all runs whose intervals vary."""
    uneven = [(record.name, jitter_intervals(record)) for record in records]
    return [_histogram(name, found) for name, found in uneven if found is not None]


def jitter_intervals(record: Record) -> Array | None:
    """Intervals between control steps, (n,) s; None where they are constant or the law's terms were not recorded."""
    _, found = control_intervals(record.run, record.marks)
    return found if len(found) > 1 and np.ptp(found) > JITTER else None


def _histogram(name: str, intervals: Array) -> Figure:
    period = round(float(np.median(intervals)), 4)  # the median: late steps do not shift it
    deviation = intervals - period
    # Outliers are counted in the outermost bins; the title shows their values.
    low, high = np.percentile(deviation, [0.1, 99.9])
    factor, unit = scaled(max(-low, high), "s")
    pad = 0.1 * (high - low) or 1e-3
    bars = histogram(factor * np.clip(deviation, low - pad, high + pad), BINS, "--ship")
    smallest, largest = quantity(deviation.min(), "s", sign=True), quantity(deviation.max(), "s", sign=True)
    axes = Axis(f"control interval minus {quantity(period, 's')} [{unit}]"), Axis("count", logarithmic=True)
    return {"title": f"{name}: smallest {smallest}, largest {largest}", "traces": [bars], "layout": layout(*axes)}
