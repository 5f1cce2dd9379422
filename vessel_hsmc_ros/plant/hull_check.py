"""Checks of hull data before a run: damping must take energy from the ship, nu'·D(nu)·nu >= 0, at the speeds for which it holds.

| symbol | meaning | unit |
|---|---|---|
| nu | u, v, r, relative to the water | m/s, m/s, rad/s |
| P | nu'·D(nu)·nu, the power that damping takes | W |
| E | (m11·u² + m22·v² + m33·r²)/2 | J |

Two defects are errors: an axis on its own that gains energy, and, where no range of speeds is declared, a gain at ever larger
speeds, because then the motion has no bound. A gain by cross terms at some speeds only is a warning: several published hulls have
it, CyberShip II among them, and their motions stay bounded.
"""

import functools
import itertools
import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.plant.dynamics import ShipParameters, Vessel, damping_force

SHARES = ((1.0, 1e3), (0.3, 30.0), (0.1, 1.0), (0.03, 0.1), (0.01, 0.01))
"""Sampled boxes: shares of a declared range, and speeds [m/s] where none is declared, the largest first."""

HALF = 8  # samples of an axis in a box on each side of 0
ROUNDING = 1e-12  # a power is negative below this share of the sum of its terms' magnitudes
AXES = (
    ("surge", "surge_speed_range", "u", "m/s"),
    ("sway", "sway_speed_range", "v", "m/s"),
    ("yaw", "yaw_rate_range", "r", "rad/s"),
)
"""Name, parameter of the range, symbol and unit of each velocity."""


class Gain(NamedTuple):
    """The speeds at which damping adds energy fastest, and the rate -P/E at which it does, 1/s."""

    # u, v, r: velocities, m/s, m/s, rad/s
    u: float
    v: float
    r: float
    rate: float  # -P/E, 1/s
    unbounded: bool  # whether it also adds energy at the largest sampled speeds of a ship without declared ranges

    def __str__(self) -> str:
        return f"u = {self.u:.3g} m/s, v = {self.v:.3g} m/s, r = {self.r:.3g} rad/s"


def check_hull(ship: ShipParameters, owner: str = "vessel_sim") -> None:
    """Check the ranges of speeds and the damping of a hull.

    `owner`: the node that they belong to, for the error message. Raises ParameterError if a range does not contain 0; damping
    adds energy along an axis, or at ever larger speeds.
    """
    for axis in AXES:
        _check_axis(ship, owner, *axis)
    gain = largest_gain(ship)
    if gain is not None and gain.unbounded:
        raise ParameterError(
            f"{owner}.vessel: the cross terms of the damping add energy without bound, as at {gain}: change them, or declare the"
            f" speeds for which they hold as {', '.join(name for _, name, _, _ in AXES)}"
        )


def _check_axis(ship: ShipParameters, owner: str, axis: str, name: str, symbol: str, unit: str) -> None:
    low, high = getattr(ship, name)
    if not low <= 0.0 <= high or low == high:
        raise ParameterError(f"{owner}.vessel.{name} must contain 0 and other speeds (got [{low:g}, {high:g}])")
    speed = negative_damping(ship, axis, max(-low, high))
    if speed is not None:
        raise ParameterError(
            f"{owner}.vessel.{axis}_damping with its quadratic and cubic terms adds energy from {symbol} = {speed:.3g} {unit}"
            f" on: make them non-negative, or declare the speeds for which they hold as {name}"
        )


def hull_warning(ship: ShipParameters) -> str:
    """A sentence on cross terms that add energy at some speeds; empty where damping takes energy at all speeds."""
    gain = largest_gain(ship)
    if gain is None:
        return ""
    return f"the damping of vessel adds energy at {gain}, at {gain.rate:.2g} 1/s: its cross terms outweigh the others there"


