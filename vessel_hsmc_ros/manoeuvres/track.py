"""The track of a manoeuvre from the execute on, seen from the side of the first turn.

The resolution measures from the midship point; here it is the origin of the hull's coordinates.
"""

from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.run_data import Run
from vessel_hsmc_ros.scenario.scenario import Scenario


class Track(NamedTuple):
    """A manoeuvre; components to the side of the first turn are positive, so that a turn to starboard equals one to port.

    Attributes:
        time: Since the execute, (n,) s.
        ahead, aside: Distance along the original course and perpendicular to it, (n,) m.
        turned: Change of heading, not wrapped, (n,) rad.
        u, v, r: Velocities, (n,).
        force, moment: The applied wrench, (n,).
        command: The commanded yaw moment, (n,).
    """

    time: Array
    ahead: Array
    aside: Array
    turned: Array
    u: Array
    v: Array
    r: Array
    force: Array
    moment: Array
    command: Array

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
    """The track of a simulated manoeuvre.

    Args:
        run: The run, whose plant and law have the same rate.
        scenario: Its scenario.
    """
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
