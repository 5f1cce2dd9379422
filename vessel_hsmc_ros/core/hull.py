"""Dimensions of the hull and its outline, to draw a ship to scale; the equations of motion contain no dimensions.

LENGTH is that of the 118 t ship whose coefficients the paper uses. BEAM is ours: with a draught of 1.3 m, a slender monohull
of these dimensions has the displacement that the paper's inertia implies. The wave loads use the same dimensions.

Hull data default to the paper's ship, so a ship that is described only in part keeps some of its values: `another_ship` and
`kept` find them.

The yaw moment that an outboard, a jet or a rudder has: it depends on thrust and on speed.

| symbol | meaning | unit |
|---|---|---|
| X, X_max | surge force and its limit | N |
| N_max | yaw moment at full thrust | N·m |
| s | share of it that is lost without thrust and way: 1 for an outboard, 0 for two propellers side by side | - |
| u, u_0 | surge speed, and that at which the rudder alone gives the full moment | m/s |

    |N| <= N_max·min(1, 1 - s + s·|X|/X_max + (u/u_0)²)

The thrust that is turned, or that blows at a rudder, gives a part in proportion to X; the flow at a rudder one with the square of
the speed, of which an outboard has none (u_0 infinite).
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kernel import Array, between, clip, kernel
from vessel_hsmc_ros.core.schema import parameter

LARGEST_BOOST = 0.3  # share of X_max up to which a law gives thrust for the sake of steering


def steering_loss() -> float:
    """Declare s; 0 by default."""
    return parameter(
        0.0,
        "Share of yaw_moment_limit that is lost without thrust and way: 1 for an outboard, less with a rudder behind a propeller"
        " that idles; 0: none, as with two propellers side by side.",
        low=0.0,
        high=1.0,
    )


def steering_speed() -> float:
    """Declare u_0; infinite by default."""
    return parameter(
        math.inf,
        "With steering_loss, the surge speed at which a rudder gives the full yaw moment without thrust; inf: no rudder.",
        unit="m/s",
        low=1e-3,
        high=math.inf,
    )


class Steering(NamedTuple):
    """The constants of the yaw moment."""

    loss: float  # s
    speed: float  # u_0, m/s
    # force, moment: X_max, N, and N_max, N·m
    force: float
    moment: float


def steering(loss: float, speed: float, force: float, moment: float) -> Steering:
    """The constants, in the order of their fields. Raises ParameterError if a loss has no limits to refer to."""
    if loss and not (math.isfinite(force) and math.isfinite(moment) and force > 0.0):
        raise ParameterError(
            f"steering_loss must be 0 without finite surge_force_limit and yaw_moment_limit (got {loss:g}, {force:g} N and"
            f" {moment:g} N·m)"
        )
    return Steering(loss, speed, force, moment)


@kernel
def moment_limit(force: float, u: float, s: Steering) -> float:
    """The largest yaw moment with a surge force, N, at a surge speed, m/s; N·m."""
    way = u / s.speed
    return s.moment * min(1.0, 1.0 - s.loss + s.loss * abs(force) / s.force + way * way)


@kernel
def available(force: float, moment: float, u: float, s: Steering) -> float:
    """The yaw moment of a demand that there is with a surge force at a surge speed."""
    return moment if s.loss == 0.0 else clip(moment, moment_limit(force, u, s))


@kernel
def steered(demand: tuple[float, float], u: float, s: Steering) -> tuple[float, float]:
    """The demand of a law that can be had: with as much thrust as its moment needs, and at most the moment of that thrust.

    Thrust for steering is at most LARGEST_BOOST, in the direction of the demand, ahead without one: without it a vessel at rest
    would never turn. `demand`: surge force, N, and yaw moment, N·m. `u`: surge speed, m/s.
    """
    if s.loss == 0.0:
        return demand
    way, size = u / s.speed, abs(demand[0])
    needed = s.force * (abs(demand[1]) / s.moment - (1.0 - s.loss) - way * way) / s.loss
    size = between(needed, size, max(size, LARGEST_BOOST * s.force))
    force = -size if demand[0] < 0.0 else size
    return force, clip(demand[1], moment_limit(force, u, s))


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

    Returns corners counter-clockwise from the starboard quarter, (7, 2) m.
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
