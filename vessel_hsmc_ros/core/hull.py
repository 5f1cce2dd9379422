"""The outline of the ship for drawings to scale; the model (6) itself has no dimensions.

The paper's coefficients are known in the literature as those of a ship of 32 m and 118 t; the beam is our assumption, the same as
that of the wave model.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.schema import parameter

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Hull:
    """Dimensions of the drawn hull."""

    length: float = parameter(32.0, "Length of the drawn hull.", unit="m", low=0.1, high=1000.0)
    beam: float = parameter(6.4, "Beam of the drawn hull.", unit="m", low=0.1, high=1000.0)


def outline(hull: Hull) -> Array:
    """Vertices of the hull's outline in the body frame, counter-clockwise from the starboard side of the stern.

    Returns:
        Coordinates ahead and to port, (7, 2) m.
    """
    stern, bow, half = -0.5 * hull.length, 0.5 * hull.length, 0.5 * hull.beam
    side = [(stern, 0.8 * half), (0.2 * stern, half), (0.35 * bow, half)]
    starboard = [(x, -y) for x, y in side]
    return np.array([*starboard, (bow, 0.0), *side[::-1]])


def triangles(hull: Hull) -> Array:
    """The outline as a triangle fan, (15, 2) m: three consecutive rows are one triangle."""
    corners = outline(hull)
    fan = [(corners[0], corners[i], corners[i + 1]) for i in range(1, len(corners) - 1)]
    return np.array([corner for triangle in fan for corner in triangle])
