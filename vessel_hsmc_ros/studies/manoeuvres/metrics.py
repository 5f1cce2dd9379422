"""The metrics of the manoeuvres, as IMO resolution MSC.137(76) and its explanatory notes, MSC/Circ.1053, define them.

Lengths in m, times in s, speeds in m/s; angles in degrees and their rates in °/s, as the resolution gives them. A metric that the
manoeuvre has not reached is NaN; what grows without a bound is infinite. They are taken from the track from the execute on, seen
from the side of the first turn. The resolution measures from the midship point; here it is the origin of the hull's coordinates.
"""

from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.control.laws.manoeuvre import ManoeuvreParameters
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.metrics import Run
from vessel_hsmc_ros.scenario.scenario import Scenario


class Track(NamedTuple):
    """A manoeuvre; components to the side of the first turn are positive, so that a turn to starboard equals one to port."""

    time: Array  # since the execute, (n,) s
    # ahead, aside: distance along the original course and perpendicular to it, (n,) m
    ahead: Array
    aside: Array
    turned: Array  # change of heading, not wrapped, (n,) rad
    # u, v, r: velocities, (n,)
    u: Array
    v: Array
    r: Array
    # force, moment: the applied wrench, (n,)
    force: Array
    moment: Array
    command: Array  # the commanded yaw moment, (n,)

    def at(self, index: float) -> "Track":
        """The point between two rows, by linear interpolation, as arrays without dimension; NaN for an index of NaN."""
        rows = np.arange(len(self.time))
        return Track(*(np.asarray(np.interp(index, rows, values)) for values in self))

    @property
    def travelled(self) -> Array:
        """Length of the path, (n,) m."""
        steps = np.hypot(np.diff(self.ahead), np.diff(self.aside))
        return np.concatenate(([0.0], np.cumsum(steps)))


def track_of(run: Run, scenario: Scenario) -> Track:
    """The track of a simulated manoeuvre."""
    settings = scenario.controller.manoeuvre
    begin = round(settings.approach_time * scenario.controller.rate_hz)
    side = 1.0 if settings.side == "port" else -1.0
    x, y, _, u, v, r = run.state[begin:].T
    psi = np.unwrap(run.state[:, 2])
    course = psi[0]
    c, s = np.cos(course), np.sin(course)
    x, y = x - x[0], y - y[0]
    return Track(
        run.time[begin:] - run.time[begin],
        c * x + s * y,
        side * (c * y - s * x),
        side * (psi[begin:] - course),
        u.copy(),
        side * v,
        side * r,
        run.wrench[begin:, 0].copy(),
        side * run.wrench[begin:, -1],
        side * run.control["commanded"][begin:, 1],
    )


def crossing(values: Array, level: float) -> float:
    """The fractional index at which values first reach a level from below; NaN if they do not."""
    reached = np.flatnonzero(values >= level)
    if not len(reached):
        return np.nan
    i = int(reached[0])
    return float(i) if i == 0 else i - 1 + (level - values[i - 1]) / (values[i] - values[i - 1])


Metrics = dict[str, float]

STEADY_CHANGE = 0.01
"""A turn or a step is steady if the yaw rate or speed changes by less than this share of the largest one over its last fifth."""

RISEN = 0.95  # the rise time of the force ends at this share of its last value


def turning_circle(track: Track, _settings: ManoeuvreParameters) -> Metrics:
    """Advance and transfer at a change of heading of 90°, tactical diameter at 180°, and the steady turn at the end."""
    quarter, half, whole = (track.at(crossing(track.turned, np.radians(angle))) for angle in (90.0, 180.0, 360.0))
    u, v, r = track.u[-1], track.v[-1], track.r[-1]
    speed = float(np.hypot(u, v))
    found = {
        "advance": quarter.ahead,
        "transfer": quarter.aside,
        "tactical_diameter": half.aside,
        "steady_diameter": 2.0 * speed / r,
        "time_90": quarter.time,
        "time_180": half.time,
        "time_360": whole.time,
        "steady_speed": speed,
        "speed_loss": 100.0 * (1.0 - speed / np.hypot(track.u[0], track.v[0])),
        "steady_yaw_rate": np.degrees(r),
        # The angle from the velocity to the bow: positive where the bow points into the turn.
        "drift_angle": np.degrees(np.arctan2(-v, u)),
    }
    return {name: float(value) for name, value in found.items()}


def zigzag(track: Track, settings: ManoeuvreParameters) -> Metrics:
    """Overshoot angles after the second and third execute, the times to check the yaw, and the initial turning ability.

    They are infinite for a ship that goes on turning against its rudder.
    """
    executes = [0, *(np.flatnonzero(np.diff(np.sign(track.command))) + 1)]
    missing = np.inf if _is_unchecked(track, executes) else np.nan
    overshoots, checks = [missing, missing], [missing, missing]
    # Between an execute and the next the ship turns back; without a next one the overshoot may not be complete.
    for k, (begin, end) in enumerate(pairwise(executes[1:4])):
        turned = track.turned[begin:end] * (1.0 if k == 0 else -1.0)
        furthest = int(np.argmax(turned))
        overshoots[k] = float(np.degrees(turned[furthest] - turned[0]))
        checks[k] = float(track.time[begin + furthest] - track.time[begin])
    first = crossing(track.turned, np.radians(settings.switch_heading_deg))
    return {
        "first_overshoot": overshoots[0],
        "second_overshoot": overshoots[1],
        "first_yaw_check_time": checks[0],
        "second_yaw_check_time": checks[1],
        "initial_turning_distance": float(np.interp(first, np.arange(len(track.time)), track.travelled)),
        "initial_turning_time": float(track.at(first).time),
        "period": float(track.time[executes[3]] - track.time[executes[1]]) if len(executes) > 3 else missing,
    }


