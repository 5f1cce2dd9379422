"""Fences: polygons to stay in or to stay out of, in metres, and how far a way keeps from their sides.

Guidance and safety layer use the same ones. A list of numbers holds several polygons: each ends with its first corner. Places are
complex numbers x + i·y.
"""

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.schema import parameter

Places = NDArray[np.complex128]

CIRCLE_CORNERS = 64  # of the polygon within the largest distance from home: it is at most 0.2 % smaller than the circle
BLOCK = 100  # stretches of a way that are compared with the sides at once
MAX_CORNERS = 2000  # of all polygons together: the distance of a way from them takes some 0.1 ms per 500


def corners(description: str) -> tuple[float, ...]:
    """Declare polygons, none by default."""
    ending = "x, y of each corner; each polygon ends with its first corner. Empty: none."
    return parameter((), f"{description}: {ending}", unit="m", low=-1e6, high=1e6)


@dataclass(frozen=True)
class FenceParameters:
    """Where the vessel may be; anywhere by default."""

    inside: tuple[float, ...] = corners("Areas to stay in, of several in all of them")
    outside: tuple[float, ...] = corners("Areas to stay out of")
    home: tuple[float, ...] = parameter(
        (0.0, 0.0), "x, y from which home_distance counts.", unit="m", low=-1e6, high=1e6, length=2
    )
    home_distance: float = parameter(math.inf, "Largest distance from home; inf: any.", unit="m", low=0.1, high=math.inf)


class Fence(NamedTuple):
    """Polygons, by their sides."""

    begin: Places  # first corner of each side, (n,)
    end: Places  # second corner
    polygon: NDArray[np.int64]  # number of the polygon of each side
    inside: NDArray[np.bool_]  # whether to stay inside each polygon, (m,)

    def rings(self) -> list[Places]:
        """The corners of each polygon."""
        return [self.begin[self.polygon == k] for k in range(len(self.inside))]


def fence_of(p: FenceParameters, name: str) -> Fence | None:
    """The fence that parameters describe; None for none. `name`: of the group of parameters, for error messages."""
    found = [(ring, True) for ring in _rings(p.inside, f"{name}.inside")]
    found += [(ring, False) for ring in _rings(p.outside, f"{name}.outside")]
    if math.isfinite(p.home_distance):
        angles = [2.0 * math.pi * k / CIRCLE_CORNERS for k in range(CIRCLE_CORNERS)]
        found.append((np.array([complex(*p.home) + cmath.rect(p.home_distance, angle) for angle in angles]), True))
    if not found:
        return None
    if sum(len(ring) for ring, _ in found) > MAX_CORNERS:
        raise ParameterError(f"{name} must have at most {MAX_CORNERS} corners (got {sum(len(ring) for ring, _ in found)})")
    rings = [ring for ring, _ in found]
    number = np.repeat(np.arange(len(rings)), [len(ring) for ring in rings])
    following = np.concatenate([np.roll(ring, -1) for ring in rings])
    return Fence(np.concatenate(rings), following, number, np.array([inside for _, inside in found]))


def _rings(numbers: tuple[float, ...], name: str) -> list[Places]:
    """The polygons of a list of numbers, without the corner that closes them."""
    if len(numbers) % 2:
        raise ParameterError(f"{name} must have x and y of each corner (got {len(numbers)} numbers)")
    found: list[Places] = []
    open_ring: list[complex] = []
    for place in map(complex, numbers[::2], numbers[1::2]):
        if open_ring and place == open_ring[0]:
            found.append(_checked(np.array(open_ring), f"{name}, polygon {len(found) + 1},"))
            open_ring = []
        else:
            open_ring.append(place)
    if open_ring:
        first = open_ring[0]
        raise ParameterError(
            f"{name}, polygon {len(found) + 1}, must end with its first corner, ({first.real:g}, {first.imag:g})"
            f" (got ({open_ring[-1].real:g}, {open_ring[-1].imag:g}))"
        )
    return found


