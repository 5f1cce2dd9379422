"""The arrays of a run as tables, and its metrics: tracking errors, settling time, control effort, saturation, errors of legs.

All arrays have one row per sample: time (n,), state and reference (n, 6), wrench (n, 2). The columns of tables are in SI units
and radians; docs/report.md lists them. Quantities that were not recorded have no column.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.exceptions import InstallationError
from vessel_hsmc_ros.core.hull import LENGTH
from vessel_hsmc_ros.core.kernel import AT_LIMIT, Array

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


SETTLED_SHARE, SETTLED_LENGTHS = 0.05, (0.01, 0.1)
"""The position error has settled below 5 % of its initial value, at least 1 % and at most 10 % of the hull's length."""

NOISE_PEAK = 3.0  # largest error of noisy positions, in their standard deviations: larger ones are rare
UNLIMITED = (math.inf, math.inf)


class Metrics(NamedTuple):
    """Metrics of a run; in m, s, N and N·m, with the unit as a suffix where it is another."""

    position_error_rms: float
    position_error_rms_last_quarter: float
    position_error_final: float
    heading_error_rms_deg: float
    heading_error_final_deg: float
    surge_force_peak: float
    surge_force_rms: float
    yaw_moment_peak: float
    yaw_moment_rms: float
    position_error_peak_last_quarter: float
    settling_time: float | None = None  # None if the position error has not settled at the end
    # surge_force_at_limit, yaw_moment_at_limit: share of the time from 0 to 1; None without a limit
    surge_force_at_limit: float | None = None
    yaw_moment_at_limit: float | None = None
    # surge_force_travel, yaw_moment_travel: actuator travel, 1/min; None without a limit
    surge_force_travel: float | None = None
    yaw_moment_travel: float | None = None
    # leg_cross_track_rms, leg_cross_track_peak, leg_along_track_rms: errors against the planned legs; None without legs
    leg_cross_track_rms: float | None = None
    leg_cross_track_peak: float | None = None
    leg_along_track_rms: float | None = None
    turn_cross_track_rms: float | None = None  # likewise in the planned turns
    # share of the length of the planned legs that was not passed near enough, from 0 to 1; None without legs
    legs_missed: float | None = None


def position_error(state: Array, reference: Array) -> Array:
    """Distance between ship and reference, (n,) m."""
    return distance(state[:, :2] - reference[:, :2])


def distance(offset: Array) -> Array:
    """Lengths of horizontal vectors (n, 2), as `kinematics.magnitude`, (n,)."""
    x, y = offset[:, 0], offset[:, 1]
    length: Array = x * x
    length += y * y
    return np.sqrt(length, out=length)  # np.hypot, which scales, takes several times as long


def heading_error(state: Array, reference: Array) -> Array:
    """Heading minus desired heading, wrapped to (-pi, pi], (n,)."""
    return wrapped(state[:, 2] - reference[:, 2])


def wrapped(angle: Array) -> Array:
    """Angles mapped to (-pi, pi], as `kinematics.wrap` does it, (n,)."""
    turns: Array = angle - np.pi
    turns /= 2.0 * np.pi
    np.ceil(turns, out=turns)
    turns *= 2.0 * np.pi
    return np.subtract(angle, turns, out=turns)


def body_error(state: Array, reference: Array) -> Array:
    """Position error resolved in the body frame of the ship, forward and to port, (n, 2) m.

    e = R(psi)ᵀ·(p - p_d), with the heading psi of the ship. Unlike z_e of (11) it does not depend on the origin: its length is
    the position error.
    """
    dx, dy = state[:, 0] - reference[:, 0], state[:, 1] - reference[:, 1]
    c, s = np.cos(state[:, 2]), np.sin(state[:, 2])
    return np.column_stack([c * dx + s * dy, c * dy - s * dx])


def settling_bound(initial_error: float, hull_length: float) -> float:
    """The position error below which a ship has settled, m.

    5 % of the initial error, as is usual for a step response; within 1 % and 10 % of the hull's length, because a ship may
    start on its reference or far away from it. `initial_error`: position error at the start, m. `hull_length`: m; 0 where it is
    not known.
    """
    bound = SETTLED_SHARE * initial_error
    return min(max(bound, SETTLED_LENGTHS[0] * hull_length), SETTLED_LENGTHS[1] * hull_length) if hull_length else bound


