"""The planned legs of a run, and its errors against them."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.run_data import Run
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.core.track_errors import TrackErrors, per_leg
from vessel_hsmc_ros.reference.factory import PLANNED, track_of
from vessel_hsmc_ros.reference.path_parameters import Point
from vessel_hsmc_ros.reference.planned_track import PlannedTrack, track_errors
from vessel_hsmc_ros.scenario.scenario import Scenario

Array = NDArray[np.float64]

Paths = Sequence[tuple[float, Sequence[Point]]]
"""Waypoints that were set by messages, with their times, s."""


def has_legs(scenario: Scenario | None) -> bool:
    """Whether the reference plans a geometry."""
    return scenario is not None and scenario.reference_ship.mode in PLANNED


def planned(scenario: Scenario | None, paths: Paths = ()) -> PlannedTrack | None:
    """The geometry that the reference of a scenario plans; None where there is none."""
    if scenario is None or not has_legs(scenario):
        return None
    p = scenario.reference_ship
    track = track_of(p, RateGrid(p.rate_hz).period, paths)
    return track if track and track.stretches else None


def errors_of(run: Run, track: PlannedTrack | None, running: Array) -> TrackErrors | None:
    """Errors against the planned legs and turns; None without any.

    Args:
        run: The run.
        track: The plan.
        running: Times of its samples since the reference began, without pauses, (n,) s.
    """
    return None if track is None else track_errors(track, running, run.state[:, :2])


def leg_rows(errors: TrackErrors | None) -> list[tuple[int, float, float, float]]:
    """The table of the legs: number from 1 on, rms and largest cross-track error and rms along-track error, m."""
    return [] if errors is None else [(leg + 1, *rest) for leg, *rest in per_leg(errors)]  # type: ignore[misc]
