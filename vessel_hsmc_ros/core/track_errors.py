"""Distances of a ship from planned legs and turns: per leg, and as metrics of a run."""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

NO_LEG = -1  # number of the leg while the plan is on none: before it begins, in turns on the spot, and at rest after the last


class TrackErrors(NamedTuple):
    """Errors of a run against the geometry of its plan, one row per sample."""

    # number of the leg that the plan is on, or of the leg before the turn, from 0 on; NO_LEG where it is on none, (n,)
    leg: NDArray[np.int64]
    turn: NDArray[np.bool_]  # whether the plan is in a turn, (n,)
    cross: Array  # cross-track error, positive to port of the line, (n,) m; NaN where the plan is on no leg
    along: Array  # along-track error, positive ahead of the plan, (n,) m; NaN likewise

    def where(self, mask: NDArray[np.bool_]) -> "TrackErrors":
        """The errors of some samples."""
        return TrackErrors(self.leg[mask], self.turn[mask], self.cross[mask], self.along[mask])


Passed = Mapping[int, tuple[float, float]]
"""Of each leg, by its number from 0 on: the length that was passed near enough, and its length, m."""


def missed(legs: Passed) -> float | None:
    """The share of the length of some legs that was not passed; None without legs."""
    near, whole = (sum(leg[i] for leg in legs.values()) for i in (0, 1))
    return max(0.0, 1.0 - near / whole) if whole else None


class LegErrors(NamedTuple):
    """Errors of a leg: its number, from 0 on, rms and largest cross-track error and rms along-track error, m."""

    leg: int
    cross_rms: float
    cross_peak: float
    along_rms: float


class TrackMetrics(NamedTuple):
    """Errors over all legs and turns, m; None without a sample."""

    leg_cross_track_rms: float | None = None
    leg_cross_track_peak: float | None = None
    leg_along_track_rms: float | None = None
    turn_cross_track_rms: float | None = None


def per_leg(errors: TrackErrors) -> Iterator[LegErrors]:
    """The errors of each leg that has samples."""
    straight = errors.where((errors.leg != NO_LEG) & ~errors.turn)
    for leg in np.unique(straight.leg):
        one = straight.where(straight.leg == leg)
        yield LegErrors(int(leg), _rms(one.cross), float(np.max(np.abs(one.cross))), _rms(one.along))


def summarise(errors: TrackErrors | None) -> TrackMetrics:
    """The errors over all legs, and in turns; every sample weighs the same."""
    if errors is None:
        return TrackMetrics()
    on = errors.leg != NO_LEG
    legs, turns = errors.where(on & ~errors.turn), errors.where(on & errors.turn)
    turned = _rms(turns.cross) if len(turns.cross) else None
    if not len(legs.cross):
        return TrackMetrics(turn_cross_track_rms=turned)
    return TrackMetrics(_rms(legs.cross), float(np.max(np.abs(legs.cross))), _rms(legs.along), turned)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
