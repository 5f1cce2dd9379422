"""One run as a report shows it: its arrays, its metrics, its planned legs and its provenance.

A report reads everything from a `Run`, simulated or recorded. NaN marks quantities that a bag does not contain.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.metrics import Metrics, Passed, TrackErrors, evaluate, missed, per_leg
from vessel_hsmc_ros.core.run_data import Run, commanded, held, recorded
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.guidance.factory import PLANNED, track_of
from vessel_hsmc_ros.guidance.planned_track import PlannedTrack, clock, passed, track_errors
from vessel_hsmc_ros.guidance.waypoints import Point
from vessel_hsmc_ros.scenario.scenario import Scenario

Paths = Sequence[tuple[float, Sequence[Point]]]  # waypoints that were set by messages, with their times, s


Array = NDArray[Any]


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

    `running`: times of its samples since the reference began, without pauses, (n,) s.
    """
    return None if track is None else track_errors(track, clock(track, running, run.reference), run.state[:, :2])


class LegRow(NamedTuple):
    """A row of the table of the legs: number from 1 on, its errors, m, and the share of its length that was missed, %."""

    leg: int
    cross_rms: float
    cross_peak: float
    along_rms: float
    missed: float


def leg_rows(record: "Record") -> list[LegRow]:
    """The table of the legs."""
    errors, legs = record.track_errors, record.passed
    shares = {leg: missed({leg: lengths}) for leg, lengths in legs.items()}
    rows = [] if errors is None else per_leg(errors)
    return [LegRow(e.leg + 1, e.cross_rms, e.cross_peak, e.along_rms, 100.0 * (shares.get(e.leg) or 0.0)) for e in rows]


ORIGIN = ("scenario", "mode", "namespace", "seed", "started", "version", "git_commit", "host", "system", "python")
"""Keys of run.json that describe the origin of a run."""


WITHOUT_LIMITS = ("hierarchical_printed", "course", "pd")
"""The paper's own laws: they do not use the limits of the vessel that they know."""


class Limit(NamedTuple):
    """A bound drawn at plus and minus its value, with whose bound it is."""

    value: float
    name: str


class Mark(NamedTuple):
    """An event of a run: what happened at a time, s."""

    time: float
    kind: str
    text: str


@dataclass(frozen=True)
class Record:
    """One run in a report."""

    name: str  # short label of the run
    run: Run
    metrics: Metrics | None = None  # None where there is no reference or no wrench to evaluate
    facts: Mapping[str, Any] = field(default_factory=dict)  # further measured values by their names in run.json
    scenario: Scenario | None = None  # None where the parameters are not known
    provenance: Mapping[str, Any] = field(default_factory=dict)  # code version, machine and time of the run, by label
    marks: tuple[Mark, ...] = ()  # events of the run in the order of their times
    verdict: str = ""  # one to three plain sentences on the result
    track: PlannedTrack | None = None  # the legs and turns that were planned; None where there are none

    @cached_property
    def track_errors(self) -> TrackErrors | None:
        """Errors against the planned legs and turns; None without any."""
        return errors_of(self.run, self.track, running_time(self.run.time, self.marks))

    @cached_property
    def passed(self) -> Passed:
        """How much of each leg was passed near enough; none without a plan."""
        if self.track is None:
            return {}
        running = clock(self.track, running_time(self.run.time, self.marks), self.run.reference)
        return passed(self.track, float(running[-1]), self.run.state[:, :2])

    @cached_property
    def limits(self) -> tuple[tuple[Limit, ...], tuple[Limit, ...]]:
        """Named limits of surge force [N] and yaw moment [N·m]; those of the actuators and of the law, if they are known."""
        return limits(self.scenario)

    @property
    def duration(self) -> float:
        """Time from the first to the last state, s."""
        return float(self.run.time[-1] - self.run.time[0])


def limits(scenario: Scenario | None) -> tuple[tuple[Limit, ...], tuple[Limit, ...]]:
    """Limits of surge force [N] and yaw moment [N·m], of the actuators and of the law, as far as they are finite."""
    return _limits(scenario, "surge_force_limit"), _limits(scenario, "yaw_moment_limit")


