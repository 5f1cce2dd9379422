"""The figures of a report as PNG or SVG files."""

import textwrap
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from vessel_hsmc_ros.core.exceptions import ReportError
from vessel_hsmc_ros.report.jitter import histogram
from vessel_hsmc_ros.report.overlay import REFERENCE, Overlay, Owned, overlays, tracks
from vessel_hsmc_ros.report.panels import DESIRED, MAIN, MEASURED, OTHER, THIRD, Limit
from vessel_hsmc_ros.report.record import Record
from vessel_hsmc_ros.report.style import LIMIT, PLOT, ROLE_COLOURS, SHIP, series_colour
from vessel_hsmc_ros.report.thinning import buckets, thin, thin_time

mpl.use("Agg")  # files only: no display is needed

STYLES = {MAIN: "-", DESIRED: "--", OTHER: ":", THIRD: "-.", MEASURED: "-"}
VALUES = 4000
"""Largest number of values of a line, more than a figure can resolve."""

LABEL_WIDTH = 24
"""Longest line of an axis label, characters."""

Array = NDArray[np.float64]


def draw(records: Sequence[Record], directory: Path, kind: str = "png") -> list[Path]:
    """Draw the track and one figure for each group of panels.

    Args:
        records: At least one run.
        directory: Created if it does not exist.
        kind: png or svg.

    Returns:
        The files.

    Raises:
        ReportError: a file cannot be written.
    """
    groups: dict[str, list[Overlay]] = {}
    for overlay in overlays(records):
        groups.setdefault(overlay.panel.group, []).append(overlay)
    with mpl.rc_context(PLOT):
        pictures = {"track": track(records)}
        pictures |= {name.lower(): group(name, found, len(records) == 1) for name, found in groups.items()}
        if (jitter := histogram(records)) is not None:
            pictures["jitter"] = jitter
        try:
            directory.mkdir(parents=True, exist_ok=True)
            return [_save(figure, directory / f"{name}.{kind}") for name, figure in pictures.items()]
        except OSError as error:
            raise ReportError(f"figures in {directory} cannot be written: {error.strerror}") from None


def _save(figure: Figure, path: Path) -> Path:
    figure.savefig(path)
    return path


def track(records: Sequence[Record]) -> Figure:
    """Draw the tracks of ships and references, with the heading of the first ship as arrows at 11 instants."""
    figure = Figure(figsize=(6.5, 6.0))
    figure.subplots_adjust(left=0.12, right=0.97, bottom=0.09, top=0.94)
    axis = figure.add_subplot()
    for each in tracks(records)[::-1]:  # ships come first in the list and are drawn last, on top of the references
        role = DESIRED if each.role == REFERENCE else MAIN
        colour = _colour(each.run, role, len(records) == 1)
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


def group(name: str, found: Sequence[Overlay], alone: bool) -> Figure:
    """Draw the panels of a group below each other, with a common time axis.

    Args:
        name: Title of the figure.
        found: Its panels, from top to bottom.
        alone: Whether there is a single run: lines are then coloured by their role, else by their run.
    """
    height = 0.8 + 1.8 * len(found)
    figure = Figure(figsize=(8.0, height))
    figure.subplots_adjust(left=0.13, right=0.98, bottom=0.45 / height, top=1.0 - 0.35 / height, hspace=0.12)
    first = figure.add_subplot(len(found), 1, 1)
    axes = [first, *(figure.add_subplot(len(found), 1, i + 1, sharex=first) for i in range(1, len(found)))]
    for axis, overlay in zip(axes, found, strict=True):
        _panel(axis, overlay, alone)
        axis.tick_params(labelbottom=axis is axes[-1])
    axes[0].set(title=name)
    axes[-1].set(xlabel="time [s]")
    return figure


def _panel(axis: Axes, overlay: Overlay, alone: bool) -> None:
    """Draw the lines of a panel."""
    panel = overlay.panel
    values = np.concatenate([_line(axis, owned, panel.step, alone) for owned in overlay.lines])
    title = textwrap.fill(panel.title, LABEL_WIDTH)
    axis.set(ylabel=f"{title}\n[{panel.unit}]" if panel.unit else title)
    if len(overlay.lines) > 1:
        axis.legend(loc="upper right", ncols=min(3, len(overlay.lines)), fontsize=7)
    _limit(axis, panel.limits, values)
    _leave_out_peaks(axis, values[np.isfinite(values)], panel.unit)


def _line(axis: Axes, owned: Owned, step: bool, alone: bool) -> Array:
    """Draw a line, thinned; returns the drawn values."""
    line = owned.line
    chosen = buckets(len(line.time), VALUES)
    values = thin(np.asarray(line.values, dtype=float), chosen)
    axis.plot(
        thin_time(line.time, chosen),
        values,
        color=_colour(owned.run, line.role, alone),
        ls=STYLES[line.role],
        lw=1.1,
        label=owned.label,
        drawstyle="steps-post" if step else "default",
    )
    return values


def _colour(run: int | None, role: str, alone: bool) -> str:
    """Colour of a line: by role in the figures of one run, by run in those of several."""
    return ROLE_COLOURS[role] if alone else series_colour(run)


def _limit(axis: Axes, limits: Sequence[Limit], values: Array) -> None:
    """Draw saturation limits if the values reach a quarter of them: more distant ones would compress the lines."""
    for limit, _ in limits:
        if limit <= 4.0 * np.nanmax(np.abs(values), initial=0.0):
            for bound in (-limit, limit):
                axis.axhline(bound, color=LIMIT, lw=0.8, ls="--")


def _leave_out_peaks(axis: Axes, values: Array, unit: str) -> None:
    """Scale the axis to 96 % of the values where a short peak would flatten them, and print the peak's value."""
    if len(values) == 0:
        return
    low, high = np.percentile(values, [2.0, 98.0])
    margin = high - low
    peak = values[np.argmax(np.abs(values))]
    if margin and not low - 4.0 * margin <= peak <= high + 4.0 * margin:
        axis.set_ylim(low - 0.5 * margin, high + 0.5 * margin)
        axis.text(0.02, 0.92, f"peak {peak:.3g} {unit}, beyond the scale", transform=axis.transAxes, va="top", fontsize=8)