def negative_damping(ship: ShipParameters, axis: str, largest: float) -> float | None:
    """The speed from which on the damping of an axis is negative; None for an axis that always damps.

    `axis`: surge, sway or yaw. `largest`: largest speed of interest, in m/s or rad/s; infinite for none.
    """
    linear, quadratic, cubic = (float(getattr(ship, f"{axis}_damping{power}")) for power in ("", "_quadratic", "_cubic"))
    if linear >= 0.0 and quadratic >= 0.0 and cubic >= 0.0:
        return None
    # The damping linear + quadratic·a + cubic·a² changes its sign at its real positive roots only.
    roots = np.roots([cubic, quadratic, linear])  # which leaves out leading zeros
    positive = sorted(float(root.real) for root in roots if root.imag == 0.0 and root.real > 0.0)
    edges = [0.0, *(root for root in positive if root < largest), largest if math.isfinite(largest) else 1e9]
    for low, high in itertools.pairwise(edges):
        middle = 0.5 * (low + high)
        if linear + quadratic * middle + cubic * middle * middle < 0.0:
            return low
    return None


@functools.lru_cache(maxsize=64)
def largest_gain(ship: ShipParameters) -> Gain | None:
    """Sample the power of damping over the declared speeds, or over all up to 1000 m/s; None where it is never negative."""
    vessel = ship.coefficients()
    if not vessel.coupled:
        return None  # the power is the sum of those of the axes
    found, free = [], any(math.isinf(bound) for _, name, _, _ in AXES for bound in getattr(ship, name))
    for i, (u, v, r) in enumerate(_boxes(ship, vessel)):
        X, Y, N = damping_force(u, v, r, vessel)
        terms = np.array([u * X, v * Y, r * N])
        power, size = terms.sum(axis=0), np.abs(terms).sum(axis=0)
        energy = 0.5 * (vessel.m11 * u * u + vessel.m22 * v * v + vessel.m33 * r * r)
        rate = np.where(power < -ROUNDING * size, -power / np.maximum(energy, 1e-300), 0.0)
        k = int(np.argmax(rate))
        if rate[k] > 0.0:
            found.append(Gain(float(u[k]), float(v[k]), float(r[k]), float(rate[k]), free and i == 0))
    if not found:
        return None
    # The box of the largest speeds decides whether the gain has a bound; otherwise the fastest gain is the one to name.
    return found[0] if found[0].unbounded else max(found, key=lambda gain: gain.rate)


def _boxes(ship: ShipParameters, vessel: Vessel) -> Iterator[Array]:
    """Velocities on grids over boxes of decreasing size, shape (3, n)."""
    length = math.sqrt(vessel.m33 / vessel.m22)  # a radius of gyration: it makes a yaw rate of a speed
    for share, speed in SHARES:
        axes = []
        for (_, name, _, _), scale in zip(AXES, (speed, speed, speed / length), strict=True):
            low, high = (share * bound if math.isfinite(bound) else math.copysign(scale, bound) for bound in getattr(ship, name))
            axes.append(np.concatenate([np.linspace(low, 0.0, HALF + 1), np.linspace(0.0, high, HALF + 1)[1:]]))
        yield np.array(np.meshgrid(*axes, indexing="ij")).reshape(3, -1)


def bounded(ship: ShipParameters) -> bool:
    """Whether the hull data hold for some speeds only."""
    return any(math.isfinite(bound) for _, name, _, _ in AXES for bound in getattr(ship, name))


def outside(ship: ShipParameters, nu: Sequence[float]) -> str:
    """The first velocity that lies outside of its declared range, in words; empty if there is none.

    `nu`: u, v, r, relative to the water.
    """
    for (what, name, _, unit), value in zip(AXES, nu, strict=True):
        low, high = getattr(ship, name)
        if not low <= value <= high:
            kind = "rate" if what == "yaw" else "velocity"
            return f"a {what} {kind} of {value:.3g} {unit}, where the hull data hold from {low:g} to {high:g} {unit}"
    return ""