def settling_time(time: Array, error: Array, bound: float) -> float | None:
    """Time after which an error stays within a bound, from the first sample on.

    `time`: times of the samples, (n,) s. `error`: the error, (n,). Returns 0 if it never exceeds the bound; None if the last
    sample does.
    """
    outside = np.flatnonzero(~(np.abs(error) <= bound))  # negated, so that NaN is outside
    if not len(outside):
        return 0.0
    return float(time[outside[-1] + 1] - time[0]) if outside[-1] + 1 < len(time) else None


def share_at_limit(wrench: Array, limit: float) -> float | None:
    """Share of the samples, from 0 to 1, at which a force or moment (n,) is at its limit or beyond; None without a limit."""
    return float(np.mean(np.abs(wrench) >= AT_LIMIT * limit)) if math.isfinite(limit) else None


def travel(time: Array, wrench: Array, limit: float) -> float | None:
    """Actuator travel: the sum of the changes |dtau| of a force or moment relative to its limit, per minute.

    From zero to the limit and back once a minute is a travel of 2 1/min. It is a measure of wear. `time`: times of the samples,
    (n,) s. `wrench`: force or moment, (n,). `limit`: its largest magnitude; infinite for none. Returns 1/min; 0 for a single
    sample, None without a limit.
    """
    if not math.isfinite(limit):
        return None
    changes = np.diff(wrench)
    minutes = float(time[-1] - time[0]) / 60.0
    return float(np.sum(np.abs(changes, out=changes))) / (limit * minutes) if minutes > 0.0 else 0.0