def _limits(scenario: Scenario | None, name: str) -> tuple[Limit, ...]:
    if scenario is None:
        return ()
    plant, controller = scenario.vessel_sim, scenario.controller
    # The plant has limits of its actuators and of its vessel; the tighter one applies.
    actuator = min(getattr(plant.actuators, name), getattr(plant.vessel, name))
    law = np.inf if controller.law in WITHOUT_LIMITS else getattr(controller.vessel, name)
    if actuator == law:
        return (Limit(law, "actuator and law"),) if np.isfinite(law) else ()
    return tuple(Limit(value, of) for value, of in ((actuator, "actuator"), (law, "law")) if np.isfinite(value))


def bounds(scenario: Scenario | None) -> tuple[float, float]:
    """The smallest limit of the surge force [N] and of the yaw moment [N·m]; infinite where there is none."""
    surge, yaw = (min((limit.value for limit in found), default=np.inf) for found in limits(scenario))
    return surge, yaw


def hull_length(scenario: Scenario | None) -> float:
    """Length of the hull, m; 0 where it is not known."""
    return 0.0 if scenario is None else scenario.vessel_sim.vessel.length


def measured(
    run: Run,
    scenario: Scenario | None = None,
    marks: Sequence[Mark] = (),
    until: float = np.inf,
    track: PlannedTrack | None = None,
) -> Metrics | None:
    """Evaluate the metrics of a run with the applied wrench, or with the commanded one where no other was recorded.

    `marks`: its events; the time of pauses does not count. `until`: end of the evaluated interval, s. Returns None without a
    reference or any wrench.
    """
    wrench, command = run.wrench, commanded(run)
    if not recorded(wrench) and command is not None:
        wrench = held(*command, run.time)
    if not recorded(run.reference) or not recorded(wrench):
        return None
    part, running = run.time <= until, running_time(run.time, marks)
    track = track or planned(scenario)
    legs = errors_of(run, track, running)
    found = evaluate(
        running[part],
        run.state[part],
        run.reference[part],
        wrench[part],
        commanded=None if command is None else command[1][command[0] <= until],
        limits=bounds(scenario),
        hull_length=hull_length(scenario),
        track=None if legs is None else legs.where(part),
    )
    if track is None:
        return found
    until_then = float(clock(track, running, run.reference)[part][-1])
    return found._replace(legs_missed=missed(passed(track, until_then, run.state[part, :2])))


def running_time(time: Array, marks: Sequence[Mark]) -> Array:
    """Times (n,) without the pauses before them, s."""
    running = time
    for begin, end in _pauses(marks):
        running = running - np.clip(time - begin, 0.0, end - begin)
    return running


def control_intervals(run: Run, marks: Sequence[Mark]) -> tuple[Array, Array]:
    """Ends (n,) and lengths (n,) of the intervals between control steps, s; without those that a pause interrupts."""
    times = run.control.get("time", np.empty(0))
    if "compute_time" not in run.control or len(times) < 2:  # commands alone do not give the times of the law
        return np.empty(0), np.empty(0)
    running = np.ones(len(times) - 1, bool)
    for begin, end in _pauses(marks):
        running &= (times[1:] < begin) | (times[:-1] > end)
    return times[1:][running], np.diff(times)[running]


def _pauses(marks: Sequence[Mark]) -> Iterator[tuple[float, float]]:
    """Begin and end of each pause, s; the last one may have no end."""
    begin: float | None = None
    for mark in marks:
        if mark.kind == "pause" and begin is None:
            begin = mark.time
        elif mark.kind == "resume" and begin is not None:
            yield begin, mark.time
            begin = None
    if begin is not None:
        yield begin, np.inf


def over_shared_interval(records: Sequence[Record]) -> list[Record]:
    """Evaluate the metrics of runs of different duration over the interval that all of them cover.

    A run that lasts longer has more time to converge or diverge, so metrics over whole runs would not be comparable. Returns
    the records; if their durations differ, with metrics of the shared interval, and the interval among their facts.
    """
    ends = [float(record.run.time[-1]) for record in records]
    if not records or min(ends) == max(ends):
        return list(records)
    shared = min(ends)
    return [
        replace(
            record,
            metrics=measured(record.run, record.scenario, record.marks, shared, record.track) if record.metrics else None,
            facts={**record.facts, "run_duration": record.duration, "metrics_interval": shared},
        )
        for record in records
    ]
