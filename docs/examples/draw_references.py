"""Draw the references along curves with the hull on them: docs/images/references.png."""

import math
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
from matplotlib import pyplot as plt

from vessel_hsmc_ros.core.hull import Hull, outline
from vessel_hsmc_ros.guidance.factory import ReferenceShipParameters, make_reference
from vessel_hsmc_ros.report.diagrams import INK, PLOT, REFERENCE, SHIP

PERIOD, HULL_EVERY = 0.25, 80
"""Step, s, and the number of steps between two drawn hulls."""

DURATIONS = {"straight": 130.0, "circle": 214.0, "figure_eight": 272.0, "square": 250.0}
"""Time to draw of each mode, s."""


def draw(axes: plt.Axes, mode: str) -> None:
    """Draw the track of a mode, the hull at equal intervals, the start and the initial course."""
    reference = make_reference(ReferenceShipParameters(mode=mode, initial_pose=(0.0, 0.0, 0.0)), PERIOD)
    states = []
    for _ in range(round(DURATIONS[mode] / PERIOD)):
        states.append(reference.state)
        reference.advance()
    track = np.array(states)
    axes.plot(track[:, 0], track[:, 1], color=REFERENCE)
    for x, y, psi in track[::HULL_EVERY, :3]:
        c, s = math.cos(psi), math.sin(psi)
        corners = outline(Hull(12.0, 3.0)) @ np.array([[c, s], [-s, c]]) + (x, y)
        axes.fill(corners[:, 0], corners[:, 1], facecolor=SHIP, alpha=0.35)
    axes.plot(0.0, 0.0, "o", color=INK, markersize=4)
    axes.annotate("", (22.0, 0.0), (0.0, 0.0), arrowprops={"arrowstyle": "->", "color": INK})
    axes.set(title=mode, xlabel="x, m", ylabel="y, m")
    axes.set_aspect("equal", adjustable="datalim")


def main() -> None:
    """Write the picture."""
    with plt.rc_context(PLOT):
        figure, axes = plt.subplots(2, 2, figsize=(8.0, 7.6), layout="constrained")
        for one, mode in zip(axes.flat, DURATIONS, strict=True):
            draw(one, mode)
        figure.savefig(Path(__file__).parents[1] / "images" / "references.png")


if __name__ == "__main__":
    main()