def rms(values: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def peak(values: Array) -> float:
    """Largest magnitude; NaN if any value is."""
    return max(abs(float(np.max(values))), abs(float(np.min(values))))


def evaluate(
    time: Array,
    state: Array,
    reference: Array,
    wrench: Array,
    *,
    commanded: Array | None = None,
    limits: tuple[float, float] = UNLIMITED,
    hull_length: float = LENGTH,
    track: TrackErrors | None = None,
) -> Metrics:
    """Compute all metrics of a run.

    Args:
        time: Times of the samples, (n,) s, n at least 1.
        state, reference: x, y, psi, u, v, r of ship and reference, (n, 6).
        wrench: Applied surge force [N] and yaw moment [N·m], (n, 2).
        commanded: Commanded wrench, (m, 2), whose time at its limits is evaluated; by default the applied one.
        limits: Limits of surge force [N] and yaw moment [N·m]; infinite for none.
        hull_length: Length of the hull, m, to which the settled error is relative.
        track: Errors against the planned legs; None without a plan.

    Returns:
        The metrics; every rms value weighs all samples equally, so the samples should be evenly spaced.
    """
    error = state[:, :3] - reference[:, :3]
    found = evaluate_errors(time, error, wrench, commanded=commanded, limits=limits, hull_length=hull_length)
    return found._replace(**summarise(track)._asdict())


def evaluate_errors(
    time: Array,
    error: Array,
    wrench: Array,
    *,
    commanded: Array | None = None,
    limits: tuple[float, float] = UNLIMITED,
    hull_length: float = LENGTH,
) -> Metrics:
    """Compute all metrics of a run from its errors.

    `time`: times of the samples, (n,) s, n at least 1. `error`: x, y, psi of the ship minus those of the reference, (n, 3); psi
    need not be wrapped. `wrench`, `commanded`, `limits`, `hull_length`: as in `evaluate`.
    """
    position, angle = distance(error), np.degrees(wrapped(error[:, 2]))
    # The last quarter represents the steady state, after the transient of the initial error has decayed.
    last_quarter = position[time >= time[0] + 0.75 * (time[-1] - time[0])]
    demand = wrench if commanded is None else commanded  # with a lag, the applied wrench approaches its limit without reaching it
    return Metrics(
        rms(position),
        rms(last_quarter),
        float(position[-1]),
        rms(angle),
        float(angle[-1]),
        peak(wrench[:, 0]),
        rms(wrench[:, 0]),
        peak(wrench[:, 1]),
        rms(wrench[:, 1]),
        float(np.max(last_quarter)),
        settling_time(time, position, settling_bound(float(position[0]), hull_length)),
        share_at_limit(demand[:, 0], limits[0]),
        share_at_limit(demand[:, 1], limits[1]),
        travel(time, wrench[:, 0], limits[0]),
        travel(time, wrench[:, 1], limits[1]),
    )


def reversals_per_second(time: Array, values: Array, after: float = 0.0) -> float:
    """How often a signal changes between rising and falling, per second: a measure of chattering.

    Samples at which the signal is constant, as between two control periods, are skipped. `time`: times of the samples, (n,) s.
    `values`: the signal, (n,). `after`: start of the evaluated interval, s. Returns changes of sign of the slope per second; 0
    for fewer than two samples.
    """
    evaluated = time >= after
    changes = np.diff(values[evaluated])
    signs = np.sign(changes[changes != 0.0])
    span = float(time[evaluated][-1] - time[evaluated][0]) if evaluated.any() else 0.0
    return float(np.count_nonzero(np.diff(signs))) / span if span > 0.0 else 0.0


if TYPE_CHECKING:
    from pandas import DataFrame


Stamps = NDArray[np.int64]


@dataclass(frozen=True)
class Run:
    """The time series of a run, one row per odometry message.

    Attributes:
        time: Time since the first odometry message, (n,) s.
        state: True x, y, psi, u, v, r of the ship, (n, 6); the heading in [-pi, pi].
        measured: x, y, psi, u, v, r as odometry shows them at the time, late or not, (n, 6); equal to the state where the
            sensors are perfect.
        reference: x, y, psi, u, v, r of the reference, (n, 6).
        wrench: Applied surge force [N] and yaw moment [N·m], (n, 2).
        disturbance: Disturbing accelerations, (n, 3), m/s², m/s², rad/s².
        unforced_acceleration: True f_u, f_v, f_r of (7), (n, 3), m/s², m/s², rad/s²; NaN where they are not recorded.
        control: Terms of the law by the field names of ControlState.msg, with one row per control period. Three more are
            `time`, (m,) s, `commanded`, the commanded wrench, (m, 2), and, where there is an observer, `estimate`, its
            x, y, psi, u, v, r, (m, 6). Weights are (m, k), NaN where the law was not computed.
    """

    time: Array
    state: Array
    measured: Array
    reference: Array
    wrench: Array
    disturbance: Array
    unforced_acceleration: Array
    control: dict[str, Array] = field(default_factory=dict)

    def to_dataframe(self) -> "DataFrame":
        """The motion as a pandas data frame, a row for each odometry message, indexed by time.

        Raises:
            InstallationError: pandas is not installed.
        """
        return _data_frame(motion_table(self))

    def control_dataframe(self) -> "DataFrame":
        """The terms of the law as a pandas data frame, a row for each of its updates, indexed by time.

        Raises:
            InstallationError: pandas is not installed.
        """
        return _data_frame(control_table(self))


def _data_frame(table: Mapping[str, Array]) -> "DataFrame":
    """Columns as a data frame with the index `time`, s."""
    try:
        from pandas import DataFrame
    except ModuleNotFoundError:
        raise InstallationError("data frames need pandas, which is not installed: pip install pandas") from None
    return DataFrame({"time": np.empty(0), **table}).set_index("time")


@dataclass(frozen=True)
class Published:
    """The content of all messages that plant, reference ship and controller publish in a run, unrounded and not wrapped."""

    stamp: Stamps  # of the plant's other messages and of the commands, (n,) ns
    measured_at: Stamps  # of the odometry, (n,) ns: the times of its measurements
    odometry: Array  # measured x, y, psi, u, v, r, (n, 6)
    truth: Array | None  # the true ones, (n, 6); None where the sensors are perfect
    command: Array  # surge force [N] and yaw moment [N·m] of the controller, (n, 2)
    applied: Array  # surge force, sway force [N] and yaw moment [N·m] of the actuators, (n, 3)
    disturbance: Array  # surge and sway force [N] and yaw moment [N·m], (n, 3)
    unforced_acceleration: Array  # f_u, f_v, f_r of (7), (n, 3), m/s², m/s², rad/s²
    reference_stamp: Stamps  # of the reference, (m,) ns
    # reference, reference_acceleration: its x, y, psi, u, v, r, (m, 6), and accelerations, (m, 3)
    reference: Array
    reference_acceleration: Array
    control_stamp: Stamps  # of the updates of the law, (k,) ns
    control: Mapping[str, Array]  # its terms by the field names of ControlState.msg, k rows each
    estimate: Array | None  # x, y, psi, u, v, r of the observer, (k, 6); None without one


Table = dict[str, NDArray[Any]]

MOTION = ("x", "y", "heading", "surge_velocity", "sway_velocity", "yaw_rate")
WRENCH = ("surge_force", "yaw_moment")
ACCELERATION = ("surge_acceleration", "sway_acceleration", "yaw_acceleration")
PAPER_ERRORS = {"surge_error": "paper_z1e", "sway_error": "paper_z2e", "heading_error": "paper_z3e"}
"""Columns of z_e (11): the names in ControlState.msg would be taken for errors in the body frame, which they are not."""


def motion_table(run: Run) -> Table:
    """A row for each state: time, state, measurement, reference, wrenches, accelerations, errors."""
    command = commanded(run)
    # Without sensor noise the measurements are the states: a second set of columns would only repeat them.
    noisy = not np.array_equal(run.measured, run.state)
    groups = (
        ("measured_", MOTION, run.measured if noisy else None),
        ("reference_", MOTION, run.reference),
        ("", WRENCH, run.wrench),
        ("commanded_", WRENCH, held(*command, run.time) if command else None),
        ("disturbance_", ACCELERATION, run.disturbance),
        ("unforced_", ACCELERATION, run.unforced_acceleration),
    )
    table: Table = {"time": run.time, **_columns("", MOTION, run.state)}
    for prefix, names, values in groups:
        if values is not None and recorded(values):
            table |= _columns(prefix, names, values)
    if recorded(run.reference):
        table["position_error"] = position_error(run.state, run.reference)
        table |= _columns("body_error_", ("x", "y"), body_error(run.state, run.reference))
        table["heading_error"] = heading_error(run.state, run.reference)
    return table


def control_table(run: Run) -> Table:
    """A row for each update of the law: the terms that it computes, but for the network weights, and the observer's estimate."""
    table: Table = {}
    for name, values in run.control.items():
        if name == "estimate":
            table |= _columns("estimated_", MOTION, values)
        elif values.ndim == 1 and recorded(values):
            error = name.removesuffix("_rate")
            table[PAPER_ERRORS.get(error, error) + name.removeprefix(error)] = values
    return table


def _columns(prefix: str, names: tuple[str, ...], values: Array) -> Table:
    return {prefix + name: column for name, column in zip(names, values.T, strict=True)}


def recorded(values: Array | None) -> bool:
    """Whether a quantity of a run was recorded, that is, contains anything but NaN."""
    return values is not None and bool(len(values)) and not np.isnan(values).all()


def held(times: Array, values: Array, at: Array) -> Array:
    """Sample-and-hold: the latest value at each of some times, the first value before that.

    `times`: sample times in any order, (n,). `values`: (n,) or (n, k). `at`: times to evaluate at, (m,), in the unit of
    `times`. Returns (m,) or (m, k).
    """
    if np.array_equal(times, at):
        return values
    order = np.argsort(times, kind="stable")  # stable: of equal times the last sample counts
    latest = np.searchsorted(times[order], at, side="right") - 1
    found: Array = values[order[np.clip(latest, 0, None)]]
    return found


def commanded(run: Run) -> tuple[Array, Array] | None:
    """Times and values of the commanded wrench, (m,) and (m, 2); None where it was not recorded."""
    values = run.control.get("commanded")
    return None if values is None or not recorded(values) else (run.control["time"], values)
