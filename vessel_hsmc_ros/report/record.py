"""One run as a report shows it: its arrays, its metrics, its planned legs and its provenance.

A report reads everything from a `Run`, simulated or recorded. NaN marks quantities that a bag does not contain.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.laws import LAWS
from vessel_hsmc_ros.core.metrics import (
    NOISE_PEAK,
    Metrics,
    Passed,
    Run,
    TrackErrors,
    commanded,
    evaluate,
    held,
    missed,
    per_leg,
    position_error,
    recorded,
    reversals_per_second,
    rms,
    settling_bound,
    settling_time,
)
from vessel_hsmc_ros.core.quantities import in_noise, number, quantity
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.guidance.factory import PLANNED, track_of
from vessel_hsmc_ros.guidance.planned_track import PlannedTrack, clock, leg_count, passed_legs, track_errors
from vessel_hsmc_ros.guidance.waypoints import Point
from vessel_hsmc_ros.plant.hull_parameters import bounded, outside
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


def on_legs(run: Run, track: PlannedTrack | None, running: Array, until: float = np.inf) -> tuple[TrackErrors | None, Passed]:
    """Errors against the planned legs and turns, None without any, and how much of each leg was passed; both until a time, s.

    `running`: times of its samples since the reference began, without pauses, (n,) s.
    """
    if track is None:
        return None, {}
    part, at = run.time <= until, clock(track, running, run.reference)
    errors = track_errors(track, at, run.state[:, :2])
    return errors.where(part), passed_legs(track, float(at[part][-1]), run.state[part, :2])


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
    track_errors: TrackErrors | None = None  # errors against the planned legs and turns; None without any
    passed: Passed = field(default_factory=dict)  # how much of each leg was passed near enough; none without a plan

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
    track = track or planned(scenario)
    return _of_legs(run, scenario, marks, until, *on_legs(run, track, running_time(run.time, marks), until))


def _of_legs(
    run: Run, scenario: Scenario | None, marks: Sequence[Mark], until: float, errors: TrackErrors | None, legs: Passed
) -> Metrics | None:
    """The metrics of a run whose errors against its legs, and how much it passed of each, are known; as `measured`."""
    wrench, command = run.wrench, commanded(run)
    if not recorded(wrench) and command is not None:
        wrench = held(*command, run.time)
    if not recorded(run.reference) or not recorded(wrench):
        return None
    part = run.time <= until
    found = evaluate(
        running_time(run.time, marks)[part],
        run.state[part],
        run.reference[part],
        wrench[part],
        commanded=None if command is None else command[1][command[0] <= until],
        limits=bounds(scenario),
        hull_length=hull_length(scenario),
        track=errors,
    )
    return found if errors is None else found._replace(legs_missed=missed(legs))


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
    shared = min(ends, default=0.0)
    if not records or shared == max(ends) or all(record.facts.get("metrics_interval") == shared for record in records):
        return list(records)
    return [
        replace(
            record,
            metrics=measured(record.run, record.scenario, record.marks, shared, record.track) if record.metrics else None,
            facts={**record.facts, "run_duration": record.duration, "metrics_interval": shared},
        )
        for record in records
    ]


HEADING_LAWS = ("course", "pd")  # laws that control the heading only; their position error is no measure of them
MIN_DURATION = 10.0  # a shorter run is too short for a verdict, in units of sqrt(length/g), the time scale of a hull
GRAVITY = 9.81
TREND_SHARE, TREND_OVER_SCATTER = 0.05, 2.0
"""The error has a trend if a line through its second half rises or falls by this share of the mean error and by this multiple of
the rms distance of the error from the line, which two or more oscillations exceed."""

TURNED_DEG = 20.0  # heading error at the end from which on it is mentioned
NOTABLE = 0.01  # share of the time, or of the control periods, from which on saturation and missed periods are mentioned
MIN_DISTANCE, NOTABLE_LENGTHS = 1e-6, 1e-3
"""Distances, m and in lengths of the hull, below which no number is given: rounding of the computation, of no use on a ship."""

CHATTER_PER_SECOND, CHATTER_SHARE = 2.0, 0.05
"""A force chatters if it reverses more often than this and if it changes by this share of its range between two reversals."""


def analyse(name: str, run: Run, scenario: Scenario | None, marks: tuple[Mark, ...] = (), **known: Any) -> Record:
    """The record of a run with its metrics and its verdict; `known`: further fields, with the track if messages planned it."""
    track = known.pop("track") if "track" in known else planned(scenario)
    errors, legs = on_legs(run, track, running_time(run.time, marks))
    metrics = _of_legs(run, scenario, marks, np.inf, errors, legs)
    known |= {"track": track, "track_errors": errors, "passed": legs}
    return with_verdict(Record(name, run, metrics, scenario=scenario, marks=marks, **known))


def with_verdict(record: Record) -> Record:
    """The record with its verdict."""
    return replace(record, verdict=" ".join(_sentences(record)))


def _sentences(record: Record) -> Iterator[str]:
    if failure := record.provenance.get("failure"):
        yield f"The run failed after {quantity(record.duration, 's')}: {str(failure).rstrip('.')}."
    if record.metrics is None:
        yield "Without a recorded reference and wrench, the tracking cannot be judged."
        return
    yield _tracking(record, record.metrics)
    if remarks := [*_actuators(record, record.metrics), *_validity(record), *_losses(record)]:
        text = "; ".join(remarks)
        yield f"{text[0].upper()}{text[1:]}."


def _tracking(record: Record, metrics: Metrics) -> str:
    """One sentence on the tracking error."""
    run = record.run
    law = record.scenario.controller.law if record.scenario else ""
    if law in LAWS and law not in HEADING_LAWS and not LAWS[law].controller.tracks:
        return f"The law {law} follows no reference."
    if law in HEADING_LAWS:
        error = f"{quantity(metrics.heading_error_rms_deg, '°')} rms, {quantity(metrics.heading_error_final_deg, '°')} at the end"
        return f"The law controls the heading only: the heading error is {error}."
    if metrics.leg_cross_track_rms is not None:
        return _survey(record, metrics)
    distance = position_error(run.state, run.reference)
    length = hull_length(record.scenario)
    if record.duration < MIN_DURATION * np.sqrt(length / GRAVITY) or len(run.time) < MIN_DURATION:
        ends = f"from {quantity(float(distance[0]), 'm')} to {quantity(metrics.position_error_final, 'm')}"
        return f"The run of {quantity(record.duration, 's')} is too short to judge convergence: the position error goes {ends}."
    return _settled(record, metrics, distance, length)


def _settled(record: Record, metrics: Metrics, distance: Array, length: float) -> str:
    """Whether the error has settled, within a bound that no sensor noise makes impossible.

    No law can be expected to be more accurate than the positions that it is given: an rms error up to their standard deviation,
    and a largest error up to three of them, count as settled.
    """
    run, noise = record.run, position_noise(record)
    bound = settling_bound(float(distance[0]), length)
    mean, largest = metrics.position_error_rms_last_quarter, metrics.position_error_peak_last_quarter
    relative = f" ({in_noise(mean, noise)})" if noise > 0.0 else ""
    error = f"the position error is {_distance(mean)} rms in the last quarter{relative}, at most {_distance(largest)}"
    below = max(bound, NOISE_PEAK * noise)
    since = settling_time(running_time(run.time, record.marks), distance, below)
    if since is not None and largest <= below and mean <= max(bound, noise):
        keeps, when = "keeps station" if _resting(run) else "tracks the reference", f"after {quantity(since, 's')}"
        return (
            f"The ship {keeps}: {error}, and below {quantity(below, 'm')} {when if since else 'all the time'}{_heading(metrics)}."
        )
    not_yet = "does not keep station" if _resting(run) else "does not track the reference"
    return f"The ship {not_yet}: {error}, {_trend(run.time, distance)}{_heading(metrics)}."


def position_noise(record: Record) -> float:
    """Standard deviation of the positions that the law was given, m: of the simulated sensors, or on a boat as declared."""
    if record.scenario is None:
        return 0.0
    if recorded(record.run.unforced_acceleration):  # by a plant, which has sensors
        return record.scenario.vessel_sim.sensors.position_noise
    observer = record.scenario.controller.observer
    return observer.position_noise if observer.enabled else 0.0


def _survey(record: Record, metrics: Metrics) -> str:
    """One sentence on a path or survey, which is judged by its legs."""
    errors = record.track_errors
    rows = [] if errors is None else [*per_leg(errors)]
    worst = max(rows, key=lambda row: row.cross_peak, default=None)
    at_most = f", at most {_distance(metrics.leg_cross_track_peak or 0.0)}"
    where = f" on leg {worst.leg + 1}" if worst and len(rows) > 1 else ""
    length = hull_length(record.scenario)
    lengths = (metrics.leg_cross_track_rms or 0.0) / length if length else 0.0
    relative = f" ({number(lengths)} lengths)" if lengths >= NOTABLE_LENGTHS else ""
    turns = metrics.turn_cross_track_rms
    turned = f"; {_distance(turns)} rms in its turns" if turns is not None else ""
    total = 0 if record.track is None else leg_count(record.track)
    legs = f"{len(rows)} of its {total} legs" if len(rows) < total else f"its {total} legs" if total > 1 else "its leg"
    off = f"{_distance(metrics.leg_cross_track_rms or 0.0)} rms{relative} off the line"
    return f"On {legs} the ship is {off}{at_most}{where}{turned}{_missed(record, metrics)}."


def _missed(record: Record, metrics: Metrics) -> str:
    """What was not surveyed of the legs."""
    share = metrics.legs_missed or 0.0
    if share < NOTABLE or record.track is None:
        return ""
    rows = leg_rows(record)
    worst = max(rows, key=lambda row: row.missed)
    most = f", {quantity(worst.missed, '%')} of leg {worst.leg}" if len(rows) > 1 else ""
    near = quantity(record.track.near, "m")
    return f"; it missed {quantity(100.0 * share, '%')} of their length{most}, where it was never within {near}"


def _distance(value: float) -> str:
    """A distance; below a micrometre it is rounding of the computation, so no number is given."""
    return quantity(value, "m") if value >= MIN_DISTANCE else "less than 1 µm"


def _heading(metrics: Metrics) -> str:
    angle = metrics.heading_error_final_deg
    return f", with a heading error of {quantity(angle, '°')} at the end" if abs(angle) >= TURNED_DEG else ""


def _resting(run: Run) -> bool:
    """Whether the reference rests during the last quarter: station keeping."""
    last = run.reference[3 * len(run.reference) // 4 :, 3:5]
    return bool(np.max(np.hypot(*last.T)) < 1e-3)


def _trend(time: Array, distance: Array) -> str:
    """How the error changes in the second half of the run."""
    late = time >= 0.5 * (time[0] + time[-1])
    share, error = (time[late] - time[late][0]) / np.ptp(time[late]), distance[late]
    line = np.polyfit(share, error, 1)
    change, scatter = float(line[0]), rms(error - np.polyval(line, share))
    if abs(change) < max(TREND_SHARE * float(np.mean(error)), TREND_OVER_SCATTER * scatter):
        return "and neither grows nor decreases"
    return f"and {'grows' if change > 0.0 else 'still decreases'} by {quantity(abs(change), 'm')} in the second half of the run"


def _actuators(record: Record, metrics: Metrics) -> Iterator[str]:
    """Remarks on saturation and chattering."""
    run, calmed = record.run, _calmed_by(record)
    command = commanded(run) or (run.time, run.wrench)
    shares = metrics.surge_force_at_limit, metrics.yaw_moment_at_limit
    for i, (name, unit) in enumerate((("surge force", "N"), ("yaw moment", "N·m"))):
        share = shares[i] or 0.0
        if share >= NOTABLE:
            yield f"the {name} is at its limit {quantity(100.0 * share, '%')} of the time"
        found = _chatter(command[0], command[1][:, i])
        if found is not None:
            size = quantity(found[1], unit)
            yield f"the {name} chatters: it jumps by {size} on average, {number(found[0])} times per second{calmed}"


def _calmed_by(record: Record) -> str:
    """What reduces the chattering that the noise of the sensors causes; empty without noise."""
    if not (noise := position_noise(record)) or record.scenario is None:
        return ""
    name = "guided.velocity_noise" if record.scenario.controller.law == "guided" else "observer.position_noise"
    return f", as its positions have {quantity(noise, 'm')} of noise; a larger controller.{name} reduces it"


def _chatter(time: Array, values: Array) -> tuple[float, float] | None:
    """Reversals per second in the last quarter and the mean change between two of them; None for a smooth force."""
    if not recorded(values) or len(time) < 2:
        return None
    last = time >= time[0] + 0.75 * (time[-1] - time[0])
    per_second = reversals_per_second(time[last], values[last])
    if per_second <= CHATTER_PER_SECOND:
        return None
    size = float(np.sum(np.abs(np.diff(values[last])))) / (per_second * float(np.ptp(time[last])))
    return (per_second, size) if size >= CHATTER_SHARE * float(np.max(np.abs(values))) else None


def _validity(record: Record) -> Iterator[str]:
    """A remark on a velocity through the water for which the hull data do not hold."""
    if record.scenario is None or not bounded(ship := record.scenario.vessel_sim.vessel):
        return
    current, (psi, u, v, r) = record.scenario.vessel_sim.disturbance.current, record.run.state[:, 2:].T
    c, s = np.cos(psi), np.sin(psi)
    through_water = u - current.east * c - current.north * s, v - current.north * c + current.east * s, r
    largest, smallest = ([float(extreme(values)) for values in through_water] for extreme in (np.max, np.min))
    if found := outside(ship, largest) or outside(ship, smallest):
        yield f"the ship has {found}"


def _losses(record: Record) -> Iterator[str]:
    """Remarks on what was lost: control periods, messages, the end of the bag."""
    missed, steps = record.facts.get("missed_periods") or 0, len(record.run.control.get("time", ()))
    if missed and missed >= NOTABLE * (missed + steps):
        yield f"{missed} of {missed + steps} control periods were missed"
    if dropped := record.facts.get("messages_dropped"):
        yield f"the recorder dropped {dropped} messages"
    if late := record.provenance.get("joined_late"):
        yield f"the recorder joined late and missed {late}"
    if "state" in record.provenance:
        yield "the bag was cut off"
