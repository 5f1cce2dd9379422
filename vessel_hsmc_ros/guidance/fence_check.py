"""Whether goals and planned ways stay within a fence, before they are sailed."""

from collections.abc import Sequence

import numpy as np

from vessel_hsmc_ros.core.fence import Fence, Places, allowed, distances
from vessel_hsmc_ros.guidance.planned_track import PlannedTrack

POINTS = 1000  # of a stretch between two stops that are compared with the fence
BLOCK = 100  # of them at once


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


def track_leaving(fence: Fence, track: PlannedTrack) -> str:
    """As `leaving`, of a planned way with its turns; a turn counts to the leg before it."""
    for one in track.stretches:
        ends = np.cumsum([element.length for element in one.route.elements])
        s = np.linspace(0.0, float(ends[-1]), POINTS)
        index = np.minimum(np.searchsorted(ends, s[1:]), len(ends) - 1)
        legs = np.maximum.accumulate(np.array([element.leg for element in one.route.elements])[index]) + 1
        if found := leaving(fence, one.route.position(s), legs.tolist()):
            return found
    return ""