def _checked(ring: Places, name: str) -> Places:
    if len(ring) < 3:
        raise ParameterError(f"{name} must have at least 3 corners (got {len(ring)})")
    n, following = len(ring), np.roll(ring, -1)
    apart = distances(ring, following, ring, following)
    index = np.arange(n)
    apart[index, index] = apart[index, (index + 1) % n] = apart[(index + 1) % n, index] = np.inf
    # Two sides that meet in a corner lie on each other where the second leads back along the first, or has no length.
    sides = following - ring
    back = (np.roll(sides, -1) * np.conj(sides)) / np.maximum(np.abs(sides) * np.abs(np.roll(sides, -1)), 1e-300)
    folded = np.flatnonzero((np.abs(sides) == 0.0) | (np.abs(back + 1.0) < 1e-9))
    if apart.min() <= 0.0 or len(folded):
        i, j = divmod(int(apart.argmin()), n) if apart.min() <= 0.0 else (int(folded[0]), (int(folded[0]) + 1) % n)
        p = ring[max(i, j)]
        raise ParameterError(
            f"{name} must not cross or touch itself (got sides {min(i, j) + 1} and {max(i, j) + 1}, near"
            f" ({p.real:g}, {p.imag:g}))"
        )
    return ring


def allowed(fence: Fence, place: complex) -> bool:
    """Whether a place is where the vessel may be."""
    a, b = fence.begin, fence.end
    span = (a.imag > place.imag) != (b.imag > place.imag)
    rise = np.where(span, b.imag - a.imag, 1.0)
    crossed = span & (place.real < (b.real - a.real) * (place.imag - a.imag) / rise + a.real)
    within = np.bincount(fence.polygon[crossed], minlength=len(fence.inside)) % 2 == 1
    return bool((within == fence.inside).all())


def clearance(fence: Fence, way: Places) -> float:
    """How far a way keeps from all sides, m; 0 or below if it leaves the fence: minus the distance where it begins outside."""
    nearest = float(distances(way[:-1], way[1:], fence.begin, fence.end).min())
    if allowed(fence, complex(way[0])):
        return nearest
    return -float(distances(way[:1], way[:1], fence.begin, fence.end).min())


def leaving(fence: Fence, way: Places, legs: Sequence[int]) -> str:
    """Which leg leaves a fence first, where, and how far the way goes outside; empty if it stays inside.

    `way`: places in their order, (n,) m. `legs`: number of the leg to each place from the second on, (n - 1,).
    """
    begins, ends = way[:-1], way[1:]
    blocks = range(0, len(begins), BLOCK)
    nearest = np.concatenate(
        [distances(begins[i : i + BLOCK], ends[i : i + BLOCK], fence.begin, fence.end).min(axis=1) for i in blocks]
    )
    outside = np.array([not allowed(fence, complex(p)) for p in way])
    wrong = np.flatnonzero((nearest <= 0.0) | outside[:-1] | outside[1:])
    if not len(wrong):
        return ""
    far = way[outside]
    apart = [float(distances(far[i : i + 1], far[i : i + 1], fence.begin, fence.end).min()) for i in range(len(far))]
    p, end = begins[wrong[0]], ends[wrong[0]]
    return (
        f"leg {legs[wrong[0]]} leaves the fence between ({p.real:.6g}, {p.imag:.6g}) and ({end.real:.6g}, {end.imag:.6g}) m,"
        f" by up to {max(apart, default=0.0):.1f} m"
    )


def distances(a: Places, b: Places, c: Places, d: Places) -> NDArray[np.float64]:
    """The distances of the ways from a to b, (m,), from those from c to d, (n,), as (m, n) m; 0 where they cross."""
    a, b, way, side = a[:, None], b[:, None], (b - a)[:, None], d - c
    found = np.minimum(
        np.minimum(from_ways(c, a, way), from_ways(d, a, way)), np.minimum(from_ways(a, c, side), from_ways(b, c, side))
    )
    of_side, of_way = (_side(way, c - a), _side(way, d - a)), (_side(side, a - c), _side(side, b - c))
    # A way through a corner crosses it; lines that coincide may still be apart.
    crossed = (of_side[0] * of_side[1] <= 0.0) & (of_way[0] * of_way[1] <= 0.0)
    return np.where(crossed & ((of_side[0] != of_side[1]) | (of_way[0] != of_way[1])), 0.0, found)


def _side(way: Places, point: Places) -> NDArray[np.float64]:
    """Sign of the side of a way on which a point lies; without products of small numbers, which vanish."""
    return np.sign((np.conj(way) * point).imag)


def from_ways(p: Places, a: Places, way: Places) -> NDArray[np.float64]:
    """The distances of points from the ways that begin at a."""
    squared = np.maximum((way * np.conj(way)).real, 1e-300)
    along = np.clip(((p - a) * np.conj(way)).real / squared, 0.0, 1.0)
    return np.abs(p - a - along * way)
