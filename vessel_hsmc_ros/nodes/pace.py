"""The pace of a node in real time: which periods are due, also after its clock was set or its process was stopped."""

from collections.abc import Callable
from typing import Any

from vessel_hsmc_ros.core.timing import NANOSECONDS, RateGrid, seconds

CATCH_UP = NANOSECONDS
"""Longest delay that is caught up with, ns: what a process missed for longer, or a clock leapt over, is skipped."""


class Pace:
    """The periods of a node in real time.

    Period k is due at `start` + k·T by the node's clock. Overdue periods are taken at once, as many as CATCH_UP holds. After
    more, or after the clock was set back, the start moves so that the present period is due now: no period is skipped or
    repeated, and the node goes on as after a pause. `grid`: the instants of the periods since the start. `start`: time of period
    0 by the node's clock, ns. `moves`: how often the start moved because of the clock or of a delay.
    """

    def __init__(self, node: Any, grid: RateGrid) -> None:
        self._node, self._grid = node, grid
        self.start = self._last = self.moves = 0

    def run(self, work: Callable[[], None]) -> None:
        """Start now, and call `work` once in every period."""
        self.start = self._last = self._node.now()
        # The steady clock, which is never set: a timer on a system clock that was set back fires only once it has caught up.
        simulated = self._node.get_parameter("use_sim_time").value
        self._node.create_timer(self._grid.period, work, clock=None if simulated else self._node.wall)

    def stamp(self, index: int) -> int:
        """Time of a period by the node's clock, ns."""
        return self.start + self._grid.stamp(index)

    def hold(self, index: int) -> None:
        """Let a period be due now, as during a pause; `due` reports no move for that."""
        self._last = self._node.now()
        self.start = self._last - self._grid.stamp(index)

    def due(self, index: int) -> tuple[int, str]:
        """The last period that is due.

        `index`: the present period of the node. Returns its index, and in words why the start has moved; empty if it has not.
        """
        now, last = self._node.now(), self._last
        late = now - self.stamp(index)
        reason = ""
        if now < last:
            reason = f"the clock was set back by {seconds(last - now):.3f} s"
        elif late > CATCH_UP:
            reason = f"{seconds(late):.3f} s were missed, more than the {seconds(CATCH_UP):g} s that are caught up with"
        if reason:
            self.moves += 1
            self.hold(index)
        self._last = now
        return self._grid.index(now - self.start), reason
