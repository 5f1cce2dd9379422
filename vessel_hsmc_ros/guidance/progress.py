"""How far a vessel has come along waypoints: the leg that it is on, and the way that is left.

Leg k leads to waypoint k. It is completed where the vessel crosses the line that halves the corner at its end, within half of the
shorter of the two legs there, which is as much as a corner may cut. Of waypoints that are close together some may be passed by.
"""

from collections.abc import Sequence

import numpy as np

BACK = 0.5  # length of the sum of two directions below which the second leads back along the first
CUT = 0.5  # share of the shorter leg within which a vessel passes a waypoint
WINDOW = 4.0  # way beyond the present waypoint within which later ones may be passed by, in terms of `room`


class Progress:
    """The way along waypoints.

    `start`: where leg 1 begins, m. `points`: the waypoints, at least one, m. `room`: distance within which a waypoint counts as
    passed however short its legs are, m.

    Attributes:
        leg: Number of the present leg, from 1 on.
    """

    def __init__(self, start: complex, points: Sequence[complex], room: float) -> None:
        line = np.array([start, *points])
        self._points, self._room, self.leg = line, room, 1
        lengths = np.abs(np.diff(line))
        # A leg without a length has the direction 0: a vessel that is near has passed it.
        directions = np.diff(line) / np.where(lengths > 0.0, lengths, 1.0)
        across = directions[:-1] + directions[1:]
        self._across = np.where(np.abs(across) > BACK, across, directions[:-1])
        self._rooms = np.maximum(room, CUT * np.minimum(lengths[:-1], lengths[1:]))
        self._left = np.concatenate((np.cumsum(lengths[::-1])[::-1], [0.0]))  # way from each point to the end

    @property
    def legs(self) -> int:
        """Number of legs."""
        return len(self._points) - 1

    def advance(self, position: complex) -> None:
        """Note where the vessel is, m."""
        while self.leg < self.legs:
            k = self.leg
            last = int(np.searchsorted(-self._left, WINDOW * self._room - self._left[k], side="right"))
            near = slice(k, max(k + 1, min(last, self.legs)))
            d = position - self._points[near]
            crossed = (d * np.conj(self._across[k - 1 : near.stop - 1])).real >= 0.0
            passed = np.flatnonzero(crossed & (np.abs(d) <= self._rooms[k - 1 : near.stop - 1]))
            if not len(passed):
                return
            self.leg = k + int(passed[-1]) + 1

    def distance_left(self, position: complex) -> float:
        """The way from a position to the end: to the waypoint of the present leg, and along the legs after it, m."""
        return float(abs(self._points[self.leg] - position) + self._left[self.leg])

    def distance_to_end(self, position: complex) -> float:
        """The distance of a position from the end, m."""
        return float(abs(self._points[-1] - position))
