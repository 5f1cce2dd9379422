"""Outline of the hull, to draw a ship to scale; the equations of motion contain no dimensions.

LENGTH is that of the 118 t ship whose coefficients the paper uses. BEAM is ours: with a draught of 1.3 m, a slender monohull
of these dimensions has the displacement that the paper's inertia implies. The wave loads use the same dimensions.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.schema import parameter

Array = NDArray[np.float64]

LENGTH, BEAM = 32.0, 6.4
"""Dimensions of the paper's ship, m."""


@dataclass(frozen=True)
class Hull:
    """Dimensions of the hull that is drawn."""

    length: float = parameter(LENGTH, "Length of the hull that is drawn.", unit="m", low=0.1, high=1000.0)
    beam: float = parameter(BEAM, "Beam of the hull that is drawn.", unit="m", low=0.1, high=1000.0)


def outline(hull: Hull) -> Array:
    """Compute the corners of the hull in the body frame, origin midships and x forward.

    Returns:
        Corners counter-clockwise from the starboard quarter, (7, 2) m.
    """
    stern, bow, half = -0.5 * hull.length, 0.5 * hull.length, 0.5 * hull.beam
    # Transom at 80 % of the beam, parallel middle body, and a bow that tapers from 35 % of the half length on.
    side = [(stern, 0.8 * half), (0.2 * stern, half), (0.35 * bow, half)]
    starboard = [(x, -y) for x, y in side]
    return np.array([*starboard, (bow, 0.0), *side[::-1]])


def triangles(hull: Hull) -> Array:
    """Split the outline into a fan of triangles, (15, 2) m, three rows for each triangle."""
    corners = outline(hull)
    # The outline is convex, so a fan from one corner covers it.
    fan = [(corners[0], corners[i], corners[i + 1]) for i in range(1, len(corners) - 1)]
    return np.array([corner for triangle in fan for corner in triangle])
