"""Dimensions of the hull and its outline, to draw a ship to scale; the equations of motion contain no dimensions.

LENGTH is that of the 118 t ship whose coefficients the paper uses. BEAM is ours: with a draught of 1.3 m, a slender monohull
of these dimensions has the displacement that the paper's inertia implies. The wave loads use the same dimensions.

Hull data default to the paper's ship, so a ship that is described only in part keeps some of its values: `another_ship` and
`kept` find them.
"""

import math
from dataclasses import dataclass

import numpy as np

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.schema import parameter

LENGTH, BEAM = 32.0, 6.4  # dimensions of the paper's ship, m


@dataclass(frozen=True, kw_only=True)
class NamedVessel:
    """The name by which hull data are taken from the library."""

    name: str = parameter(
        "",
        "Vessel whose data are used where none are given: one of config/vessels, such as otter, or the path of a vessel file;"
        " empty for the paper's ship. `vessel: otter` is short for it.",
    )


@dataclass(frozen=True)
class Hull(NamedVessel):
    """Dimensions of the hull."""

    length: float = parameter(LENGTH, "Length of the hull, for waves and drawings.", unit="m", low=0.1, high=1000.0)
    beam: float = parameter(BEAM, "Beam of the hull, for waves and drawings.", unit="m", low=0.1, high=1000.0)


@dataclass(frozen=True)
class DrawnHull:
    """Dimensions of a drawn hull that differ from the ship's."""

    length: float = parameter(0.0, "Length of the hull that is drawn; 0 for vessel.length.", unit="m", low=0.0, high=1000.0)
    beam: float = parameter(0.0, "Beam of the hull that is drawn; 0 for vessel.beam.", unit="m", low=0.0, high=1000.0)

    def of(self, ship: Hull) -> Hull:
        """The hull to draw for a ship."""
        return Hull(self.length or ship.length, self.beam or ship.beam)


def described(hull: Hull) -> str:
    """Name and dimensions of a hull, such as `otter, 2 m × 1.08 m`; a vessel of a file has the file's name."""
    size = f"{hull.length:g} m × {hull.beam:g} m"
    return f"{vessel_name(hull)}, {size}" if hull.name else f"ship of {size}"


def vessel_name(vessel: NamedVessel) -> str:
    """The name of a vessel without the folder and the ending of its file; empty for the paper's ship."""
    return vessel.name.replace("\\", "/").rsplit("/", 1)[-1].removesuffix(".yaml").removesuffix(".yml")


VARIATION = 2.0
"""Up to this factor from the paper's value, hull data count as a variation of the paper's ship, not as another ship."""


def another_ship(vessel: object) -> bool:
    """Whether hull data are those of another ship: one of them differs from the paper's by more than VARIATION."""
    return any(not paper / VARIATION <= value <= paper * VARIATION for value, paper in _beside_the_papers(vessel).values())


def kept(vessel: object) -> dict[str, str]:
    """The hull data that equal those of the paper's ship, by name, as texts such as `sway_damping = 147000 kg/s`."""
    entries = schema.entries(type(vessel))
    if getattr(vessel, "name", ""):
        return {}  # a vessel of the library is complete
    equal = [name for name, (value, paper) in _beside_the_papers(vessel).items() if value == paper != 0.0]
    return {name: f"{name} = {entries[name].default:g} {entries[name].unit}" for name in equal}


def inherited(vessel: object) -> str:
    """A sentence on the hull data that another ship has in common with the paper's ship; empty where there are none."""
    names = kept(vessel).values() if another_ship(vessel) else ()
    return f"the paper's ship's values remain in {', '.join(f'vessel.{name}' for name in names)}" if names else ""


def _beside_the_papers(vessel: object) -> dict[str, tuple[float, float]]:
    """Hull data with the paper's values, by name; flags describe no hull; infinity, 0 and what is not declared are none."""
    values = schema.flatten(vessel)
    papers = {name: entry.default for name, entry in schema.entries(type(vessel)).items()}
    return {
        name: (value, paper)
        for name, paper in papers.items()
        if isinstance(paper, float) and paper > 0.0 and math.isfinite(paper) and isinstance(value := values[name], float)
    }


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
