"""The outline of a ship, to draw it to scale; the model itself has no size.

32 m is the length of the ship that the paper's coefficients are known for in the literature, of 118 t; the beam is ours.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.schema import parameter

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Hull:
    """How large a ship is drawn."""

    length: float = parameter(32.0, "Length of the hull that is drawn.", unit="m", low=0.1, high=1000.0)
    beam: float = parameter(8.0, "Beam of the hull that is drawn.", unit="m", low=0.1, high=1000.0)


def outline(hull: Hull) -> Array:
    """Corners of the hull about its middle, bow along x, counter-clockwise from the stern's starboard side, (7, 2) m."""
    stern, bow, half = -0.5 * hull.length, 0.5 * hull.length, 0.5 * hull.beam
    side = [(stern, 0.8 * half), (0.2 * stern, half), (0.35 * bow, half)]
    starboard = [(x, -y) for x, y in side]
    return np.array([*starboard, (bow, 0.0), *side[::-1]])


def triangles(hull: Hull) -> Array:
    """The same as a fan of triangles, (15, 2) m, three rows each."""
    corners = outline(hull)
    fan = [(corners[0], corners[i], corners[i + 1]) for i in range(1, len(corners) - 1)]
    return np.array([corner for triangle in fan for corner in triangle])
