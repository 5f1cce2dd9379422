"""The pictures of an identification: measured against simulated motion, residuals, correlations."""

from collections.abc import Sequence
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np

from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.identification.types import Identified, Prediction
from vessel_hsmc_ros.report.style import INK, NEUTRAL, REFERENCE, SHIP, figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLUMNS = (("surge velocity", "m/s", 1.0), ("sway velocity", "m/s", 1.0), ("yaw rate", "°/s", 180.0 / np.pi))
STATES = (("x", "m", 1.0), ("y", "m", 1.0), ("heading", "°", 180.0 / np.pi), *COLUMNS)

MOST = 4000
"""Largest number of points of a drawn line."""


def prediction_picture(prediction: Prediction) -> bytes:
    """Track and velocities, measured and simulated window by window, as PNG.

    Args:
        prediction: Of one run.
    """
    keep = slice(None, None, max(len(prediction.time) // MOST, 1))
    time, measured, simulated = (values[keep] for values in (prediction.time, prediction.measured, prediction.simulated))
    broken = _broken(time, simulated, prediction.starts)

    def draw(picture: Any) -> None:
        grid = picture.add_gridspec(3, 2, width_ratios=(1.0, 1.6))
        track = picture.add_subplot(grid[:, 0])
        _lines(track, measured[:, 0], measured[:, 1], broken[:, 0], broken[:, 1])
        track.set(xlabel="x [m]", ylabel="y [m]", aspect="equal", adjustable="datalim")
        track.legend(loc="upper right")
        panel: Any = None
        for i, (name, unit, factor) in enumerate(COLUMNS):
            panel = picture.add_subplot(grid[i, 1], sharex=panel)
            _lines(panel, time, factor * measured[:, 3 + i], time, factor * broken[:, 3 + i])
            panel.set(ylabel=f"{name} [{unit}]")
        panel.set(xlabel="time [s]")

    return _png(draw, (10.0, 5.4))


def _broken(time: Array, simulated: Array, starts: Array) -> Array:
    """The simulated motion with a gap at the start of each window, where it begins at the measured state again."""
    gaps = simulated.copy()
    gaps[np.clip(np.searchsorted(time, starts), 0, len(time) - 1)] = np.nan
    return gaps


def _lines(panel: "Axes", x: Array, y: Array, simulated_x: Array, simulated_y: Array) -> None:
    panel.plot(x, y, color=NEUTRAL, lw=2.4, alpha=0.6, label="measured")
    panel.plot(simulated_x, simulated_y, color=SHIP, lw=1.1, label="simulated")


def residuals_picture(times: Sequence[Array], found: Identified) -> bytes:
    """Residuals of all measured states over time, one run after the other, with twice their standard deviation, as PNG.

    Args:
        times: Time of each run, (n,), s.
        found: The identification.
    """

    def draw(picture: Any) -> None:
        panels = picture.subplots(2, 3, sharex=True).ravel()
        for i, (panel, (name, unit, factor)) in enumerate(zip(panels, STATES, strict=True)):
            begin = 0.0
            for time, residual in zip(times, found.residuals, strict=True):
                keep = slice(None, None, max(len(time) // MOST, 1))
                panel.plot((begin + time - time[0])[keep], (factor * residual[:, i])[keep], color=SHIP, lw=0.5)
                begin += float(time[-1] - time[0])
            for side in (-2.0, 2.0):
                panel.axhline(side * factor * found.noise[i], color=REFERENCE, lw=0.9, ls="--")
            panel.set(ylabel=f"{name} [{unit}]")
        for panel in panels[3:]:
            panel.set(xlabel="time [s]")

    return _png(draw, (10.0, 4.2))


def correlation_picture(found: Identified) -> bytes:
    """The correlations of the estimates as PNG.

    Args:
        found: The identification.
    """
    names = list(found.standard_errors)

    def draw(picture: Any) -> None:
        panel = picture.subplots()
        image = panel.imshow(found.correlation, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
        panel.set_xticks(range(len(names)), names, rotation=90)
        panel.set_yticks(range(len(names)), names)
        panel.grid(visible=False)
        for i, j in zip(*np.nonzero(np.abs(found.correlation) >= 0.9), strict=True):
            if i != j:
                panel.text(j, i, f"{found.correlation[i, j]:.2f}", ha="center", va="center", fontsize=6, color=INK)
        picture.colorbar(image, shrink=0.7)

    size = 3.2 + 0.28 * len(names)
    return _png(draw, (size + 1.0, size))


def _png(draw: Any, size: tuple[float, float]) -> bytes:
    """A picture of a size in inches, drawn by a function."""
    content = BytesIO()
    with figure(content, *size) as picture:
        draw(picture)
    return content.getvalue()