def _is_unchecked(track: Track, executes: list[int]) -> bool:
    """Whether the ship has made a full turn since the last execute."""
    return bool(abs(track.turned[-1] - track.turned[executes[-1]]) > 2.0 * np.pi)


def spiral_curve(track: Track, settings: ManoeuvreParameters) -> Array:
    """Rudder angle [°] and yaw rate [°/s] at the end of each step of a spiral, (2·n - 1, 2); the first is positive."""
    n, rows = settings.steps, step_ends(track, settings.hold_time, 2 * settings.steps - 1)
    share = 1.0 - 2.0 * np.array([*range(n), *range(n - 2, -1, -1)]) / (n - 1)
    return np.column_stack((settings.rudder_deg * share[: len(rows)], np.degrees(track.r[rows])))


def spiral(track: Track, settings: ManoeuvreParameters) -> Metrics:
    """The width of the loop in which an unstable ship turns against its rudder, and the yaw rate with the rudder amidships."""
    curve, n = spiral_curve(track, settings), settings.steps
    out, back = curve[:n], curve[n - 1 :]
    # The rudder angle at which the yaw rate changes its sign, on the way out and on the way back.
    zero = [float(np.interp(0.0, branch[:, 1], branch[:, 0])) for branch in (out[::-1], back)]
    middle = np.abs(np.interp(0.0, out[::-1, 0], out[::-1, 1])), np.abs(np.interp(0.0, back[:, 0], back[:, 1]))
    return {
        # A ship that turns on against the whole rudder has no such angle.
        "loop_width": abs(zero[1] - zero[0]) if out[0, 1] * out[-1, 1] < 0.0 else np.inf,
        "residual_yaw_rate": float(max(middle)),
        "largest_yaw_rate": float(np.abs(curve[:, 1]).max()),
    }


def crash_stop(track: Track, _settings: ManoeuvreParameters) -> Metrics:
    """Track reach along the path, head reach along the course, side reach across it, and the time, until the ship has stopped."""
    index = crossing(-track.u, 0.0)
    end = track.at(index)
    return {
        "track_reach": float(np.interp(index, np.arange(len(track.time)), track.travelled)),
        "head_reach": float(end.ahead),
        "side_reach": float(abs(end.aside)),
        "stopping_time": float(end.time),
    }


def speed_curve(track: Track, settings: ManoeuvreParameters) -> Array:
    """Share of the surge force and speed at the end of each speed run, (n, 2)."""
    rows = step_ends(track, settings.hold_time, settings.steps)
    return np.column_stack((np.arange(1, len(rows) + 1) / settings.steps, track.u[rows]))


def speed_run(track: Track, settings: ManoeuvreParameters) -> Metrics:
    """The speeds at the whole and at half of the surge force."""
    share, speed = speed_curve(track, settings).T
    return {"top_speed": float(speed[-1]), "half_force_speed": float(np.interp(0.5, share, speed))}


def bollard_pull(track: Track, _settings: ManoeuvreParameters) -> Metrics:
    """The surge force of a ship that is kept at rest, and the time in which it is reached."""
    return {
        "bollard_pull": float(track.force[-1]),
        "force_rise_time": float(track.at(crossing(track.force, RISEN * track.force[-1])).time),
    }


METRICS: dict[str, Callable[[Track, ManoeuvreParameters], Metrics]] = {
    each.__name__: each for each in (turning_circle, zigzag, spiral, crash_stop, speed_run, bollard_pull)
}
"""The metrics of each kind of manoeuvre."""


def is_complete(track: Track, settings: ManoeuvreParameters, found: Metrics) -> bool:
    """Whether a manoeuvre has come to its end: every metric is known, and what is to be steady is."""
    if np.isnan(list(found.values())).any():
        return False
    if settings.kind == "turning_circle":
        return _is_steady(track.r, track.r[-1]) and _is_steady(track.u, track.u[0])
    if settings.kind in ("spiral", "speed_run"):
        values = track.r if settings.kind == "spiral" else track.u
        count = 2 * settings.steps - 1 if settings.kind == "spiral" else settings.steps
        ends = step_ends(track, settings.hold_time, count)
        length = ends[0]
        return all(_is_steady(values[end - length + 1 : end + 1], np.abs(values).max()) for end in ends)
    return True


def step_ends(track: Track, hold: float, count: int) -> list[int]:
    """The last row of each step of a duration, s."""
    rows = round(hold / (track.time[1] - track.time[0]))
    return [min((k + 1) * rows, len(track.time)) - 1 for k in range(count)]


def _is_steady(values: Array, largest: float) -> bool:
    last = values[-max(len(values) // 5, 2) :]
    return bool(np.ptp(last) <= STEADY_CHANGE * abs(largest))
